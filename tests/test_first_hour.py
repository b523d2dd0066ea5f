"""The page for the first hour is followed, command by command."""

import re
import sys
from pathlib import Path

import pytest

from rems_net.cli import main
from tests.agents.runs import free_port, until
from tests.cli.conftest import fabric, row
from tests.commands import ROOT, python
from tests.interrupts import interrupt
from tests.pages import blocks, rems, running, started

PAGE = ROOT / "docs" / "first_hour.md"
TEXT = PAGE.read_text(encoding="utf-8")
GOTO = blocks(PAGE, "python")[0]
ROW = re.compile(r"^\| `(.+?)` \| `(.+?)` \| (.+?) \|$", re.MULTILINE)
MISTAKES = ROW.findall(TEXT)


@pytest.fixture(autouse=True)
def with_what_it_needs() -> None:
    pytest.importorskip("mujoco")
    pytest.importorskip("matplotlib")


def commands(folder: Path, block: str) -> None:
    for line in block.splitlines():
        done = rems(folder, line)
        assert done.returncode == 0, f"{line}: {done.stderr}"
        assert "Traceback" not in done.stderr


def test_install_and_look(tmp_path: Path) -> None:
    install, demo = blocks(PAGE, "sh")[0].splitlines()
    assert f"{install} && {demo}\n" == blocks(ROOT / "README.md", "sh")[0]


def test_drive_one(tmp_path: Path) -> None:
    if sys.platform == "win32":
        pytest.skip("Windows has no pseudo-terminals")
    from tests.cli.test_drive import PLAIN, window

    lines = blocks(PAGE, "console")[0].splitlines()
    served, brought, driven = (line.removeprefix("$ ") for line in lines)
    where = f" --listen tcp/127.0.0.1:{free_port()}"
    with (
        started(tmp_path, served + where),
        fabric() as here,
        started(tmp_path, brought),
    ):
        until(lambda: row(here, "robot/sim"))
        with window(PLAIN, *driven.split()[2:]) as terminal:
            terminal.shows("Ctrl+C ends it")
            terminal.type(b"w")
            until(lambda: terminal.read() and here.robot("sim").state.x > 0.001)
            interrupt(terminal.process)
            assert terminal.end() in (0, 130)


def test_a_robot_of_your_own(tmp_path: Path) -> None:
    commands(tmp_path, blocks(PAGE, "sh")[1])
    assert (tmp_path / "runs/my_robot/plot.png").exists()
    commands(tmp_path, "rems run --direct my_robot.py")
    assert (tmp_path / "runs/my_robot.1/plot.png").exists()


def test_a_controller_and_its_results(tmp_path: Path) -> None:
    (tmp_path / "goto.py").write_text(GOTO)
    commands(tmp_path, blocks(PAGE, "sh")[2])
    assert (tmp_path / "runs/goto/plot.png").exists()
    (tmp_path / "results.py").write_text(blocks(PAGE, "python")[1])
    done = python(tmp_path, "results.py")
    assert (done.returncode, done.stderr) == (0, "")
    assert re.match(r"(19|20)\.\d+ cm after 10\.0 s\n", done.stdout)
    # "agree to a millimetre", and part at the wall
    near = re.search(r"rms ([\d.]+) mm", done.stdout) or re.search(
        r"([\d.]+) mm", done.stdout
    )
    assert near
    assert float(near[1]) < 1
    far = GOTO.replace(
        "default=0.2), y=length(default=0.2)", "default=0.4), y=length(default=0.3)"
    )
    assert far != GOTO
    (tmp_path / "goto.py").write_text(far)
    assert "never" in rems(tmp_path, "rems compare runs/goto").stdout
    assert "never" not in rems(tmp_path, "rems run --direct goto.py").stdout


def test_what_is_going_on_now(tmp_path: Path) -> None:
    (tmp_path / "goto.py").write_text(GOTO)
    run, live = blocks(PAGE, "sh")[3:5]
    with running(tmp_path, run.strip()):
        commands(tmp_path, live)


def test_there_are_ten() -> None:
    assert len(MISTAKES) == 10


@pytest.mark.parametrize(
    ("typed", "right", "told"), MISTAKES, ids=[typed for typed, *_ in MISTAKES]
)
def test_mistakes(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    typed: str,
    right: str,
    told: str,
) -> None:
    assert right in GOTO
    (tmp_path / "goto.py").write_text(GOTO.replace(right, typed))
    monkeypatch.chdir(tmp_path)
    assert main(["check", "goto.py"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("rems: goto.py")
    assert told in said
