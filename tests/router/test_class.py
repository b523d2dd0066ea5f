"""A class list: teams are kept apart by the router, and passwords are on slips."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from rems_net.errors import FabricError
from rems_net.router.gate.classlist import load_class, slips_of, typed
from rems_net.router.gate.standing import Standing, check_member, check_sees, standing
from rems_net.router.gate.users import Users
from rems_net.router.keeper import class_router
from rems_net.router.mail import Mail, Mailbox, Question
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import free_port, until

NAMES = """\
Name;Team
Anna Berg;team1
Ben Cho;Team2
Çelik Öz;team1
"""
unix = pytest.mark.skipif(not hasattr(os, "getuid"), reason="files have no mode here")


@pytest.fixture
def names(tmp_path: Path) -> Path:
    path = tmp_path / "names.csv"
    path.write_text(NAMES, encoding="utf-8")
    return path


class Class:
    """A router with this list, in this process."""

    def __init__(self, endpoint: str, users: Users):
        self.endpoint, self.users = endpoint, users

    def session(self, user: str, fabric: str = "rems") -> Session:
        password = self.users.passwords[user]
        return Session(Link(self.endpoint, fabric=fabric, user=user, password=password))


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


def empty(question: Question) -> None:
    question.answer(question.key, b"")


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
    "rems/robot/sim/@lend",
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
    while (mail := heard.get(5.0)) is not None:
        assert isinstance(mail, Mail)
        if mail.payload == b"last":
            break
        got.append(mail.payload.decode())
    assert sorted(got) == sorted([*OWN, *OF_ALL])


def test_what_a_team_reads(router: Class, teacher: Session, anna: Session) -> None:
    heard = Mailbox()
    for key in ("rems/**", "team1/**", "team2/**", "**", "*/robot/**"):
        anna.watch(key, heard)
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
        teacher.put("team1/last", b"last")
        got: set[bytes] = set()
        while not {b"last of ben", b"last"} <= got:
            mail = heard.get(5.0)
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


def test_what_a_team_asks_of_the_class(teacher: Session, anna: Session) -> None:
    allowed = [
        "rems/clock/roster",
        "rems/clock/@age",
        "rems/robot/sim/@schema",
        "rems/robot/sim/@stopped",
        "rems/robot/sim/@call/reset",
        "rems/robot/sim/@why",
    ]
    refused = [
        "rems/clock/@join",
        "rems/clock/@lent",
        "rems/clock/@call/end",
        "rems/robot/sim/@lend",
        "team2/clock/@join",
    ]
    for key in (*allowed, *refused):
        teacher.answer_at_once(key, empty)
    until(lambda: anna.ask(allowed[-1], timeout=0.5))
    for key in allowed:
        assert [m.key for m in anna.ask(key)] == [key]
    for key in refused:
        assert anna.ask(key, timeout=0.5) == []
        assert len(teacher.ask(key)) == 1


def test_nobody_answers_for_another_team(router: Class, anna: Session) -> None:
    anna.answer_at_once("team2/robot/sim/state", empty)
    anna.present("team2/clock/@alive")
    anna.present("rems/clock/@alive")
    anna.present("team1/clock/@alive")
    with router.session("ben.cho") as ben:
        until(lambda: ben.who("*/clock/@alive") == ["team1/clock/@alive"])
        assert ben.ask("team2/robot/sim/state", timeout=0.5) == []


# -- being told ----------------------------------------------------------------------


def test_who_one_is(router: Class, anna: Session, teacher: Session) -> None:
    assert standing(anna) == Standing("", "team1", "rems")
    assert standing(teacher) == Standing("members", "", "rems")
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
        "'rems'; 'team10' is another's."
    )
    with pytest.raises(FabricError) as caught:
        check_member(anna.on("team2"))
    assert str(caught.value) == (
        f"{start}: the fabrics 'team1' and 'team1-...' are yours, and 'team2' is "
        "another's. Type: --fabric team1"
    )
    with pytest.raises(FabricError, match="'rems' is the whole class's: read there"):
        check_member(anna)


# -- the list, and its slips ---------------------------------------------------------


def test_passwords_are_made_once(names: Path) -> None:
    first = load_class(names, "rems")
    assert first.count == "3 students in 2 teams, 1 teacher"
    assert first.teams == {"team1": ["anna.berg", "celik.oz"], "team2": ["ben.cho"]}
    assert len(set(first.passwords.values())) == 4
    assert all(len(word) == 14 for word in first.passwords.values())
    assert not any(word in repr(first) for word in first.passwords.values())
    slips = slips_of(names)
    assert slips.name == "names.slips.txt"
    text = slips.read_text(encoding="utf-8")
    anna = f"--user anna.berg\n  password: {first.passwords['anna.berg']}\n"
    assert anna in text
    assert names.read_text(encoding="utf-8") == NAMES  # it is left as it is
    names.write_text(NAMES + "Dora;team3\n", encoding="utf-8")
    second = load_class(names, "rems")
    assert second.passwords.items() > first.passwords.items()
    assert second.passwords["dora"] in slips.read_text(encoding="utf-8")
    assert sorted(p.name for p in names.parent.iterdir() if p.is_file()) == [
        "names.csv",
        "names.slips.txt",
    ]


@unix
def test_slips_are_for_one_pair_of_eyes(names: Path) -> None:
    load_class(names, "rems")
    slips = slips_of(names)
    assert slips.stat().st_mode & 0o777 == 0o600
    slips.chmod(0o644)
    with pytest.raises(FabricError, match=f"Type: chmod 600 {slips}"):
        load_class(names, "rems")
    slips.unlink()
    # So is a list that says passwords itself.
    names.write_text("name,team,password\nAnna,teachers,seven herons\nBen,a,\n")
    with pytest.raises(FabricError, match=f"Type: chmod 600 {names}"):
        load_class(names, "rems")
    names.chmod(0o600)
    users = load_class(names, "rems")
    assert users.passwords["anna"] == "seven herons"
    assert users.names["members"] == ["anna"]
    assert users.teams == {"a": ["ben"]}


@unix
@pytest.mark.skipif(
    hasattr(os, "getuid") and os.getuid() == 0, reason="root can write everywhere"
)
def test_slips_that_cannot_be_kept(names: Path) -> None:
    names.parent.chmod(0o500)
    try:
        with pytest.raises(FabricError, match="where the passwords of the class are"):
            load_class(names, "rems")
    finally:
        names.parent.chmod(0o700)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            "nome,team\nAnna,a\n",
            "FILE, line 1: its columns are nome, team; expected name, team, and "
            "password where you choose them yourself.",
        ),
        (
            "",
            "FILE, line 1: its columns are none; expected name, team, and password "
            "where you choose them yourself.",
        ),
        (
            "name,team\nAnna,\n",
            "FILE, line 2: its team is ''; expected one with letters from a to z, or "
            "digits, such as 'Anna Berg' and 'team1'.",
        ),
        (
            "name,team\n\n王芳,a\n",
            "FILE, line 3: its name is '王芳'; expected one with letters from a to z, "
            "or digits, such as 'Anna Berg' and 'team1'.",
        ),
        (
            "name,team\nAnna,a\nanna,b\n",
            "FILE: lines 2 and 3 are both the user 'anna'; tell them apart, such as by "
            "an initial.",
        ),
        (
            "name,team\nTeacher,a\n",
            "FILE: line 2 and the teacher (team 'teachers') are both the user "
            "'teacher'; tell them apart, such as by an initial.",
        ),
        (
            "name,team\nAnna,lab\nBen,lab-2\n",
            "FILE: 'lab' is a team, and 'lab-2' is another team: 'lab' has all the "
            "fabrics whose names begin with 'lab-'. Give it another name.",
        ),
        (
            "name,team\nAnna,rems\n",
            "FILE: 'rems' is a team, and 'rems' is the class's fabric: 'rems' has all "
            "the fabrics whose names begin with 'rems-'. Give it another name.",
        ),
        (
            "name,team,password\nAnna,a,geheim\n",
            "FILE: the password of 'anna' can't be used; expected 8 to 128 letters in "
            "quotes, with no blank at the ends.",
        ),
    ],
)
def test_a_list_that_is_none(names: Path, text: str, sentence: str) -> None:
    names.write_text(text, encoding="utf-8")
    names.chmod(0o600)
    with pytest.raises(FabricError) as caught:
        load_class(names, "rems")
    assert str(caught.value) == sentence.replace("FILE", str(names))
    assert not slips_of(names).exists()


def test_what_is_typed_for_a_name() -> None:
    words = ["Anna Berg", " Çelik  Öz ", "Team 3", "x-1_a", "O'Neil, P.", "  ", "王"]
    assert [typed(word) for word in words] == [
        "anna.berg",
        "celik.oz",
        "team.3",
        "x-1_a",
        "o.neil.p",
        "",
        "",
    ]
