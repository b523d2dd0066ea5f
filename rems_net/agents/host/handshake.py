"""Handshake: a host's admission by the clock, and its farewell."""

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from threading import Event

from rems_net.agents.about.wiring import Entry
from rems_net.agents.agent import Agent
from rems_net.agents.host.outlet import Outlet
from rems_net.agents.protocol.alike import check_version, laptop
from rems_net.agents.protocol.limits import (
    CAUSE,
    FILES,
    JOIN_TIME_EACH,
    NUMERICS,
    SOURCE,
)
from rems_net.agents.protocol.messages import (
    Admission,
    Farewell,
    Request,
    read_admission,
)
from rems_net.agents.runtime import runtime
from rems_net.engine.inlet import Inlet
from rems_net.errors import FabricError
from rems_net.events import warn
from rems_net.maths.numerics import describe
from rems_net.router.session import Session

#: Number of questions to a silent clock; one right after a reconnect may get lost.
TRIES = 20


class NoClock(FabricError):  # noqa: N818 - it may come yet
    """No clock answers."""


def introduction(
    host: str,
    ticket: int,
    agents: Mapping[str, Agent],
    since: Mapping[str, int],
    inlets: Sequence[Inlet],
    outlets: Sequence[Outlet],
    *,
    stopped: bool,
    near: bool,
) -> Request:
    """Return a host's request for admission: itself, its agents and their ports.

    near: whether it lives in the process of the run.
    """
    closing = [f"{o.agent.key}/{o.port}" for o in outlets if o.closing]
    outs: dict[str, dict[str, str]] = {key: {} for key in agents}
    reads: dict[str, list[str]] = {key: [] for key in agents}
    for outlet in outlets:
        outs[outlet.agent.key][outlet.port] = outlet.digest
    for inlet in inlets:
        if inlet.source:
            reads[inlet.agent.key].append(inlet.source)
    entries = [
        Entry(k, host, outs[k], reads[k], run.every, run.in_step, since[k])
        for k, run in ((k, runtime(a)) for k, a in agents.items())
    ]
    schemas = {o.digest: o.value.schema for o in outlets}
    # The program of a run is seldom pinned. Only physics engines need that, and the run
    # has warned of those.
    numerics = "" if near else describe()[:NUMERICS]
    return Request(
        host,
        laptop(),
        os.getpid(),
        closing[0] if closing else "",
        entries,
        {digest: schema.to_wire() for digest, schema in schemas.items()},
        stopped,
        ticket,
        numerics,
    )


def wait_for_clock(
    session: Session, request: Request, look: Callable[[], None]
) -> Admission:
    """Ask until a clock admits the host; warn once. Raises FabricError if it refuses.

    look: called between two questions; its exception ends the waiting.
    """
    told = False
    while True:
        with suppress(NoClock):
            return ask_in(session, request)
        if not told:
            told = True
            warn("waiting", _nobody(session))
        look()


def _nobody(session: Session) -> str:
    endpoint = session.link.endpoint
    if session.connected:
        return f"no clock at {endpoint} yet; waiting"
    # Imported here: each process of a run asks for admission, and hardly one waits.
    from rems_net.router.gate.probe import stranger

    if why := stranger(endpoint):  # also why the router refuses this laptop
        return f"{why}; waiting"
    return (
        f"no router answers at {endpoint} any more; waiting. If it has moved, end "
        "this by Ctrl+C, type `rems router use` with its new address, and start it "
        "again"
    )


def ask_in(session: Session, request: Request) -> Admission:
    """Ask the clock for admission. Raises FabricError with its reason, or NoClock."""
    payload, key = request.to_wire(), session.key("clock", "@join")
    if not request.ticket:  # a host that this machine's run starts has its version
        check_version(session)
    # The question waits behind all declarations: a swarm keeps a router busy.
    patience = 2.0 + len(request.agents) * JOIN_TIME_EACH
    for _ in range(TRIES):
        for mail in session.ask(key, payload, patience, first=True):
            return read_admission(mail.payload)
        Event().wait(0.05)
    raise NoClock(
        "no clock answers: no experiment runs on this fabric; start "
        "one, or name another fabric: --fabric NAME (R0602)"
    )


def say_farewell(
    session: Session,
    badge: int,
    made: Sequence[str],
    failed: tuple[str, str] | None,
) -> None:
    """Send the clock the end of a host, until an answer comes.

    badge: the host's; the ticket of one that was never admitted.
    made: the files of its outputs.  failed: the agent and the cause.
    """
    if failed is not None:
        failed = failed[0][:SOURCE], failed[1][:CAUSE]
    payload = Farewell(badge, made[:FILES], failed).to_wire()
    for _ in range(TRIES):
        if not badge or session.ask(
            session.key("clock", "@leave"), payload, first=True
        ):
            return
        Event().wait(0.1)
