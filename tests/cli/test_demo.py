"""`rems demo`: no arguments, no configuration, no display."""

import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from rems_net import read
from rems_net.libraries import no_wheels
from tests import commands
from tests.cli.conftest import LAB, together
from tests.commands import Run, command, environment

INSTALLED = ["kinematic", *(d for d in ("mujoco", "pybullet") if find_spec(d))]


def test_what_it_does(tmp_path: Path) -> None:
    """Run it once, and look at all of it."""
    folder, runtime = tmp_path / "demo", tmp_path / "of its own"
    folder.mkdir()
    runtime.mkdir(mode=0o700)
    done = commands.rems(folder, "demo", XDG_RUNTIME_DIR=str(runtime))
    assert (done.returncode, done.stderr) == (0, "")
    assert list(runtime.rglob("*.json")) == []
    what_it_leaves(folder, done.stdout)
    what_it_says(done.stdout)
    what_they_drove(folder)
    in_a_narrow_terminal(folder, done.stdout)


def what_it_leaves(folder: Path, said: str) -> None:
    files = (folder / "runs" / "demo").iterdir()
    made = sorted(p.name for p in files if p.name != "run.json")
    assert made == sorted(
        [*(f"{name}.csv" for name in INSTALLED), "comparison.png", "run.mcap"]
    )
    for name in made:
        assert str(Path("runs/demo", name)) in said
    for missing in {"mujoco", "pybullet"} - set(INSTALLED):
        why = no_wheels(missing) or f"This needs the library {missing},"
        assert f"without {missing}: {why}" in said


def what_it_says(said: str) -> None:
    lines = said.splitlines()
    assert all(len(line) <= 80 for line in lines)
    pairs = len(INSTALLED) * (len(INSTALLED) - 1) // 2
    row = re.compile(
        r"(\w+) - (\w+) +\d+\.\d\d +\d+\.\d\d +\d+\.\d\d +[-+]\d+\.\d\d +"
        r"(never|\d+\.\d\d s) *"
    )
    found = [match.groups()[:2] for match in map(row.fullmatch, lines) if match]
    assert len(found) == pairs
    assert all(f"[{unit}]" in said for unit in ("mm", "deg")) or pairs == 0
    first = next(line for line in lines if not line.startswith("without "))
    assert first.startswith("demo: 13.5 s of fabric time, as fast as possible;")
    assert re.search(r"^13\.5 s of 13\.5 s in \d+\.\d s, ", said, re.MULTILINE)


@pytest.mark.parametrize(
    ("system", "python", "sentence"),
    [
        (("linux", "x86_64"), (3, 11), ""),
        (
            ("linux", "x86_64"),
            (3, 13),
            "PyBullet has no wheels for Python 3.13; use 3.11, or mujoco.",
        ),
        (
            ("linux", "aarch64"),
            (3, 11),
            "PyBullet has no wheels for linux aarch64; use mujoco.",
        ),
        (
            ("win32", "AMD64"),
            (3, 13),
            "PyBullet has no wheels for Windows; use mujoco.",
        ),
        (("darwin", "arm64"), (3, 11), "PyBullet has no wheels for macOS; use mujoco."),
    ],
)
def test_where_there_is_no_wheel(
    system: tuple[str, str], python: tuple[int, int], sentence: str
) -> None:
    """One quiet line, and it fits."""
    assert no_wheels("pybullet", system, python) == sentence
    assert len(f"without pybullet: {sentence}") <= 80
    assert no_wheels("mujoco", system, python) == ""


@pytest.mark.skipif(
    find_spec("pybullet") is not None or not no_wheels("pybullet"),
    reason="PyBullet has a wheel here, or is installed: nothing is told",
)
def test_without_a_wheel(rems: Run) -> None:
    """What is told on a Python for which there is none, wherever it is told."""
    sentence = no_wheels("pybullet")
    if sys.platform == "linux":
        assert sentence == (
            f"PyBullet has no wheels for Python 3.{sys.version_info.minor}; use 3.11, "
            "or mujoco."
        )
    assert rems("demo").stdout.splitlines()[-1] == f"without pybullet: {sentence}"
    assert sentence in rems("show", "pybullet").stdout.splitlines()
    listed = " ".join(rems("show").stdout.split()).replace(" built-in", "")
    assert f"({sentence.rstrip('.')})" in listed


def what_they_drove(folder: Path) -> None:
    """A figure of eight that ends near its start, half a turn further."""
    robots = read(folder / "runs" / "demo").trajectories()
    assert [robot.name for robot in robots] == INSTALLED
    for robot in robots:
        assert robot.time[-1] == 13.5
        assert abs(robot.x[-1]) < 0.03
        assert abs(robot.y[-1]) < 0.03
        assert robot.x.max() > 0.2
        assert robot.x.min() < -0.2
        assert robot.heading[-1] - robot.heading[0] == pytest.approx(3.14, abs=0.15)


def test_on_a_terminal(folder: Path) -> None:
    """A live picture with a line per agent, never wider than the terminal."""
    (folder / "lab.toml").write_text(together(LAB))
    pty = pytest.importorskip("pty")
    master, slave = pty.openpty()
    env = environment() | {"TERM": "xterm", "LINES": "30"}
    process = subprocess.Popen(
        command("run", "lab.toml", "--pace", "1"),
        cwd=folder,
        env=env,
        stdout=slave,
        stderr=slave,
    )
    os.close(slave)
    seen = b""
    while True:
        try:
            more = os.read(master, 65536)
        except OSError:  # the terminal's other end is closed
            break
        if not more:
            break
        seen += more
    os.close(master)
    assert process.wait(20) == 0
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", seen.decode())
    for agent in ("input/keys", "robot/model", "output/log"):
        assert re.search(rf"{agent} +\S+:\d+ +\d+ Hz +\d+", text), agent
    assert all(len(line) <= 80 for line in re.split(r"[\r\n]+", text))
    assert "runs/lab/model.csv" in text


def test_no_colours(rems: Run) -> None:
    """NO_COLOR and --no-color: no colour, even on a terminal."""
    for args, extra in ((["--help"], {"NO_COLOR": "1"}), (["demo", "--help"], {})):
        done = rems(*args, **extra)
        assert done.returncode == 0, done.stderr
        assert "\x1b[" not in done.stdout
        assert "\n  rems demo" in done.stdout
        assert all(len(line) <= 80 for line in done.stdout.splitlines())


def in_a_narrow_terminal(folder: Path, said: str) -> None:
    """No name is cut off there. Comparing needs no unyt, which takes a second."""
    code = (
        "import sys; from rems_net.cli import main; main(['compare', 'runs/demo']); "
        "sys.exit('unyt' in sys.modules)"
    )
    done = commands.python(folder, "-c", code, COLUMNS="60")
    assert (done.returncode, done.stderr) == (0, "")
    *lines, last = done.stdout.splitlines()
    own = [line for line in said.splitlines() if not line.startswith("without ")]
    assert last == own[-1]
    assert "…" not in done.stdout
    why = next(i for i, line in enumerate(lines) if line.startswith("why they part"))
    assert max(map(len, [*lines[:why], *lines[why + 1 :]])) <= 60
