"""A class, seen by its people: refusals, robots taken back, who is here, who stops."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.robot import combine as joined
from rems_net.drivers.remote import Remote
from rems_net.errors import AgentError
from rems_net.robots.woodbot import Woodbot
from rems_net.router.message import machine, pack
from tests.agents.runs import free_port, ticking, until
from tests.cli.conftest import FREE, place, starting
from tests.cli.school import Class, Screen, known_as
from tests.commands import Run, Start
from tests.drivers import alone

AHEAD = {"wheel/left": 3.0, "wheel/right": 3.0}
BY_ANNA = r"by anna \(team3\) on 127\.0\.0\.1"


@pytest.fixture(scope="module")
def school(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Class]:
    """Two teams, and robot/wood on the class's fabric."""
    folder = tmp_path_factory.mktemp("people")
    (folder / "names.csv").write_text("name,team\nAnna,team3\nBen,team4\nCem,team3\n")
    at = f"tcp/127.0.0.1:{free_port()}"
    with starting(folder) as start, place(folder) as notes:
        serve = start("router", "serve", "--class", "names.csv", "--listen", at)
        screen = Screen(serve)
        screen.shows("Open fabric")
        agent = start(
            "agent", "start", "robot", "woodbot", "kinematic", "--name", "wood"
        )
        ticking()
        yield Class(at, folder, notes, screen, Screen(agent))


@pytest.fixture
def teacher(school: Class, rems: Run) -> Run:
    """The machine with the router, where nobody types a name."""
    nobody = dict.fromkeys(("REMS_ROUTER", "REMS_USER", "REMS_PASSWORD"), "")
    return partial(rems, XDG_RUNTIME_DIR=str(school.notes), **nobody)


@pytest.fixture
def anna(school: Class, rems: Run) -> Run:
    """Anna's laptop."""
    return partial(rems, **known_as(school, "anna"))


@pytest.fixture
def as_anna(school: Class, monkeypatch: pytest.MonkeyPatch) -> None:
    """Anna's program is this process."""
    for name, value in known_as(school, "anna").items():
        monkeypatch.setenv(name, value)


def remote(key: str) -> Any:
    return joined(Woodbot, Remote)("mine", options={"key": key})


def refusal(key: str) -> str:
    with pytest.raises(AgentError) as told, alone.opened(remote(key)):
        pass
    return str(told.value)


# -- a robot that one may not have ---------------------------------------------------


def test_a_robot_that_one_may_not_drive(school: Class, as_anna: None) -> None:
    """The sentence says what the teacher types, and names no robot of another team."""
    with school.session("ben") as ben:
        ben.present("team4/robot/mine/@alive")
        ben.present("team4/robot/wooden/@alive")
        theirs = refusal("team4/robot/mine")
        own = refusal("team3/robot/wooden")
        absent = refusal("rems/robot/wooden")
    assert theirs.startswith("robot/mine: At tcp/")
    assert "'team4' is another's" in theirs
    assert theirs.endswith(
        "a teacher brings that robot to the class's fabric: rems agent start robot "
        "DEFINITION DRIVER --name mine (R0310)"
    )
    assert "there is no robot/wooden on 'team3'" in own
    assert "type: rems agent start robot DEFINITION DRIVER --name wooden" in own
    assert "there is no robot/wooden on 'rems'" in absent
    assert "Did you mean 'wood'?" in absent
    assert absent.endswith(
        "To bring it, a teacher types: rems agent start robot DEFINITION DRIVER --name "
        "wooden --fabric rems"
        " (R0310)"
    )
    for sentence in (own, absent):
        assert "team4" not in sentence


def test_a_robot_that_is_frozen(school: Class, as_anna: None) -> None:
    with school.session("cem") as cem:
        cem.present("team3/robot/deaf/@alive")
        assert "is there, and has not answered" in refusal("team3/robot/deaf")


def test_a_teacher_takes_a_robot_back(
    school: Class, as_anna: None, anna: Run, teacher: Run
) -> None:
    """Its run is told who has it; another run may have the robot at once."""
    with alone.opened(remote("rems/robot/wood")) as robot:
        alone.keep(robot, AHEAD, lambda: robot.state.x > 0.02)
        for words in (("rems/robot/wood",), ("robot/wood", "--fabric", "rems")):
            done = anna("stop", *words)
            assert done.returncode == 2
            assert done.stderr == (
                "rems: robot/wood is on 'rems', whose robots only a teacher takes back "
                "from a run, by: rems stop robot/wood. To stop every robot, type: rems "
                "stop (R0609)\n"
            )
        with school.session("anna") as session:  # and no other program of hers does
            take = "rems/robot/wood/@lease/take"
            assert session.ask(take, pack((1, "anna")), timeout=0.5) == []
        done = teacher("stop", "robot/wood")
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout == (
            f"robot/wood stands: it was taken back from robot/mine of {machine()}.\n"
            "Another run may drive it now.\n"
        )
        with pytest.raises(AgentError) as told:
            alone.keep(robot, AHEAD, lambda: False)
        assert "rems/robot/wood was taken back by the teacher on" in str(told.value)
        with alone.opened(remote("rems/robot/wood")) as second:
            alone.keep(second, AHEAD, lambda: second.state.x > 0.02)
    done = teacher("stop", "robot/wood")
    assert done.returncode == 1
    assert done.stderr.startswith("rems: no run elsewhere drives robot/wood.")
    assert len(school.agent.matching("it was taken back by the teacher on")) == 1


def test_a_team_takes_back_its_own_robot(school: Class, anna: Run) -> None:
    """To whom a fabric belongs, may: the question reaches the robot's host."""
    with school.session("cem", "team3") as cem:
        cem.present("team3/robot/ours/@alive")
        cem.answer_at_once(
            "team3/robot/ours/@lease/take", lambda q: q.answer(q.key, b"\xa3run")
        )
        done = anna("stop", "robot/ours", "--fabric", "team3")
    assert done.stdout.startswith("robot/ours stands: it was taken back from run.\n")


def test_what_is_no_robot_to_take(teacher: Run) -> None:
    for key in ("wood", "input/keys", "robot/a/b", "robot/*", "a/b/robot/c"):
        done = teacher("stop", key)
        assert done.returncode == 2
        assert "is no robot; expected one, such as robot/wood" in done.stderr
    assert "Type one or the other" in teacher("stop", "robot/a", "--release").stderr
    assert "there is no robot/wod" in teacher("stop", "robot/wod").stderr


# -- who is here ---------------------------------------------------------------------


def test_the_teacher_sees_who_comes_and_what_they_run(
    school: Class, anna: Run, teacher: Run
) -> None:
    for _ in range(3):
        assert anna("list", "--fabric", "rems").returncode == 0
    with school.session("ben") as ben:
        ben.present("team4/robot/secret/@alive")
        until(lambda: "team4/robot/secret" in teacher("list", "--people").stdout)
        done = teacher("list", "--people")
        rows = {line.split()[0]: line.split() for line in done.stdout.splitlines()}
        assert rows["user"] == ["user", "team", "laptop", "since", "runs"]
        assert rows["anna"][1:3] == ["team3", "127.0.0.1"]
        assert rows["ben"][1:3] == ["team4", "127.0.0.1"]
        assert rows["(router)"][4:] == ["rems/robot/wood"]
        seen = anna("list", "--people")
    assert "secret" not in seen.stdout
    assert "ben" not in seen.stdout
    assert "You see your own team, 'team3'." in seen.stdout
    told = json.loads(anna("list", "--people", "--json").stdout)
    assert {one["team"] for one in told} == {"team3"}
    school.serve.shows(r"^anna \(team3\) on 127\.0\.0\.1 is here$")
    assert len(school.serve.matching("anna .* (is here|has left|is back|is gone)")) == 1


def test_without_a_class_nobody_has_a_name(rems: Run) -> None:
    at = f"tcp/127.0.0.1:{free_port()}"
    code = (
        "import sys; from rems_net.router.stop_store import class_router\n"
        f"with class_router({at!r}): print(flush=True); sys.stdin.read()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as router:
        assert router.stdout is not None
        router.stdout.readline()
        done = rems("list", "--people", REMS_ROUTER=at)
        router.communicate()
    assert done.returncode == 2
    assert "has no list of names" in done.stderr


# -- who says STOP -------------------------------------------------------------------


def test_everybody_is_told_who_has_said_stop(
    school: Class, as_anna: None, anna: Run, teacher: Run
) -> None:
    """At the router at once, in the output of what runs there, and in rems list."""
    with alone.opened(remote("rems/robot/wood")) as robot:
        alone.keep(robot, AHEAD, lambda: robot.state.x > 0.02)
        assert anna("stop", "--fabric", "rems").returncode == 0
        stop = rf"^STOP on 'rems' at \d\d:\d\d:\d\d, {BY_ANNA}: robots must stand until"
        school.serve.shows(stop)
        school.agent.shows(stop)
        notes: list[str] = []
        robot._warn = notes.append
        # On a busy machine a command may be too old before.
        stands = rf"stands: STOP on 'rems' at .*, {BY_ANNA}"
        alone.keep(robot, AHEAD, lambda: re.search(stands, "\n".join(notes)))
    for who, end in ((teacher, r"`rems stop --release`\.$"), (anna, "by a teacher.$")):
        shown = who("list", "--fabric", "rems").stdout.splitlines()[-1]
        assert re.search(stop, shown)
        assert re.search(end, shown)
    assert teacher("stop", "--release").returncode == 0
    assert "STOP" not in teacher("list").stdout
    assert len(school.agent.matching(stop)) == 1


def test_a_run_prints_who_has_stopped_its_fabric(
    school: Class, rems: Run, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "free.toml").write_text(FREE)
    for name, value in known_as(school, "anna").items():
        monkeypatch.setenv(name, value)
    with starting(folder) as start:
        run = Screen(start("run", "free.toml", "--fabric", "team3-free"))
        for name, value in known_as(school, "cem").items():
            monkeypatch.setenv(name, value)
        own = ("--fabric", "team3-free")
        until(lambda: "robot/bot" in rems("list", *own).stdout, 30.0)
        assert rems("stop", *own).returncode == 0
        run.shows(r"STOP on 'team3-free' at \d\d:\d\d:\d\d, by cem \(team3\)")
        assert "by cem (team3)" in rems("list", *own).stdout
        with school.session("ben") as ben:
            assert ben.ask("team3-free/stop/@why", timeout=0.5) == []
        school.serve.shows("cem .* said STOP on 'team3-free'")


def test_a_router_that_knows_no_names_says_that_stop_holds(
    rems: Run, folder: Path
) -> None:
    (folder / "free.toml").write_text(FREE)
    with starting(folder) as start:
        start("run", "free.toml")
        ticking()
        assert rems("stop").returncode == 0
        assert rems("list").stdout.endswith(
            "STOP holds on 'rems': robots must stand until `rems stop --release`.\n"
        )
        assert rems("stop", "--release").returncode == 0
        assert "STOP" not in rems("list").stdout


def test_who_is_known_by_the_environment_is_on_the_fabric_of_the_team(
    as_anna: None, anna: Run, start: Start
) -> None:
    """One rule for all: an agent that is started goes where `rems list` looks."""
    start("agent", "start", "robot", "woodbot", "kinematic", "--name", "mine")
    until(lambda: "robot/mine" in anna("list").stdout, 30.0)
    assert "robot/mine" in anna("list", "--fabric", "team3").stdout
