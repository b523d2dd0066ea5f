"""What the README and the pages say is what happens: every block of them is run."""

from __future__ import annotations

import csv
import re
import shlex
import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.agents.runs import calm, free_port, until
from tests.commands import ROOT, environment, python
from tests.drivers.hardware.cart import Device
from tests.pages import blocks, rems, running, started

README = ROOT / "README.md"
#: docs/defdict.md and docs/first_hour.md have tests of their own.
PAGES = [
    p
    for p in sorted(ROOT.glob("docs/*.md"))
    if p.name not in ("defdict.md", "first_hour.md")
]
ENDPOINT = "tcp/127.0.0.1:7447"


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_the_first_two_commands() -> None:
    """What `.ci/run` takes from here, and what the pages of the project promise."""
    install, test, *_ = blocks(README, "sh")
    assert install == 'python -m pip install ".[all,test]" && rems demo\n'
    assert test == "python -m pytest -n auto\n"


def test_a_robot_of_your_own(tmp_path: Path) -> None:
    script = blocks(README, "python")[0]
    assert len([line for line in script.splitlines() if line.strip()]) <= 20
    (tmp_path / "weave.py").write_text(script)
    done = python(tmp_path, "weave.py")
    assert (done.returncode, done.stderr) == (0, "")
    found = rows(tmp_path / "runs" / "weave" / "cart.csv")
    assert len(found) == 200
    # 0.2 m/s ahead; the heading is the integral of cos t, so it comes back to sin t
    assert float(found[-1]["state/heading [rad]"]) == pytest.approx(-0.544, abs=0.05)


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    """The README's `lab.toml`, as it is there."""
    (tmp_path / "lab.toml").write_text(blocks(README, "toml")[0])
    return tmp_path


def test_an_experiment_in_a_file(lab: Path) -> None:
    assert "rems run lab.toml\n" in blocks(README, "sh")
    done = rems(lab, "rems run lab.toml")
    assert (done.returncode, done.stderr) == (0, "")
    assert len(rows(lab / "runs" / "lab" / "sim.csv")) == 100


def test_playing_a_csv_file(lab: Path) -> None:
    first, second = blocks(README, "toml")
    command = 'command = "input/keys"'
    assert f"`{command}`" in README.read_text()
    told = first.replace("[[robot]]\n", f"[[robot]]\n{command}\n")
    (lab / "lab.toml").write_text(f"{told}\n{second}")
    (lab / "keys.csv").write_text(blocks(README, "csv")[0])
    done = rems(lab, "rems run lab.toml")
    assert (done.returncode, done.stderr) == (0, "")
    wheel = [
        row["command/wheel/left [rad/s]"] for row in rows(lab / "runs/lab/sim.csv")
    ]
    assert [float(x) for x in wheel] == pytest.approx(
        [6.8] * 20 + [-3.4] * 10 + [0.0] * 70
    )


def test_what_is_going_on(tmp_path: Path) -> None:
    """Every line that reads live state, while `rems demo --pace 1` runs."""
    pytest.importorskip("mujoco")
    demo, live = blocks(README, "sh")[3:]
    lines = live.splitlines()
    assert len(lines) == 5
    with running(tmp_path, demo.strip()):
        for line in lines:
            assert line.startswith("rems ")
            end = " --count 2" if line.startswith("rems watch") else ""
            done = rems(tmp_path, line + end)
            assert (done.returncode, done.stderr) == (0, ""), line
            assert "mujoco" in done.stdout


def test_without_rems_net(lab: Path) -> None:
    """The plain program: ten lines, no import of ours; it reads, and it drives."""
    program = blocks(README, "python")[1]
    assert "rems_net" not in program
    assert len([line for line in program.splitlines() if line.strip()]) <= 10
    path = lab / "lab.toml"
    path.write_text(path.read_text().replace('"10 s"', '"60 s"'))
    with running(lab, "rems run lab.toml --pace 1") as endpoint:
        (lab / "plain.py").write_text(program.replace(ENDPOINT, endpoint))
        plain = subprocess.Popen(
            [sys.executable, "-u", "plain.py"],
            cwd=lab,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert plain.stdout is not None
        try:
            moved = re.compile(r"rems/robot/sim/state \{'x': (\S+), 'y': \S+, .*\}\n")
            said = ""
            for said in plain.stdout:
                match = moved.fullmatch(said)
                assert match, said
                if float(match[1]) > 0.02:
                    break
            else:
                raise AssertionError(f"it ended: {said}")
        finally:
            plain.send_signal(signal.SIGINT)  # killed, it leaves shared memory behind
            plain.communicate()
        left, file = "command/wheel/left [rad/s]", lab / "runs/lab/sim.csv"
        until(lambda: rows(file)[-1][left] == "0.0")  # told nothing, it stops
    driven = {
        (row["command/wheel/left [rad/s]"], row["command/wheel/right [rad/s]"])
        for row in rows(lab / "runs/lab/sim.csv")
    }
    assert driven == {("0.0", "0.0"), ("3.0", "2.0")}


def test_a_driver_of_your_own(tmp_path: Path) -> None:
    """The page's program, and a real device behind a pseudo-terminal."""
    program = blocks(ROOT / "docs" / "hardware.md", "py")[0]
    with Device(tmp_path) as device:
        port = str(device.link)
        (tmp_path / "cart.py").write_text(program.replace("/dev/ttyUSB0", port))
        done = python(tmp_path, "cart.py")
        assert done.returncode == 0, done.stderr
        assert "exchanges at 50 Hz" in done.stderr
        assert {n["heard"][0] for n in device.heard()} == {0.0, 0.2}
        assert device.speed == 0.0
    assert float(rows(tmp_path / "runs/cart/cart.csv")[-1]["state/x [m]"]) > 0.05


@pytest.mark.parametrize(
    ("name", "port", "page"),
    [
        ("create2", "ttyRobot", "hardware.md"),
        ("dynabot", "ttyServos", "dynamixel.md"),
    ],
)
def test_a_device_that_is_emulated(
    tmp_path: Path, name: str, port: str, page: str
) -> None:
    """The page's emulator, and its experiment: a model and a driver side by side."""
    text = ROOT / "docs" / page
    (tmp_path / "lab.toml").write_text(blocks(text, "toml")[0])
    (tmp_path / "keys.csv").write_text(
        "time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]\n1.0,4.0,4.0\n"
    )
    with started(tmp_path, blocks(text, "sh")[0]) as emulator:
        assert emulator.stdout is not None
        assert emulator.stdout.readline() == f"{name} at {port}; Ctrl+C ends it\n"
        done = rems(tmp_path, "rems run lab.toml")
        assert done.returncode == 0, done.stderr
    for robot in ("model", "real"):
        found = rows(tmp_path / "runs" / name / f"{robot}.csv")
        assert float(found[-1]["state/x [m]"]) > 0.05


def test_a_router_for_a_class(lab: Path) -> None:
    """The page's `users.toml`, its router, a member who runs and a guest who looks."""
    page = ROOT / "docs" / "router.md"
    users = blocks(page, "toml")[0]
    told = tomllib.loads(users)
    (lab / "users.toml").write_text(users)
    (lab / "users.toml").chmod(0o600)
    plain, point, served, agent, restricted, known = blocks(page, "sh")
    assert (served, agent.split()[:3]) == ("rems serve\n", ["rems", "agent", "robot"])
    assert restricted == f"{plain.strip()} --users users.toml\n"
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    assert re.fullmatch(r"rems join tcp/\S+\nrems list\n", point)
    router = subprocess.Popen(
        [sys.executable, *shlex.split(restricted)[1:], "--listen", endpoint],
        cwd=lab,
        env=environment(),
        stdout=subprocess.PIPE,
        text=True,
    )
    with router:
        try:
            assert router.stdout is not None
            assert router.stdout.readline().startswith("Router at ")
            _, user, password = shlex.split(known)
            guest = dict(word.split("=", 1) for word in (user, password))
            assert told["guests"][guest["REMS_USER"]] == guest["REMS_PASSWORD"]
            name, secret = next(iter(told["members"].items()))
            member = {"REMS_USER": name, "REMS_PASSWORD": secret}
            there = {"REMS_ROUTER": endpoint}
            ran = rems(lab, "rems run lab.toml", **there, **member)
            assert (ran.returncode, ran.stderr) == (0, "")
            assert len(rows(lab / "runs" / "lab" / "sim.csv")) == 100
            seen = rems(lab, "rems list", **there, **guest)
            assert "no experiment runs there" in seen.stderr  # it is over, he is in
            ran = rems(lab, "rems run lab.toml", **there, **guest)
            assert "'team1' is a guest of the router" in ran.stderr
            seen = rems(lab, "rems list", **there)
            assert "wants to know who comes: type `rems join`" in seen.stderr
        finally:
            router.terminate()


def test_several_laptops(tmp_path: Path) -> None:
    """The page's file and its lines, on two laptops; the second has no file."""
    page = ROOT / "docs" / "machines.md"
    run, bring, alone = blocks(page, "sh")
    (tmp_path / "here").mkdir()
    (tmp_path / "there").mkdir()
    (tmp_path / "here" / "lab.toml").write_text(blocks(page, "toml")[0])
    with started(tmp_path / "here", run) as here:
        assert here.stdout is not None
        while "rems bring" not in (line := here.stdout.readline()):
            assert line
        brought = rems(tmp_path / "there", bring.strip())
        assert brought.returncode == 0, brought.stderr
        here.communicate(timeout=60)
        assert here.returncode == 0
    done = rems(tmp_path / "here", alone.strip())
    assert done.returncode == 0, done.stderr
    recorded = tmp_path / "here" / "runs" / "lab" / "sim.csv"
    assert recorded.read_bytes() == (tmp_path / "here/alone/sim.csv").read_bytes()
    assert not list((tmp_path / "there").iterdir())


def test_an_open_fabric(tmp_path: Path) -> None:
    """The page's two lines, at a port of this test."""
    _, _, served, agent, *_ = blocks(ROOT / "docs" / "router.md", "sh")
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with started(tmp_path, f"{served.strip()} --listen {endpoint}") as fabric:
        assert fabric.stdout is not None
        assert fabric.stdout.readline().startswith("Open fabric 'rems'. ")
        with started(tmp_path, agent):
            until(lambda: "robot/alice" in rems(tmp_path, "rems list").stdout, 30)
            assert "heading" in rems(tmp_path, "rems get robot/alice/state").stdout


def test_a_robot_of_a_file(tmp_path: Path) -> None:
    """The page's arm, the lines that draft a definition of it, and the one by hand."""
    pytest.importorskip("mujoco")
    page = ROOT / "docs" / "bodies.md"
    (tmp_path / "arm.urdf").write_text(blocks(page, "xml")[0])
    for line in blocks(page, "sh")[0].splitlines():
        done = rems(tmp_path, line)
        assert (done.returncode, done.stderr) == (0, ""), line
    (tmp_path / "arm.py").write_text(blocks(page, "py")[0])
    done = python(tmp_path, "arm.py")
    assert (done.returncode, done.stderr) == (0, "")
    last = rows(tmp_path / "runs" / "arm" / "arm.csv")[-1]
    assert float(last["state/angle [rad]"]) == pytest.approx(0.5, abs=0.01)


def test_a_shared_world(tmp_path: Path) -> None:
    """The page's file and its lines, while it runs; and its place of one's own."""
    pytest.importorskip("mujoco")
    page = ROOT / "docs" / "worlds.md"
    lab = blocks(page, "toml")[0]
    (tmp_path / "arena.toml").write_text(lab.replace('"3 s"', '"60 s"'))
    (tmp_path / "keys.csv").write_text(blocks(page, "csv")[0])
    run, *lines = blocks(page, "sh")[0].splitlines()
    with running(tmp_path, run):
        for line in lines:
            done = rems(tmp_path, line)
            assert (done.returncode, done.stderr) == (0, ""), line
            if "ball" in line:
                assert "pose/heading" in done.stdout
    (tmp_path / "room.xml").write_text(blocks(page, "xml")[0])
    (tmp_path / "room.toml").write_text(
        '[experiment]\nduration = "1 s"\n[[world]]\nname = "room"\nmjcf = "room.xml"\n'
        '[[robot]]\nname = "a"\ndefinition = "woodbot"\ndriver = "mujoco"\n'
        'world = "room"\n'
    )
    done = rems(tmp_path, "rems check room.toml")
    assert done.returncode == 0, done.stderr
    assert "out  can  pose/x [m]" in done.stdout


def test_a_class_with_teams(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The page's list, its router, a student who joins, and a robot that is lent."""
    page = ROOT / "docs" / "class.md"
    (tmp_path / "names.csv").write_text(blocks(page, "csv")[0])
    served, joined, lent = blocks(page, "sh")
    address, user = re.findall(r"rems join (\S+) --user (\S+)\n", joined)[0]
    here = f"127.0.0.1:{free_port()}"
    with started(tmp_path, f"{served.strip()} --listen tcp/{here}") as fabric:
        assert fabric.stdout is not None
        assert "3 students in 2 teams, 1 teacher" in fabric.stdout.readline()
        slips = (tmp_path / "names.slips.txt").read_text()
        secret = dict(re.findall(r"--user (\S+)\n  password: (.+)\n", slips))
        told = rems(tmp_path, joined.replace(address, here), REMS_PASSWORD=secret[user])
        assert "of the team 'team1'" in told.stdout, told.stderr
        teacher = {"REMS_ROUTER": f"tcp/{here}", "REMS_USER": "teacher"}
        teacher["REMS_PASSWORD"] = secret["teacher"]
        with started(tmp_path, "rems serve --fabric team1"):  # the student's
            for name, value in teacher.items():
                monkeypatch.setenv(name, value)
            agent = "rems agent robot woodbot kinematic --name woodbot-7"
            with started(tmp_path, agent):
                deadline = calm() + 30
                for line in lent.splitlines():
                    while (done := rems(tmp_path, line)).returncode:
                        assert calm() < deadline, done.stderr


def test_settings_of_your_own(tmp_path: Path) -> None:
    """The page's script, and the file that uses its classes."""
    page = ROOT / "docs" / "agents.md"
    (tmp_path / "speeds.py").write_text(blocks(page, "python")[0])
    (tmp_path / "speeds.toml").write_text(blocks(page, "toml")[0])
    done = rems(tmp_path, "rems run speeds.toml")
    assert (done.returncode, done.stderr) == (0, "")
    first, *lines = (tmp_path / "runs/speeds/notes.txt").read_text().splitlines()
    assert (first, len(lines)) == ("notes", 10)
    for speed in (10, 50):
        assert not (tmp_path / f"runs/speed_{speed}").exists()


def test_results(tmp_path: Path) -> None:
    """The page's program, and what it says to type about what that has left."""
    pytest.importorskip("matplotlib")
    page = ROOT / "docs" / "results.md"
    (tmp_path / "lab.py").write_text(blocks(page, "python")[0])
    done = python(tmp_path, "lab.py")
    assert done.returncode == 0, done.stderr
    assert "sim - wide: " in done.stdout
    assert "state/x [m]" in done.stdout
    for line in blocks(page, "sh")[0].splitlines():
        done = rems(tmp_path, line)
        assert (done.returncode, done.stderr) == (0, ""), line
    assert (tmp_path / "state.svg").exists()


def test_comparing(tmp_path: Path) -> None:
    """What is told there of three robots is what their run says."""
    pytest.importorskip("matplotlib")
    page = ROOT / "docs" / "compare.md"
    (tmp_path / "weave.py").write_text(blocks(page, "python")[0])
    told = blocks(page, "txt")[0]
    for i, line in enumerate(blocks(page, "sh")[0].splitlines()):
        done = rems(tmp_path, line)
        assert (done.returncode, done.stderr) == (0, ""), line
        assert i > 1 or done.stdout.endswith(f"\n\n{told}")
        assert all(len(said) <= 80 for said in done.stdout.splitlines())


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_pages(tmp_path: Path, page: Path) -> None:
    """Each `python` block of a page is a script of its own."""
    for i, block in enumerate(blocks(page, "python")):
        (tmp_path / f"block{i}.py").write_text(block)
        done = python(tmp_path, f"block{i}.py")
        assert (done.returncode, done.stderr) == (0, ""), block


@pytest.mark.parametrize("page", [README, *PAGES], ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", text):
        if "://" not in target:
            assert (page.parent / target).exists(), target
