"""`rems router serve --class`: a class with teams, from the slips to a team's run."""

import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from rems_net.client import join
from rems_net.router.finding import remembered
from rems_net.router.mail import Mail, Mailbox
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import free_port, ticking, until
from tests.cli.conftest import LAB, place, starting, together
from tests.commands import Run, Start, begun, command
from tests.interrupts import interrupt


class Class(NamedTuple):
    """A class at a router of this machine: its address, and the teacher's folders."""

    at: str
    folder: Path
    notes: Path


@pytest.fixture(scope="module")
def school(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Class]:
    """A class with robot/wood on its fabric, for all of these tests."""
    folder = tmp_path_factory.mktemp("class")
    (folder / "names.csv").write_text("name,team\nAnna,team3\nBen,team4\n")
    at = f"tcp/127.0.0.1:{free_port()}"
    with starting(folder) as start:
        with place(folder) as notes:
            serve = start("router", "serve", "--class", "names.csv", "--listen", at)
            assert serve.stdout is not None
            said = [serve.stdout.readline() for _ in range(4)]
            start("agent", "start", "robot", "woodbot", "kinematic", "--name", "wood")
            ticking()
        assert said == [
            "names.csv: 2 students in 2 teams, 1 teacher; nobody else is let in.\n",
            "  Slips to print, for your eyes only: names.slips.txt\n",
            "  Each types what is on his slip: rems router use "
            f"{at.removeprefix('tcp/')} --user NAME\n",
            "Open fabric 'rems'. Only this machine reaches it.\n",
        ]
        yield Class(at, folder, notes)


@pytest.fixture
def served(school: Class, folder: Path) -> str:
    """Where it is, for a laptop that finds no note of it, as another one."""
    shutil.copy(school.folder / "names.csv", folder)
    shutil.copy(school.folder / "names.slips.txt", folder)
    return school.at


@pytest.fixture
def teacher(
    school: Class, served: str, rems: Run, monkeypatch: pytest.MonkeyPatch
) -> Run:
    """The machine with the router."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(school.notes))
    return rems


def password(folder: Path, user: str) -> str:
    slips = (folder / "names.slips.txt").read_text()
    found = re.search(rf"--user {user}\n  password: (.+)\n", slips)
    assert found
    return found[1]


@pytest.fixture
def anna(served: str, rems: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Anna's laptop, which has joined."""
    (folder / "lab.toml").write_text(together(LAB))
    secret = password(folder, "anna")
    with monkeypatch.context() as said_once:
        said_once.setenv("REMS_PASSWORD", secret)
        done = rems("router", "use", served, "--user", "anna")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == (
        "You are 'anna', of the team 'team3'.\n"
        f"Joined {served}. From now on every rems command goes there;\n"
        "`rems run` is on a fabric of your team, 'team3'.\n"
        "There: robot/wood. `rems router forget` forgets it.\n"
    )
    return rems


def test_what_was_joined_is_for_her_alone(anna: Run) -> None:
    kept = remembered.path()
    if hasattr(os, "getuid"):  # elsewhere files have no mode
        assert kept.stat().st_mode & 0o777 == 0o600
    assert remembered.credentials()[0] == "anna"
    assert anna("router", "forget").returncode == 0
    assert remembered.credentials() == ("", "")
    assert not kept.exists()


def test_a_team_runs_on_its_own_fabric_and_nowhere_else(
    anna: Run, served: str, folder: Path
) -> None:
    done = anna("run", "lab.toml")
    assert done.returncode == 0, done.stderr
    start = f"rems: At {served} 'anna' is of the team 'team3'"
    for verb, *more in (("run", "lab.toml"), ("list",)):
        done = anna(verb, *more, "--fabric", "team4")
        assert done.returncode == 2
        assert done.stderr == (
            f"{start}, which has the fabrics 'team3' and 'team3-...', and a look at "
            "'rems'; 'team4' is another's: give --fabric team3."
            " (R0609)\n"
        )
    sentence = (
        f"{start}: the fabrics 'team3' and 'team3-...' are yours, and 'rems' is the "
        "whole class's: read there, command robots, and stop them. Type: --fabric "
        "team3 (R0609)\n"
    )
    for words in (
        ("run", "lab.toml", "--fabric", "rems"),
        ("agent", "start", "robot", "woodbot", "kinematic", "--fabric", "rems"),
        (
            "router",
            "serve",
        ),
        ("clock", "pause", "--fabric", "rems"),
    ):
        done = anna(*words)
        assert done.returncode == 2, words
        assert done.stderr.endswith(sentence), words
    done = anna("router", "use", served, "--fabric", "team4")
    assert "'team4' is another's. Type: --fabric team3" in done.stderr
    done = anna("router", "use", served, "--fabric", "team3-c")
    assert "on a fabric of your team, 'team3-c'.\n" in done.stdout


def test_agents_go_to_the_fabric_of_the_team(anna: Run, start: Start) -> None:
    """The first of them brings its clock; a run beside them has a fabric of its own."""
    first = start("agent", "start", "robot", "woodbot", "kinematic", "--name", "first")
    until(lambda: "robot/first" in anna("list").stdout.split())
    start("agent", "start", "lab.toml")
    until(lambda: {"input/keys", "robot/model"} <= {*anna("list").stdout.split()})
    done = anna("run", "lab.toml", "--out", "beside")
    assert done.returncode == 0, done.stderr
    assert "this run is on 'team3-lab'" in " ".join(done.stdout.split())
    done = anna("run", "lab.toml", "--fabric", "team3", "--out", "beside")
    assert done.returncode == 2
    assert "has a clock already" in done.stderr
    assert "REMS_ROUTER" not in done.stderr  # nobody has set it
    interrupt(first)
    _, told = first.communicate(timeout=20)
    assert "fabric 'team3' had no clock: this program is its clock now\n" in told
    assert first.returncode == 130


def test_the_class_is_there_to_be_seen_and_its_robots_to_be_driven(
    anna: Run, school: Class
) -> None:
    done = anna("list")  # the team's fabric, on which nothing runs
    assert (done.returncode, done.stdout) == (2, "")
    assert "The class's robots are on --fabric rems. (R0602)" in done.stderr
    there = "--fabric", "rems"
    assert "robot/wood" in anna("list", *there).stdout
    x = "robot/wood/state/x"
    assert anna("get", x, *there).stdout.startswith(f"{x} ")
    with join("rems") as fabric:
        wood = fabric.robot("wood")

        def drives() -> bool:
            for wheel in ("left", "right"):
                wood.command[f"wheel/{wheel}"] = "3 rad/s"
            return float(wood.state.x) > 0.01

        until(drives)
        wood.reset()
    # A STOP of the team stops no robot of everybody's.
    done = anna("stop")
    assert done.returncode in (1, 2)  # an earlier robot of the team may be missing
    assert "robot/wood" not in done.stdout
    assert anna("stop", "--release").returncode == 0  # the router keeps it, too
    with join("rems") as fabric:
        assert not fabric.get("clock/tick")["rems/clock/tick"]["stops"] % 2
    assert "robot/wood stands" in anna("stop", *there).stdout
    done = anna("stop", "--release", *there)
    assert done.returncode == 2
    assert "'rems' is the whole class's" in done.stderr
    remembered.forget()
    done = anna("stop", "--release", XDG_RUNTIME_DIR=str(school.notes))
    assert done.stdout == "released: robot/wood\n"  # by the teacher


def test_a_teams_run_drives_a_robot_of_the_class(anna: Run, folder: Path) -> None:
    lab = (folder / "lab.toml").read_text()
    lab = lab.replace('name = "model"', 'name = "wood"').replace("kinematic", "remote")
    (folder / "lab.toml").write_text(
        lab.replace('parameters = { track = "0.1 m" }', "")
    )
    done = anna("run", "lab.toml", "--pace", "1")
    assert done.returncode == 0, done.stderr
    *_, last = (folder / "runs" / "lab" / "wood.csv").read_text().splitlines()
    assert float(last.split(",")[3]) > 0.0  # state/x
    with join("rems") as fabric:  # and gives it back
        wood = fabric.robot("wood")
        before = float(wood.state.x)

        def drives() -> bool:
            wood.command.update({"wheel/left": "-3 rad/s", "wheel/right": "-3 rad/s"})
            return float(wood.state.x) < before - 0.01

        until(drives)


def test_the_teacher_stops_every_team_first_and_asks_then(
    served: str, teacher: Run, folder: Path
) -> None:
    """At the machine with the router, though nobody of a team ever answers."""
    heard = Mailbox()
    teams = ["team3", *(f"team3-{i}" for i in range(4))]
    secret = password(folder, "anna")
    with Session(Link(served, user="anna", password=secret)) as session:
        for team in teams:
            session.watch(f"{team}/stop", heard)
            session.present(f"{team}/robot/x/@alive")
        done = teacher("stop", "--all")
        assert done.returncode == 1
        assert done.stdout.count("robot/x has not answered") == 5
        assert "robot/wood stands" in done.stdout
        assert done.stdout.endswith(" with: rems stop --release --all\n")
        first = [heard.get(2.0) for _ in teams]
        assert {mail.key for mail in first if isinstance(mail, Mail)} == {
            f"{team}/stop" for team in teams
        }
        while heard.get(0.0) is not None:
            pass
        done = teacher("stop", "--fabric", "team3-2")
        assert done.stdout.startswith(
            "robot/x has not answered: it may drive on until it is back\n"
        )
        mail = heard.get(2.0)
        assert isinstance(mail, Mail)
        assert mail.key == "team3-2/stop"
    assert "robot/wood" in teacher("stop", "--release", "--all").stdout


def test_the_machine_that_serves_needs_no_password(
    served: str, teacher: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Seen before: `rems why` reported BAD there, and --at was refused."""
    port = served.rpartition(":")[2]
    for words in (), (served,), (f"localhost:{port}",):
        done = teacher("router", "status", *words)
        assert "\nok   fabric 'rems' has one clock\n" in done.stdout, done.stdout
    for at in served, port:
        done = teacher("list", "--at", at)
        assert "robot/wood" in done.stdout, done.stderr
    done = teacher("router", "use", served)
    assert done.stdout.startswith(
        f"This machine runs the router, and needs no password.\nJoined {served}. "
    )
    assert remembered.credentials() == ("", "")  # those of the next class differ
    assert "robot/wood" in teacher("list").stdout
    remembered.forget()
    monkeypatch.setenv("REMS_ROUTER", served)
    assert teacher("clock", "resume").returncode == 0


def test_a_browser_never_acts_for_the_router_itself(teacher: Run) -> None:
    done = teacher("dashboard", "--no-qr")
    assert done.returncode == 2
    assert done.stderr == (
        "rems: Here the router of a class runs, and its own programs may do more than "
        "any teacher, so a browser gets no page by them. Type in place of it: rems "
        "router serve --class names.csv --dashboard (R0609)\n"
    )


def test_the_password_is_asked_for_and_not_shown(served: str, folder: Path) -> None:
    pty = pytest.importorskip("pty", reason="there are no pseudo-terminals here")
    secret = password(folder, "ben")
    mine, theirs = pty.openpty()
    words = command("router", "use", served, "--user", "ben")
    process = begun(words, screen=theirs)
    os.close(theirs)
    shown, typed = b"", False
    while True:
        try:
            shown += os.read(mine, 1000)
        except OSError:  # it has ended
            break
        if not typed and b"Password of ben: " in shown:
            typed = True
            os.write(mine, f"{secret}\n".encode())
    os.close(mine)
    assert process.wait(20) == 0, shown
    assert b"of the team 'team4'" in shown
    assert secret.encode() not in shown


def test_who_is_not_let_in(
    served: str, rems: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = rems("router", "use", served, "--user", "anna")
    assert done.stderr == (
        "rems: the password of 'anna' is asked in a terminal, and this is none; set "
        "REMS_PASSWORD. (R0909)\n"
    )
    monkeypatch.setenv("REMS_PASSWORD", "a wrong one")
    done = rems("router", "use", served, "--user", "anna")
    assert done.returncode == 2
    assert f"{served} does not let 'anna' in: the name or the password" in done.stderr
    assert "a wrong one" not in done.stderr
    assert remembered.router() == ""


def test_without_a_list_it_says_so(start: Start) -> None:
    serve = start("router", "serve", "--listen", f"tcp/127.0.0.1:{free_port()}")
    assert serve.stderr is not None
    assert serve.stderr.readline() == (
        "rems: it is open to everybody: who reaches it can stop robots and end runs. "
        "For a class with teams: --class names.csv\n"
    )


def test_the_list_is_for_the_router(rems: Run, served: str) -> None:
    remembered.remember(served)
    done = rems("router", "serve", "--class", "names.csv")
    assert done.returncode == 2
    assert done.stderr == (
        f"rems: the router is at {served}, and only it can have a class list; use "
        "--class there, or leave that one first: rems router forget"
        " (R0904)\n"
    )
