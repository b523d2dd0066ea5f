"""Solo: a whole experiment in this process, stepped by its caller."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from threading import get_ident
from typing import Any, NamedTuple, NoReturn, Self

from rems_net.agents.agent import Agent
from rems_net.agents.diagnosis import failure
from rems_net.agents.overdue import naming_overdue
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick, time_of
from rems_net.defdict import Converter, Schema
from rems_net.engine.engine import Engine
from rems_net.engine.inlet import Inlet
from rems_net.engine.source import Given
from rems_net.engine.wiring import Entry, Written
from rems_net.errors import AgentError, ExperimentError, nearest
from rems_net.events import warn
from rems_net.maths.numerics import describe


class Member(NamedTuple):
    """An agent of an experiment: what its Ins are connected to, and its first tick."""

    agent: Agent
    sources: Mapping[str, str]
    since: int


class Solo:
    """Steps a whole experiment in this process: no network, no other process.

        with lab.engine() as engine:
            engine.step(20)
            print(engine["robot/sim"].state["x"])

    The values are those of `lab.run()`, to the last bit. With an engine of physics
    that needs a process which was started pinned, as `rems` starts its own: a warning
    says if this one was not.

    build: makes the members for a seed, prepared.  dt: seconds of a tick.  ticks:
    after which `run()` ends; None for no end.
    """

    def __init__(
        self,
        build: Callable[[int], Mapping[str, Member]],
        dt: float,
        ticks: int | None = None,
        *,
        seed: int = 0,
    ):
        self.dt, self.ticks, self.seed = dt, ticks, seed
        self._build = build
        #: the newest tick that was done; 0 before the first
        self.n = 0
        #: files that the outputs have made; known after `close`
        self.files: list[str] = []
        self._engine: Engine | None = None
        self._members: Mapping[str, Member] = {}
        self._entries: dict[str, Entry] = {}
        self._schemas: dict[str, Schema] = {}
        self._next = 1
        self._thread = 0

    @property
    def t(self) -> float:
        """Fabric time [s] at the end of the newest tick."""
        return time_of(self.n, self.dt)

    # -- its life ----------------------------------------------------------------

    def open(self) -> Self:
        """Build every agent and let it acquire what it needs. Returns itself."""
        if self._engine is not None:
            raise ExperimentError("this engine is open already; close() it first.")
        self._members = self._build(self.seed)
        engine = Engine()
        for member in self._members.values():
            agent = member.agent
            if not agent.lockstep:
                raise ExperimentError(
                    f"{agent.key} drives a device, which lives in wall time: an engine "
                    "steps models and simulations only. Run this experiment by "
                    "lab.run(), or give the robot another driver."
                )
            engine.add(agent)
        engine.wire({key: m.sources for key, m in self._members.items()})
        for inlet in engine.inlets:
            if inlet.source is None and inlet.schema is not None:
                inlet.sources = [Given(inlet.key, inlet.schema, engine.given)]
        self._entries = {key: _entry(m) for key, m in self._members.items()}
        self._schemas = {
            schema.digest: schema
            for m in self._members.values()
            for schema in m.agent.published().values()
        }
        self._warn_of_numerics()
        self.n, self._next, self.files = 0, 1, []
        self._engine, self._thread = engine, get_ident()
        try:
            with self._blamed(engine), naming_overdue():
                engine.open()
        except BaseException as error:
            self.__exit__(type(error), error)
            raise
        return self

    def close(self) -> None:
        """Close every agent. Raises AgentError for one that fails in it."""
        engine, self._engine = self._engine, None
        if engine is not None:
            self.files, failed = engine.close()
            if failed is not None:
                raise AgentError(*failed)

    def reset(self, seed: int | None = None) -> Self:
        """Begin again: every agent is made anew, with this seed or the same."""
        self.close()
        self.seed = self.seed if seed is None else seed
        return self.open()

    def __enter__(self) -> Self:
        return self if self._engine is not None else self.open()

    def __exit__(self, kind: object, error: BaseException | None, *_: object) -> None:
        try:
            self.close()
        except AgentError:
            if error is None:  # otherwise the first failure is the one to report
                raise

    # -- stepping ----------------------------------------------------------------

    def step(self, count: int = 1) -> None:
        """Do this many ticks. Raises AgentError for an agent that fails."""
        engine = self._here()
        if not engine.stepped():
            with naming_overdue(over=engine.stepped):
                self._step(engine, count)
        else:
            self._step(engine, count)

    def _step(self, engine: Engine, count: int) -> None:
        for _ in range(count):
            n = self.n + 1
            with self._blamed(engine):
                if n == self._next:
                    self._connect(engine, n)
                engine.step(Tick(n, time_of(n, self.dt), self.dt), _nothing)
            self.n = n

    def run(self, until: float | Callable[[Solo], bool] | None = None) -> None:
        """Step on until the experiment ends.

        until: fabric time [s], or a function of this engine that returns True when it
        is enough; asked after each tick.
        """
        self._here()
        if callable(until):
            while not until(self) and (self.ticks is None or self.n < self.ticks):
                self.step()
            return
        if until is None and self.ticks is None:
            raise ExperimentError(
                "this experiment has no end: give it a duration, or say run(until=10)."
            )
        last = self.ticks if until is None else round(until / self.dt)
        self.step(max(0, (last or 0) - self.n))

    def _connect(self, engine: Engine, n: int) -> None:
        """Connect the agents that take part from tick n on."""
        present = {k: e for k, e in self._entries.items() if e.since <= n}
        engine.connect(present, self._schemas.__getitem__, _elsewhere)
        later = [e.since for e in self._entries.values() if e.since > n]
        self._next = min(later, default=0)

    # -- from outside ------------------------------------------------------------

    def __getitem__(self, key: str) -> Any:
        """Return an agent by its key, such as `robot/sim`, or by its name alone."""
        agents = self._here().agents
        found = [k for k in agents if k == key or k.partition("/")[2] == key]
        if len(found) != 1:
            raise KeyError(
                f"there is no agent {key!r}; there is {', '.join(agents)}."
                f"{nearest(key, agents)}"
            )
        return agents[found[0]]

    def put(self, key: str, values: Mapping[str, Any]) -> None:
        """Put a value at an In that no agent writes, such as `robot/sim/command`.

        values: fields in the units of the In, or quantities. The agent takes them at
        its next step; a robot obeys a command for its `max_age`.
        """
        engine = self._here()
        inlet = next((i for i in engine.inlets if i.key == key), None)
        if inlet is None or inlet.schema is None or inlet.source is not None:
            free = [i.key for i in engine.inlets if i.source is None and i.schema]
            why = "is no In here"
            if inlet is not None and inlet.source is not None:
                why = f"reads {inlet.source!r} already"
            raise ExperimentError(
                f"{key!r} {why}; values can be put at: {', '.join(free) or 'nothing'}."
                f"{nearest(key, free)}"
            )
        engine.given[key] = inlet.schema(values)

    def stop(self) -> None:
        """Hold every robot at its safe command, as `rems stop` does."""
        self._here().hold(True)

    def release(self) -> None:
        """Let the robots obey their commands again."""
        self._here().hold(False)

    # -- for itself --------------------------------------------------------------

    def _here(self) -> Engine:
        """Return the engine, if it may be used now. Raises ExperimentError."""
        if self._engine is None:
            raise ExperimentError("this engine is closed; open() it first.")
        if self._thread != get_ident():
            raise ExperimentError(
                "this engine was opened in another thread; an engine is used in one "
                "thread only. Open one for each."
            )
        return self._engine

    @contextmanager
    def _blamed(self, engine: Engine) -> Iterator[None]:
        """Raise what an agent's code raises as an AgentError that names the agent."""
        try:
            yield
        except (Exception, SystemExit) as error:
            agent, cause = failure(engine.acting or "the experiment", error)
            raise AgentError(agent, cause) from error

    def _warn_of_numerics(self) -> None:
        """Warn, once in a process, if engines of physics may give other last digits."""
        global _warned
        physics = sorted({lib for m in self._members.values() for lib in m.agent.needs})
        if physics and not _warned and not describe().endswith("pinned"):
            _warned = True
            warn(
                "numerics",
                f"this process was not started pinned: the last digits of "
                f"{' and '.join(physics)} may differ from those of `rems run`.",
            )


_warned = False


def _entry(member: Member) -> Entry:
    agent = member.agent
    return Entry(
        agent.key,
        agent.key,
        {port: schema.digest for port, schema in agent.published().items()},
        list(member.sources.values()),
        runtime(agent).every,
        since=member.since,
    )


def _elsewhere(inlet: Inlet, written: Written, converter: Converter) -> NoReturn:
    """Refuse a source that is not in this engine."""
    raise ExperimentError(f"{inlet.key} reads {written.key}, which is not here.")


def _nothing(kind: str, tick: Tick) -> None:
    """After a phase nothing has to be sent."""
