"""Identity: role and team of a session's user at a router with users.

The router drops what is refused, and Zenoh reports nothing. So a program asks before it
acts, and explains a refusal in a sentence.
"""

import os
from collections.abc import Callable, Sequence
from threading import Event
from typing import Any, NamedTuple

from rems_net.errors import DeniedError, WireError
from rems_net.router.gate.access import GUESTS, ROLES, WHO, is_of_team
from rems_net.router.gate.users import Users
from rems_net.router.keys import is_name
from rems_net.router.mail import Question
from rems_net.router.message import pack, read
from rems_net.router.session import Session

#: count. Attempts to ask the router.
TRIES = 10


class Identity(NamedTuple):
    """Role and team of a user.

    role: `members`, `guests`, or "" for a user with a team;
    fabric: the class's.
    """

    role: str
    team: str
    fabric: str

    def may_see(self, fabric: str) -> bool:
        """Return whether this user may read there, command robots, and stop them."""
        return not self.team or fabric == self.fabric or is_of_team(self.team, fabric)


def answer_for(
    users: Users,
    fabric: str,
    seen_by: Callable[[str], Sequence[Any]] = lambda user: (),
) -> Callable[[Question], None]:
    """Return the function that answers users' questions for their identity.

    seen_by: the people that a user may see; asked for with `?people`. The router lets
    each user ask at the own name only.
    """
    known = users.identities()

    def answer(question: Question) -> None:
        name = question.key.rpartition("/")[2]
        if "people" in question.parameters:
            question.answer(question.key, pack([list(p) for p in seen_by(name)]))
        elif found := known.get(name):
            question.answer(question.key, pack([*found, fabric]))

    return answer


def identity(session: Session) -> Identity | None:
    """Return the identity of this session's user; None at a router without users."""
    user = session.link.user
    if not user:
        return None
    answers = []
    for _ in range(TRIES):  # a router that has just started may not answer yet
        if answers := session.ask(f"{WHO}/{user}", first=True):
            break
        Event().wait(0.05)
    for mail in answers:
        words = read(mail.payload)
        if type(words) is not list or len(words) != 3:
            raise WireError("the router's answer is no identity. (R0621)")
        role, team, fabric = words
        if role in ("", *ROLES) and (is_name(team) or team == "") and is_name(fabric):
            return Identity(role, team, fabric)
    return None


def vouches(session: Session) -> bool:
    """Return whether the router lets only this user's team, and teachers, run here.

    A router without users vouches for nobody: it admits no session with a user name,
    and without a user name this asks nothing.
    """
    known = identity(session)
    return bool(known and known.team and is_of_team(known.team, session.fabric))


def team_of(session: Session) -> str:
    """Return the team of this session's user; "" for none, as for a teacher."""
    known = identity(session)
    return known.team if known is not None else ""


def check_sees(session: Session) -> None:
    """Raise DeniedError if this user's team may not see the fabric."""
    known = identity(session)
    if known is not None and not known.may_see(session.fabric):
        raise DeniedError(
            f"{_who(session, known)}, which has the fabrics {known.team!r} and "
            f"'{known.team}-...', and a look at {known.fabric!r}; {session.fabric!r} "
            f"is another's: give --fabric {known.team}. (R0609)"
        )


def check_member(session: Session) -> None:
    """Raise DeniedError if this user may not bring a clock or agents."""
    known, link = identity(session), session.link
    if known is None:
        return
    if known.role == GUESTS:
        todo = (
            "Join as a member (rems router use ADDRESS --user NAME), or run on your "
            "laptop alone: rems router forget"
        )
        if os.environ.get("REMS_ROUTER"):
            todo = (
                "Set REMS_USER and REMS_PASSWORD to those of a member, or use a router "
                "of your own (unset REMS_ROUTER)."
            )
        raise DeniedError(
            f"{link.user!r} is a guest of the router at {link.endpoint}: guests "
            f"may {ROLES[GUESTS]}, and no more. {todo} (R0609)"
        )
    if known.team and not is_of_team(known.team, session.fabric):
        there = "is another's"
        if session.fabric == known.fabric:
            there = "is the whole class's: read there, command robots, and stop them"
        raise DeniedError(
            f"{_who(session, known)}: the fabrics {known.team!r} and "
            f"'{known.team}-...' are yours, and {session.fabric!r} {there}. Type: "
            f"--fabric {known.team} (R0609)"
        )


def _who(session: Session, known: Identity) -> str:
    link = session.link
    return f"At {link.endpoint} {link.user!r} is of the team {known.team!r}"
