"""Processes of each kind begin and end well while both cores are busy, every time."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.windows.test_hour import LAB, SHORT
from tests.windows.wine import Windows

pytestmark = [pytest.mark.wine, pytest.mark.slow, pytest.mark.timeout(3600)]

TIMES = 20
#: s. What a command may take on a busy machine
LONG = 400.0
#: a robot whose device is a program that reads its standard input
DRIVEN = """\
experiment = { name = "lab", dt = "50 ms", duration = "2 s", pace = 1 }

[[robot]]
name = "bot"
definition = "woodbot"
driver = "woodbot-ws"
options = { url = "URL" }
"""


@pytest.fixture
def busy() -> Iterator[None]:
    """All cores of this machine compute something else, too."""
    idle = (os.cpu_count() or 1) - int(os.getloadavg()[0])
    with ExitStack() as stack:
        for _ in range(idle):
            words = [sys.executable, "-S", "-c", "while True: pass"]
            burner = stack.enter_context(subprocess.Popen(words))
            stack.callback(burner.kill)
        yield


def demo(windows: Windows, folder: Path) -> None:
    windows.rems("demo", cwd=folder, seconds=LONG)
    assert (folder / "runs" / "demo" / "comparison.png").exists()


def kinds(windows: Windows, folder: Path) -> None:
    """An input, two robots, a process that waits for a job's process, and an output."""
    lab = LAB.replace('duration="600 s", pace=1.0', 'duration="2 s"')
    lab = lab.replace("process=True", "process=True, due=50")
    (folder / "lab.py").write_text(lab, encoding="utf-8")
    windows.rems("run", "lab.py", cwd=folder, seconds=LONG)
    rows = (folder / "runs" / "lab" / "sim.csv").read_text("utf-8").splitlines()
    assert len(rows) == 1 + 100


def sweep(windows: Windows, folder: Path) -> None:
    (folder / "lab.toml").write_text(SHORT, encoding="utf-8")
    words = ["sweep", "lab.toml", "--seeds", "4", "--workers", "2", "--out", "s"]
    printed = windows.rems(*words, cwd=folder, seconds=LONG)
    assert "4 runs, in s\\table.csv" in printed
    assert len((folder / "s" / "table.csv").read_text("utf-8").splitlines()) == 1 + 4


def emulator(windows: Windows, folder: Path) -> None:
    """It takes a typed fault while a driver uses it."""
    with windows.begin("board", "emulate", "woodbot-ws", cwd=folder) as emulated:
        assert emulated.stdin is not None
        assert emulated.stdout is not None
        line = emulated.stdout.readline()
        assert "; Ctrl+C ends it" in line, line + emulated.stdout.read()
        url = line.split(" at ")[1].split(";")[0]
        emulated.stdin.write("late 0.01\n")
        emulated.stdin.flush()
        lab = DRIVEN.replace("URL", url)
        (folder / "lab.toml").write_text(lab, encoding="utf-8")
        windows.rems("run", "lab.toml", cwd=folder, seconds=LONG)
        emulated.kill()


@pytest.mark.parametrize("way", [demo, kinds, sweep, emulator])
@pytest.mark.usefixtures("busy")
def test_twenty_of_twenty(
    way: Callable[[Windows, Path], None], windows: Windows, tmp_path: Path
) -> None:
    failures = []
    for n in range(TIMES):
        folder = tmp_path / str(n)
        folder.mkdir()
        try:
            way(windows, folder)
        except (AssertionError, OSError) as error:
            failures.append(f"{n}: {error}")
    assert not failures, f"{TIMES - len(failures)} of {TIMES}\n" + "\n".join(failures)
