"""Who is at a class's router: the lines on its screen, and what each user may see."""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest
import zenoh

from rems_net.client.people import people
from rems_net.errors import FabricError
from rems_net.router.gate.access import MEMBERS, WHO
from rems_net.router.gate.stops import who_stopped
from rems_net.router.gate.users import Users
from rems_net.router.message import pack
from rems_net.router.relay import people as module
from rems_net.router.relay.notices import EVERY
from rems_net.router.relay.people import Person
from rems_net.router.session import Session
from tests.agents.runs import calm, until
from tests.router.relay.conftest import PASSWORDS, Shared, many_addresses, shared

TEAMS = {"team1": ["anna"], "team2": ["ben"]}
#: opens a session that lasts until its input ends; then it is killed, or closes
STAYS = """\
import sys; from rems_net.router.session import Session
from rems_net.router.settings import Link
session = Session(Link(sys.argv[1], user="anna", password=sys.argv[2]))
session.open()
session.present("team1/robot/sim/@alive")
print("open", flush=True)
sys.stdin.read()
session.close()
"""
#: s. What the tests wait for instead of the seconds and minutes of a class.
SHORT = 0.3
STOP = pack(True)


@pytest.fixture
def school(monkeypatch: pytest.MonkeyPatch) -> Iterator[Shared]:
    """Two teams and a teacher, at a router that is soon impatient."""
    for name in ("STAYS", "LOST"):
        monkeypatch.setattr(module, name, SHORT)
    monkeypatch.setattr(module, "FRESH", 0.0)
    yield from shared(Users({MEMBERS: ["teacher"], "guests": []}, PASSWORDS, TEAMS))


def staying(school: Shared) -> subprocess.Popen[str]:
    """Start a program of anna's that stays."""
    process = subprocess.Popen(
        [sys.executable, "-c", STAYS, school.endpoint, PASSWORDS["anna"]],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "open\n"
    return process


def row(session: Session, user: str) -> Person:
    return next(one for one in people(session) if one.user == user)


def test_a_laptop_comes_once_whatever_its_user_types(school: Shared) -> None:
    for _ in range(3):
        with school.session("anna"):
            pass
    with school.session("teacher") as teacher:
        until(lambda: "teacher on 127.0.0.1 is here" in school.screen)
        assert row(teacher, "anna").here
    assert school.screen.count("anna (team1) on 127.0.0.1 is here") == 1
    assert "gone" not in school.screen
    assert "left" not in school.screen


def test_a_laptop_that_is_lost_and_comes_back(school: Shared) -> None:
    """A farewell is not a loss: a run that has ended in order prints nothing."""
    with school.session("teacher") as teacher:
        first = staying(school)
        until(lambda: row(teacher, "anna").runs == ["team1/robot/sim"])
        first.communicate(timeout=20)
        until(lambda: not row(teacher, "anna").runs)
        second = staying(school)
        until(lambda: row(teacher, "anna").runs)
        begun = time.monotonic()
        until(lambda: time.monotonic() > begun + 2 * SHORT)
        second.kill()
        second.communicate()
        until(lambda: "anna (team1) on 127.0.0.1 is gone" in school.screen)
        assert not row(teacher, "anna").here
        with school.session("anna"):  # a command is no return
            pass
        assert not row(teacher, "anna").here
        third = staying(school)
        until(lambda: "anna (team1) on 127.0.0.1 is back" in school.screen)
        assert row(teacher, "anna").here
        third.communicate(timeout=20)
    assert school.screen.count("is gone") == 1


def test_who_was_away_for_long_has_left(
    school: Shared, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "AWAY", SHORT)
    with school.session("anna"):
        pass
    until(lambda: "anna (team1) on 127.0.0.1 has left" in school.screen)
    with school.session("anna"):
        pass
    with school.session("teacher") as teacher:
        assert row(teacher, "anna") == Person(
            "anna", "team1", "127.0.0.1", row(teacher, "anna").since, False, []
        )
    assert school.screen.count("anna") == 2


@many_addresses
def test_two_laptops_of_one_user_are_two(school: Shared) -> None:
    with (
        school.session("anna", "127.0.0.2"),
        school.session("anna", "127.0.0.3"),
        school.session("teacher") as teacher,
    ):
        laptops = [one.laptop for one in people(teacher) if one.user == "anna"]
        assert laptops == ["127.0.0.2", "127.0.0.3"]


def test_each_sees_the_own_team_and_a_teacher_all(school: Shared) -> None:
    with (
        school.session("anna") as anna,
        school.session("ben") as ben,
        school.session("teacher") as teacher,
    ):
        ben.present("team2/robot/secret/@alive")
        until(lambda: row(teacher, "ben").runs == ["team2/robot/secret"])
        assert {one.user for one in people(teacher)} == {"anna", "ben", "teacher"}
        assert {one.user for one in people(anna)} == {"anna"}
        for other in ("ben", "teacher", "*", "b*"):
            assert anna.ask(f"{WHO}/{other}?people", timeout=0.5) == []


def test_what_the_router_drops_is_not_shown(school: Shared) -> None:
    """A student claims to run another team's robot, and tokens that are none."""
    with school.session("anna") as anna, school.session("teacher") as teacher:
        foreign = ("team2/robot/a/@alive", "rems/clock/@alive")
        for key in (*foreign, "team1", "team1/x/y/z", "team1/robot/@alive"):
            anna.present(key)
        anna.present("team1/clock/@alive")
        until(lambda: row(teacher, "anna").runs)
        assert row(teacher, "anna").runs == ["team1/clock"]


def test_who_has_not_come_is_named(school: Shared) -> None:
    with school.session("teacher") as teacher:
        assert row(teacher, "ben") == Person("ben", "team2", "", "", False, [])


def test_a_router_without_users_knows_nobody(router: Shared) -> None:
    with (
        router.session() as session,
        pytest.raises(FabricError, match="no list of names"),
    ):
        people(session)


# -- who says STOP -------------------------------------------------------------------


def _plain(session: zenoh.Session) -> None:
    session.put("rems/stop", STOP)


def _declared(session: zenoh.Session) -> None:
    session.declare_publisher("rems/stop").put(STOP)


def _by_id(session: zenoh.Session) -> None:
    session.put(session.declare_keyexpr("rems/stop"), STOP)


@pytest.mark.parametrize("put", [_plain, _declared, _by_id])
def test_whatever_program_says_stop_its_user_is_named(
    school: Shared, put: Callable[[zenoh.Session], None]
) -> None:
    with school.session("anna") as anna, school.session("ben") as ben:
        put(anna._open)
        said = until(lambda: who_stopped(ben))
        assert said.by == "anna (team1) on 127.0.0.1"
        assert said.ago < 60.0
        until(lambda: f"STOP on 'rems' at {said.at}, by {said.by}" in school.screen)
        put(ben._open)  # it holds already
        with school.session("teacher") as teacher:
            again = who_stopped(teacher)
            assert again is not None
            assert again[:2] == said[:2]


def test_nobody_says_stop_in_anothers_name(school: Shared) -> None:
    """What the router drops makes nobody the one who said it."""
    with school.session("anna") as anna, school.session("ben") as ben:
        for _ in range(50):
            ben.put("team1/stop", STOP)
        anna.put("team1/stop", STOP)
        assert until(lambda: who_stopped(anna.on("team1"))).by.startswith("anna")
        assert who_stopped(ben.on("team1")) is None
        until(lambda: "anna (team1) on 127.0.0.1 said STOP on 'team1'" in school.screen)


def test_a_team_that_says_stop_on_and_on_fills_no_screen(school: Shared) -> None:
    with school.session("anna") as anna:
        for i in range(300):
            anna.put(f"team1-{i}/stop", STOP)
        until(lambda: who_stopped(anna.on("team1-299")))
        until(lambda: "said STOP on" in school.screen)
    assert len(school.screen.splitlines()) < 10


def test_a_stop_that_is_released_is_nobodys(school: Shared) -> None:
    with school.session("anna") as anna, school.session("teacher") as teacher:
        anna.put("rems/stop", STOP)
        until(lambda: who_stopped(anna))
        assert teacher.ask("rems/stop/@release")
        assert who_stopped(anna) is None
        teacher.put("rems/stop", STOP)
        assert until(lambda: who_stopped(anna)).by == "teacher on 127.0.0.1"


def test_the_last_one_to_say_stop_is_named(school: Shared) -> None:
    """A team's fabric is stopped by the team, then by a teacher; and the other way."""
    with school.session("anna") as anna, school.session("teacher") as teacher:
        here = anna.on("team1")
        for last in (teacher, anna):
            for one in (anna, teacher) if last is teacher else (teacher, anna):
                one.put("team1/stop", STOP)
                until(lambda: who_stopped(here))
            assert here.ask("team1/stop/@release")
            last.put("team1/stop", STOP)
            said = until(lambda: who_stopped(here)).by
            assert said.startswith("teacher" if last is teacher else "anna")
            assert here.ask("team1/stop/@release")


def test_stop_is_not_printed_late(school: Shared) -> None:
    """Refusals are gathered for 5 s; a STOP of the class's robots is not."""
    with school.session("anna") as anna:
        with school.raw() as stranger:
            stranger.join("anna", "a wrong password")
        until(lambda: "a wrong password once" in school.screen)
        begun = calm()
        anna.put("rems/stop", STOP)
        until(lambda: "STOP on 'rems'" in school.screen)
        assert calm() - begun < EVERY / 2
