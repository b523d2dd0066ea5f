"""Serving: an open fabric, which never ends and waits for no agent."""

import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from rems_net.agents.clock.clock import Clock
from rems_net.agents.clock.pacing import NEEDS_PACE
from rems_net.agents.experiment.folder import own_folder
from rems_net.agents.experiment.hosting.hosts import Hosts
from rems_net.agents.experiment.lineup import Lineup
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.alike import check_version
from rems_net.agents.protocol.terms import Terms
from rems_net.agents.verbs import Verbs
from rems_net.errors import AgentError, ExperimentError, FabricError, WireError
from rems_net.events import Event
from rems_net.router import find
from rems_net.router.gate.access import is_of_team
from rems_net.router.gate.identity import check_member, team_of
from rems_net.router.keys import FABRIC
from rems_net.router.message import LAST_TICK, read
from rems_net.router.session import Session


def serve(
    session: Session,
    dt: float,
    pace: float,
    begin: Callable[[Clock], None] = lambda clock: None,
) -> None:
    """Be the clock of this session's fabric, for ever. Raises FabricError.

    dt: seconds of a tick.  pace: real-time factor, above 0.
    begin: called once the clock is open.
    """
    if not pace > 0:
        raise ExperimentError(NEEDS_PACE)
    clock = Clock(session, Terms(dt, LAST_TICK, pace, open=True))
    clock.open()
    begin(clock)
    try:
        clock.gather()
        clock.run(LAST_TICK)
    finally:
        clock.release(0.0)


#: s, and a factor of real time, for a fabric that a team's first agent opens.
DT, PACE = 0.02, 1.0


@contextmanager
def ticking(session: Session, show: Show) -> Iterator[None]:
    """Be the clock of a team's fabric that has none, while the block runs."""
    found: list[Clock] = []
    begun = threading.Event()

    def tick() -> None:
        try:
            # Another laptop began in the same instant; or a member did not finish.
            with suppress(FabricError, AgentError):
                serve(session, DT, PACE, begin)
        finally:
            begun.set()

    def begin(clock: Clock) -> None:
        clock.broadcaster.reports = False  # the agents of this program report it
        found.append(clock)
        begun.set()

    thread = threading.Thread(target=tick, daemon=True)
    thread.start()
    begun.wait()
    if found:
        text = f"fabric {session.fabric!r} had no clock: this program is its clock now"
        show.say("clock", Event("info", 0, "clock", "clock", text))
    try:
        yield
    finally:
        for clock in found:
            clock.pacing.end()
        thread.join()


def _length(session: Session) -> float:
    """Return the length of the ticks of a clock in s; 0 if it does not answer."""
    for mail in session.ask(session.key("clock", "tick"), first=True):
        with suppress(WireError):  # any program can answer anything
            found = read(mail.payload)
            if type(found) is dict and type(found.get("dt")) is float:
                return float(found["dt"])
    return 0.0


def attend(lab: Lineup, out: Path | str | None, show: Show) -> None:
    """Bring all agents of a lineup to an open fabric, and stay until interrupted.

    They join the lineup's fabric, else that of the team that was joined, else the
    common one. A team's fabric without a clock has its clock here. The sources of their
    Ins may come later, and go. out: folder of the outputs' files. Raises
    ExperimentError before anything has started, FabricError if there is no router, and
    AgentError for an agent that fails.
    """
    agents, plans = lab.build(), lab.by_host()
    for key, agent in agents.items():
        if any(isinstance(port, Verbs) for port in agent.ports().values()):
            raise ExperimentError(
                f"{key} calls verbs, which robots receive in one experiment with it; "
                "on an open fabric they are called by `rems call` or rems_net.join()."
                " (R0424)"
            )
    with ExitStack() as stack:
        session = stack.enter_context(find.open_session(lab.fabric))
        team = team_of(session)
        if not (lab.fabric or team):
            session = session.on(FABRIC)
        check_member(session)
        check_version(session)
        link, there = session.link, find.fabrics(session)
        dt = DT  # of a clock that this program brings
        if session.fabric in there:
            dt = _length(session)
            session.close()
        elif is_of_team(team, session.fabric):
            stack.enter_context(ticking(session, show))
        elif there:
            raise FabricError(
                f"nothing runs on the fabric {session.fabric!r} at {link.endpoint}. "
                f"Start it: rems router serve --fabric {session.fabric}. Or choose "
                f"another by --fabric: {', '.join(there)} (R0602)"
            )
        hosts = Hosts(plans, agents, show, lab.dt, native=lab.native)
        folder = own_folder(lab, out, agents, show, dt=dt)
        if any(plan.kind == "output" for plan in lab.plans.values()):
            stack.enter_context(folder)
        try:
            hosts.start(link, free=True)
            hosts.wait()
        finally:
            hosts.leave()
