"""Borrowing: robots of an open fabric, which come to a run and go home after it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from threading import Event, Thread
from typing import TYPE_CHECKING, NamedTuple

from rems_net.agents.agent import Process
from rems_net.agents.ports import In, Out, Settings
from rems_net.agents.protocol.plan import Plan
from rems_net.agents.robot import Driver, join
from rems_net.agents.runtime import runtime
from rems_net.agents.verbs import request
from rems_net.defdict import DefDict, Schema, blob, text
from rems_net.errors import ExperimentError, FabricError
from rems_net.events import info
from rems_net.router.keys import FABRIC

if TYPE_CHECKING:
    from rems_net.router.session import Session

#: seconds a robot may take to answer, and between two questions
PATIENCE, PAUSE = 15.0, 1.0


class Lent(Driver):
    """A robot of an open fabric that has this name, and is lent for the run.

    By `rems agent robot`, or by its own firmware. It is free-running, and needs a run
    at a pace. It goes home when the run is over.
    """

    lockstep = False
    options = Settings(fabric=text(default=FABRIC, doc="whose it is"))

    def open(self) -> None:
        """Nothing is started for it."""
        raise ExperimentError(
            f"{self.key} is lent: it is started by itself, by `rems agent robot` or by "
            "its own firmware."
        )

    def drive(self, command: DefDict, dt: float) -> None:
        """It is driven where it is."""

    def sense(self) -> None:
        """It says itself where it is."""


class Relay(Process):
    """Says what it is told in the units and ranges of a schema, for who takes no other.

    A lent robot may be its own firmware, which converts nothing.
    """

    options = Settings(wire=blob(doc="the schema"))
    told = In()
    value = Out()

    def prepare(self) -> None:
        """Settle both ports."""
        super().prepare()
        schema = Schema.from_wire(self.options["wire"])
        self.settle("told", schema)
        self.settle("value", schema)

    def step(self, tick: object) -> None:
        """Pass it on; it is as old as it came."""
        if "told" in runtime(self).source_ticks:
            self.value = self.told


def relayed(plan: Plan) -> Plan | None:
    """The relay of what commands a lent robot, which is connected to it from now on.

    None for any other robot, and for one that programs outside command.
    """
    if not issubclass(plan.classes[-1], Lent) or "command" not in plan.sources:
        return None
    definition, driver = plan.classes
    robot = join(definition, driver)(plan.name, parameters=plan.parameters)
    robot.prepare()
    relay = Plan(
        "process",
        f"{plan.name}.command",
        [Relay],
        options={"wire": robot.command.schema.to_wire()},
        sources={"told": plan.sources["command"]},
        host=f"process/{plan.name}.command",
        since=plan.since,
        folder=plan.folder,
    )
    plan.sources["command"] = f"{relay.key}/value"
    return relay


class Borrowed(NamedTuple):
    """A robot that a run asks for.

    home: the fabric that it is on; sources: what its Ins are connected to in the run.
    """

    robot: str
    home: str
    sources: Mapping[str, str]


def borrowed(plans: Iterable[Plan], factor: float) -> list[Borrowed]:
    """The robots that are lent to these plans. Raises ExperimentError."""
    found = []
    for plan in plans:
        if issubclass(plan.classes[-1], Lent):
            options = Lent.options.schema(plan.options)
            found.append(Borrowed(plan.key, str(options.fabric), plan.sources))
    if found and not factor:
        raise ExperimentError(
            f"{found[0].robot} is lent, and lives in real time; give this run a pace: "
            "pace = 1.0, or --pace 1"
        )
    return found


class Borrowing:
    """Asks for each robot, again and again, until it is here, or nobody wants it.

    It begins as all robots of a run do: where it is, it is reset.
    """

    def __init__(
        self,
        session: Session,
        robots: Iterable[Borrowed],
        here: Callable[[], Iterable[str]],
    ):
        self._session, self._here = session, here
        self._told: set[str] = set()
        self._ended = Event()
        self._threads = [
            Thread(target=self._ask, args=(one,), daemon=True) for one in robots
        ]
        for thread in self._threads:
            thread.start()

    def wait(self) -> None:
        """Wait until all that have joined are reset, too."""
        for thread in self._threads:
            thread.join(PATIENCE)

    def close(self) -> None:
        """Nobody is asked any more."""
        self._ended.set()

    def _ask(self, one: Borrowed) -> None:
        from rems_net.agents.protocol.messages import Loan

        key = f"{one.home}/{one.robot}/@lend"
        loan = Loan(self._session.fabric, one.sources).to_wire()
        before = ""
        while not self._ended.is_set() and one.robot not in self._here():
            why = f"there is no {one.robot} on {one.home!r} yet"
            try:
                if self._session.ask(key, loan, PATIENCE, first=True):
                    reset = self._session.key(one.robot, "@call", "reset")
                    self._session.ask(reset, request((), {}), PATIENCE, first=True)
                    return
            except FabricError as error:
                why = f"{one.robot} does not come: {error}"
            self._ended.wait(PAUSE)
            # Told at the second time: right after a start many a thing is not found.
            if why == before and why not in self._told and not self._ended.is_set():
                self._told.add(why)
                info("lent", why)
            before = why
