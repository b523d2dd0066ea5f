"""Entrance: how a host is let in by the clock, and how it takes its leave."""

from __future__ import annotations

from collections.abc import Sequence
from threading import Event

from rems_net.agents.protocol.alike import check_version
from rems_net.agents.protocol.limits import CAUSE, FILES, JOIN_TIME_EACH, SOURCE
from rems_net.agents.protocol.messages import (
    Admission,
    Farewell,
    Request,
    read_admission,
)
from rems_net.errors import FabricError
from rems_net.router.session import Session

#: how often a clock that does not answer is asked; right after a reconnect a question
#: may find nobody
TRIES = 20


class NoClock(FabricError):  # noqa: N818 - it may come yet
    """Nobody answers for the clock."""


def ask_in(session: Session, request: Request) -> Admission:
    """Ask the clock to be let in. Raises FabricError with the clock's reason, or
    NoClock.
    """
    payload, key = request.to_wire(), session.key("clock", "@join")
    if not request.ticket:  # what a run starts itself has its version
        check_version(session)
    # It waits behind all that was declared: a swarm keeps a router busy.
    patience = 2.0 + len(request.agents) * JOIN_TIME_EACH
    for _ in range(TRIES):
        for mail in session.ask(key, payload, patience, first=True):
            return read_admission(mail.payload)
        Event().wait(0.05)
    raise NoClock("no clock answers: no experiment runs on this fabric")


def say_farewell(
    session: Session,
    badge: int,
    made: Sequence[str],
    failed: tuple[str, str] | None,
) -> None:
    """Tell the clock how it ended, and see to it that it was heard.

    badge: the host's; the ticket of one that was never let in.
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
