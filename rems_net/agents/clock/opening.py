"""Opening: how a clock takes a fabric over, which has room for one."""

from __future__ import annotations

from collections.abc import Callable

from rems_net.agents.protocol.alike import tell_version
from rems_net.errors import FabricError
from rems_net.router.mail import Question
from rems_net.router.message import pack
from rems_net.router.session import Session

#: seconds to wait for another clock, or a keeper of STOP, to answer
PATIENCE = 0.5


def become_clock(
    session: Session,
    run: int,
    watch: Callable[[], None],
    tell_age: Callable[[Question], None],
    tell: Callable[[str], None],
) -> None:
    """Show that this session is the clock of `run`, hear (`watch`), and answer.

    tell: called with a sentence about who comes with another version of rems_net.
    Raises FabricError if there is another clock already.
    """
    key = session.key
    if session.who(key("clock", "@alive")):
        raise _taken(session)
    session.present(key("clock", "@alive"))
    session.present(key("clock", "@run", str(run)))
    watch()
    session.answer_at_once(key("clock", "@age"), tell_age)
    session.answer_at_once(key("clock", "@version"), tell_version(session, tell))
    # Of two that start in the same instant, one sees the other at least.
    if len(session.ask(key("clock", "@age"), timeout=PATIENCE)) > 1:
        raise _taken(session)


def stop_holds(session: Session) -> bool:
    """Whether a router or a host says that STOP was said, and never released."""
    answers = session.ask(session.key("stop", "@holds"), timeout=PATIENCE)
    return any(mail.payload == pack(True) for mail in answers)


def _taken(session: Session) -> FabricError:
    return FabricError(
        f"The fabric {session.fabric!r} has a clock already: another experiment runs "
        f"at {session.link.endpoint}. Wait for its end, or use a router of your own "
        "(unset REMS_ROUTER)."
    )
