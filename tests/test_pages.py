"""What a page shows in several blocks, files and lines to type, done as it says."""

import json
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from rems_net.recordings.mcap.reader import McapFile
from tests.agents.runs import free_port, until
from tests.commands import ROOT, environment, python, terminal
from tests.drivers.hardware.cart import Device
from tests.pages import blocks, rems, rows, running, started


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
    ("name", "port", "block"), [("create2", "ttyRobot", 0), ("dynabot", "ttyServos", 1)]
)
def test_a_device_that_is_emulated(
    tmp_path: Path, name: str, port: str, block: int
) -> None:
    """The page's emulator, and its experiment: a model and a driver side by side."""
    page = ROOT / "docs" / "hardware.md"
    line = blocks(page, "sh")[block].splitlines()[0]
    lab = blocks(page, "toml")[0]
    lab = lab.replace("create2", name).replace("ttyRobot", port)
    (tmp_path / "lab.toml").write_text(lab)
    (tmp_path / "keys.csv").write_text(
        "time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]\n1.0,4.0,4.0\n"
    )
    with started(tmp_path, line) as emulator:
        assert emulator.stdout is not None
        assert emulator.stdout.readline() == f"{name} at {port}; Ctrl+C ends it\n"
        done = rems(tmp_path, "rems run lab.toml")
        assert done.returncode == 0, done.stderr
    for robot in ("model", "real"):
        found = rows(tmp_path / "runs" / name / f"{robot}.csv")
        assert float(found[-1]["state/x [m]"]) > 0.05


def test_a_router_for_a_class(tmp_path: Path) -> None:
    """The page's `users.toml`, its router, a member who runs and a guest who looks."""
    page = ROOT / "docs" / "router.md"
    users = blocks(page, "toml")[0]
    (tmp_path / "lab.toml").write_text(blocks(ROOT / "README.md", "toml")[0])
    told = tomllib.loads(users)
    (tmp_path / "users.toml").write_text(users)
    (tmp_path / "users.toml").chmod(0o600)
    plain, point, served, agent, restricted, known = blocks(page, "sh")[:6]
    assert (served, agent.split()[:4]) == (
        "rems router serve\n",
        ["rems", "agent", "start", "robot"],
    )
    assert restricted == f"{plain.strip()} --users users.toml\n"
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    assert re.fullmatch(r"rems router use tcp/\S+\nrems list\n", point)
    router = subprocess.Popen(
        [sys.executable, *shlex.split(restricted)[1:], "--listen", endpoint],
        cwd=tmp_path,
        env=environment(),
        stdout=subprocess.PIPE,
        encoding="utf-8",
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
            ran = rems(tmp_path, "rems run lab.toml", **there, **member)
            assert (ran.returncode, ran.stderr) == (0, "")
            assert len(rows(tmp_path / "runs" / "lab" / "sim.csv")) == 100
            seen = rems(tmp_path, "rems list", **there, **guest)
            assert "no experiment runs there" in seen.stderr  # it is over, he is in
            ran = rems(tmp_path, "rems run lab.toml", **there, **guest)
            assert "'team1' is a guest of the router" in ran.stderr
            seen = rems(tmp_path, "rems list", **there)
            assert "needs your name: type `rems router use`" in seen.stderr
        finally:
            router.terminate()


def test_several_laptops(tmp_path: Path) -> None:
    """The page's file and its lines, on two laptops; the second has no file."""
    page = ROOT / "docs" / "router.md"
    run, bring, alone = blocks(page, "sh")[6:]
    (tmp_path / "here").mkdir()
    (tmp_path / "there").mkdir()
    lab = blocks(ROOT / "README.md", "toml")[0]
    lab = lab.replace("[[robot]]\n", '[[robot]]\nmachine = "b"\n')
    (tmp_path / "here" / "lab.toml").write_text(lab)
    with started(tmp_path / "here", run) as here:
        assert here.stdout is not None
        while "rems agent bring" not in (line := here.stdout.readline()):
            assert line
        with (
            terminal() as stdin,
            started(tmp_path / "there", bring.strip(), stdin) as there,
        ):
            said = there.communicate(timeout=60)[0]
        assert there.returncode == 0, said
        shown = blocks(page, "text")[0].splitlines()
        assert [line for line in shown[1:] if line not in said] == []
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
    page = ROOT / "docs" / "ros.md"
    (tmp_path / "arm.urdf").write_text(blocks(page, "xml")[0])
    for line in blocks(page, "sh")[0].splitlines():
        done = rems(tmp_path, line.replace("rems run", "rems run --direct"))
        assert (done.returncode, done.stderr) == (0, ""), line
    (tmp_path / "arm.py").write_text(blocks(page, "py")[0])
    done = rems(tmp_path, "rems run --direct arm.py")
    assert (done.returncode, done.stderr) == (0, "")
    last = rows(tmp_path / "runs" / "arm" / "arm.csv")[-1]
    assert float(last["state/angle [rad]"]) == pytest.approx(0.5, abs=0.01)
    text = (tmp_path / "arm.py").read_text()
    assert text.count('"csv"') == 1
    (tmp_path / "arm.py").write_text(text.replace('"csv"', '"mcap"'))
    for line in blocks(page, "text")[0].splitlines():
        done = rems(tmp_path, line.replace("rems run", "rems run --direct"))
        assert (done.returncode, done.stderr) == (0, ""), line
    assert (tmp_path / "runs" / "arm" / "run.mcap").exists()


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
    (tmp_path / "ghost.toml").write_text(blocks(page, "toml")[1])
    done = rems(tmp_path, f"{blocks(page, 'sh')[1].strip()} --direct")
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    *_, last = rows(tmp_path / "runs" / "ghost" / "world.arena.csv")
    assert float(last["real/pose/y [m]"]) > 0.2
    (tmp_path / "room.xml").write_text(blocks(page, "xml")[0])
    (tmp_path / "room.toml").write_text(
        '[experiment]\nduration = "1 s"\n[[world]]\nname = "room"\n'
        'options.mjcf = "room.xml"\n'
        '[[robot]]\nname = "a"\ndefinition = "woodbot"\ndriver = "mujoco"\n'
        'world = "room"\n'
    )
    done = rems(tmp_path, "rems check room.toml")
    assert done.returncode == 0, done.stderr
    assert "out  can  pose/x [m]" in done.stdout


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
    """The page's program, the lines to type, and what it says of its robots."""
    pytest.importorskip("matplotlib")
    page = ROOT / "docs" / "results.md"
    (tmp_path / "apart.py").write_text(blocks(page, "python")[0])
    told = blocks(page, "txt")[0]
    *lines, events, again = blocks(page, "sh")[0].splitlines()
    for i, line in enumerate(lines):
        # As a script in processes it is run by tests/test_docs.py.
        done = rems(tmp_path, line.replace("rems run", "rems run --direct"))
        assert (done.returncode, done.stderr) == (0, ""), line
        assert i > 1 or f"\n\n{told}" in done.stdout
        if i:
            assert all(len(said) <= 80 for said in done.stdout.splitlines())
        else:
            assert "state/x [m]" in done.stdout
            assert "turns" in done.stdout
    assert (tmp_path / "state.svg").exists()
    done = rems(tmp_path, events.replace("rems run", "rems run --direct"))
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout.splitlines()[-1])["kind"] == "report"
    assert "\nwide (apart.1)       the same\n" in rems(tmp_path, again).stdout


def test_a_recording_in_one_file(tmp_path: Path) -> None:
    """The page's experiment, and another program that reads its recording."""
    page = ROOT / "docs" / "recordings.md"
    (script,), (others,) = blocks(page, "python"), blocks(page, "py")
    (tmp_path / "curve.py").write_text(script)
    done = python(tmp_path, "curve.py")
    assert (done.returncode, done.stderr) == (0, "")
    assert "value/wheel/right [percent]" in done.stdout
    info, plot = blocks(page, "sh")[0].splitlines()
    told = rems(tmp_path, info)
    assert told.returncode == 0
    assert "what  curve; 1 input; 1 output; 1 robot; seed 0\n" in told.stdout
    assert "robot/sim/state: 100, 20 a second\n" in told.stdout
    assert rems(tmp_path, plot).returncode == 0
    (tmp_path / "others.py").write_text(others)
    read = python(tmp_path, "others.py")
    assert read.returncode == 0, read.stderr
    assert read.stdout.count("/robot/sim/state") == 100
    robot = '[[robot]]\nname = "sim"\ndefinition = "epuck"\ndriver = "kinematic"\n'
    settings = blocks(page, "toml")[0].replace(
        "record = ", 'duration = "1 s"\nrecord = '
    )
    (tmp_path / "lab.toml").write_text(settings + robot)
    assert rems(tmp_path, "rems run --direct lab.toml").returncode == 0
    assert [*McapFile(tmp_path / "runs/lab/run.mcap").channels] == ["robot/sim/state"]


def test_a_recording_is_done_again(tmp_path: Path) -> None:
    """And with changes, which are named."""
    page = ROOT / "docs" / "recordings.md"
    same, changed = (b for b in blocks(page, "sh") if "rems rerun" in b)
    (again,) = (b for b in blocks(page, "toml") if 'name = "again"' in b)
    (tmp_path / "again.toml").write_text(again)
    run, again = same.splitlines()
    assert rems(tmp_path, run.replace("rems run", "rems run --direct")).returncode == 0
    done = rems(tmp_path, again)
    assert (done.returncode, done.stdout) == (0, blocks(page, "text")[0])
    moved, seed, replaced = (rems(tmp_path, line) for line in changed.splitlines())
    assert (moved.returncode, seed.returncode, replaced.returncode) == (1, 1, 0)
    assert "from tick 1 on, in 40 messages; at most 0.1 m apart" in moved.stdout
    assert "state/" not in seed.stdout
    assert replaced.stdout == done.stdout
