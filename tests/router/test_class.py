"""A router with a class list: teams are kept apart."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from rems_net.errors import FabricError
from rems_net.router.gate.classlist import load_class
from rems_net.router.gate.identity import Identity, check_member, check_sees, identity
from rems_net.router.gate.users import Users
from rems_net.router.mail import Mail, Mailbox
from rems_net.router.message import pack
from rems_net.router.session import Session
from rems_net.router.settings import Link
from rems_net.router.stop_store import FABRICS, class_router
from tests.agents.runs import free_port, until
from tests.router.conftest import asks, empty


class Class:
    """A router with this list, in this process."""

    def __init__(self, endpoint: str, users: Users):
        self.endpoint, self.users = endpoint, users

    def session(self, user: str) -> Session:
        password = self.users.passwords[user]
        return Session(Link(self.endpoint, user=user, password=password))


@pytest.fixture
def router(names: Path) -> Iterator[Class]:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    users = load_class(names, "rems")
    with class_router(endpoint, users):
        yield Class(endpoint, users)


@pytest.fixture
def anna(router: Class) -> Iterator[Session]:
    with router.session("anna.berg") as session:
        yield session


@pytest.fixture
def teacher(router: Class) -> Iterator[Session]:
    with router.session("teacher") as session:
        yield session


# -- what a team may do --------------------------------------------------------------

OWN = [
    "team1/clock/@step/tick",
    "team1/clock/tick",
    "team1/robot/sim/state",
    "team1/stop",
    "team1-b/robot/sim/command",
    "team1-b/clock/@step/roster",
]
OF_ALL = ["rems/robot/sim/command", "rems/stop"]
REFUSED = [
    "team2/robot/sim/command",
    "team2/clock/@step/tick",
    "team2/stop",
    "team10/robot/sim/command",
    "team/robot/sim/command",
    "rems/clock/@step/tick",
    "rems/robot/sim/state",
    "rems/robot/sim/@lease",
    "rems-b/robot/sim/command",
]
GLOBS = ["**", "*/stop", "*/robot/*/command", "team$*/stop"]


def test_what_a_team_puts(teacher: Session, anna: Session) -> None:
    """What is refused is dropped by the router, and reaches nobody."""
    heard = Mailbox()
    for key in (*OWN, *OF_ALL, *REFUSED):
        teacher.watch(key, heard)
    teacher.watch("team1/last", heard)
    publisher = anna.publisher("team1/last")
    until(lambda: publisher.watched)
    for key in (*OWN, *OF_ALL, *REFUSED, *GLOBS):
        anna.put(key, key.encode())
    publisher.put(b"last")  # a session's messages stay in order
    got = []
    while (mail := heard.get(20.0)) is not None:
        assert isinstance(mail, Mail)
        if mail.payload == b"last":
            break
        got.append(mail.payload.decode())
    assert sorted(got) == sorted([*OWN, *OF_ALL])


def test_what_a_team_reads(router: Class, teacher: Session, anna: Session) -> None:
    heard = Mailbox()
    for key in ("rems/**", "team1/**", "team2/**", "**", "*/robot/**"):
        anna.watch(key, heard)
    anna.watch("rems/clock/@step/tick", heard)  # it waits for who reads it
    allowed = ["rems/robot/sim/state", "team1/robot/sim/state"]
    with router.session("ben.cho") as ben:
        last = ben.publisher("rems/robot/sim/command")
        until(lambda: last.watched)
        for key in ("team2/robot/sim/state", "team2/last"):
            ben.answer_at_once(key, empty)
            ben.put(key, b"2")
        last.put(b"last of ben")
        for key in allowed:
            teacher.answer_at_once(key, empty)
            teacher.put(key, key.encode())
        teacher.put("rems/clock/@step/tick", b"tick")
        teacher.put("team1/last", b"last")
        got: set[bytes] = set()
        while not {b"last of ben", b"last"} <= got:
            mail = heard.get(20.0)
            assert isinstance(mail, Mail)
            got.add(mail.payload)
        assert got == {b"last of ben", b"last", *(key.encode() for key in allowed)}
        for key in allowed:
            assert [m.key for m in anna.ask(key)] == [key]
        assert anna.ask("team2/robot/sim/state", timeout=0.5) == []
        assert anna.ask("*/robot/sim/state", timeout=0.5) == []
        # ...but who is there is no secret.
        ben.present("team2/robot/sim/@alive")
        until(lambda: anna.who("*/robot/*/@alive") == ["team2/robot/sim/@alive"])


def test_a_team_that_says_stop_everywhere_leaves_room_for_others(
    router: Class, anna: Session
) -> None:
    """What a router remembers is bounded, for each team."""
    with router.session("ben.cho") as ben:
        for i in range(FABRICS + 1):
            anna.put(f"team1-{i}/stop", pack(True))
        until(lambda: anna.ask(f"team1-{FABRICS - 1}/stop/@holds"))
        ben.put("team2/stop", pack(True))
        until(lambda: ben.ask("team2/stop/@holds"))
    held = {one for i in (0, FABRICS) for one in anna.ask(f"team1-{i}/stop/@holds")}
    assert [mail.key for mail in held] == ["team1-0/stop/@holds"]


def test_what_a_team_asks_of_the_class(teacher: Session, anna: Session) -> None:
    allowed = [
        "rems/clock/roster",
        "rems/clock/@age",
        "rems/robot/sim/@schema",
        "rems/robot/sim/@stopped",
        "rems/robot/sim/@call/reset",
        "rems/robot/sim/@lease",
        "rems/robot/sim/@why",
    ]
    refused = [
        "rems/clock/@join",
        "rems/clock/@member",
        "rems/clock/@call/end",
        "team2/robot/sim/@lease",
        "team2/clock/@join",
    ]
    asks(anna, teacher, allowed, refused)


def test_nobody_answers_for_another_team(router: Class, anna: Session) -> None:
    anna.answer_at_once("team2/robot/sim/state", empty)
    anna.present("team2/clock/@alive")
    anna.present("rems/clock/@alive")
    anna.present("team1/clock/@alive")
    with router.session("ben.cho") as ben:
        until(lambda: ben.who("*/clock/@alive") == ["team1/clock/@alive"])
        assert ben.ask("team2/robot/sim/state", timeout=0.5) == []


# -- being told ----------------------------------------------------------------------


def test_a_user_learns_of_no_other_user(
    router: Class, anna: Session, teacher: Session
) -> None:
    for session, others in ((anna, ("teacher", "ben.cho")), (teacher, ("anna.berg",))):
        assert identity(session) is not None
        for other in (*others, "*", "t*"):
            assert session.ask(f"@rems/who/{other}", timeout=0.5) == []


def test_who_one_is(router: Class, anna: Session, teacher: Session) -> None:
    assert identity(anna) == Identity("", "team1", "rems")
    assert identity(teacher) == Identity("members", "", "rems")
    for fabric in ("team1", "team1-b"):
        check_member(anna.on(fabric))
        check_sees(anna.on(fabric))
    check_sees(anna)
    for fabric in ("rems", "team1", "team2"):
        check_member(teacher.on(fabric))
        check_sees(teacher.on(fabric))
    start = f"At {router.endpoint} 'anna.berg' is of the team 'team1'"
    with pytest.raises(FabricError) as caught:
        check_sees(anna.on("team10"))
    assert str(caught.value) == (
        f"{start}, which has the fabrics 'team1' and 'team1-...', and a look at "
        "'rems'; 'team10' is another's: give --fabric team1."
        " (R0609)"
    )
    with pytest.raises(FabricError) as caught:
        check_member(anna.on("team2"))
    assert str(caught.value) == (
        f"{start}: the fabrics 'team1' and 'team1-...' are yours, and 'team2' is "
        "another's. Type: --fabric team1 (R0609)"
    )
    with pytest.raises(FabricError, match="'rems' is the whole class's: read there"):
        check_member(anna)
