"""`rems new`: short files that run at once, in every way that they say."""

import sys
from pathlib import Path

import pytest

from rems_net.cli import main
from rems_net.cli.new import KINDS
from rems_net.errors import uncoded
from tests.commands import Run, python

#: what every file leaves behind
MADE = {
    "robot": ["cart.csv"],
    "driver": ["mine.csv", "model.csv"],
    "input": ["sim.csv"],
    "process": ["sim.csv"],
    "output": ["sim.csv"],
    "experiment": ["exact.csv", "model.csv"],
}


def recordings(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in sorted((folder / "runs").glob("*/*.csv"))}


@pytest.mark.parametrize("kind", KINDS)
def test_what_it_writes_runs_at_once(
    folder: Path, rems: Run, program: Run, kind: str
) -> None:
    """In many processes, too: the robot, which is compared with a second run."""
    rems = program if kind == "robot" else rems
    made = rems("new", kind, f"my_{kind}")
    assert (made.returncode, made.stderr) == (0, "")
    file = f"my_{kind}{KINDS[kind][0]}"
    assert f"  rems run {file}\n" in made.stdout
    for line in made.stdout.splitlines()[1:]:  # what it says to type next
        verb, *words = line.split()[1:]
        direct = ["--direct"] if verb == "run" and kind != "robot" else []
        done = rems(verb, *direct, *words)
        assert (done.returncode, done.stderr) == (0, ""), line
    found = recordings(folder)
    assert list(found) == MADE[kind]
    for name, data in found.items():
        rows = data.decode().splitlines()
        assert len(rows) > 50
        first, last = rows[1].split(",")[1:], rows[-1].split(",")[1:]
        assert first != last, f"{name}: nothing happens"
    if kind == "robot":
        done = python(folder, file)
        assert done.returncode == 0, done.stderr
        assert recordings(folder) == found


@pytest.mark.parametrize("kind", KINDS)
def test_what_it_writes_is_short_and_in_order(folder: Path, kind: str) -> None:
    assert main(["new", kind, f"my_{kind}"]) == 0
    for end in KINDS[kind]:
        lines = (folder / f"my_{kind}{end}").read_text().splitlines()
        assert len(lines) <= 30
        assert max(map(len, lines)) <= 88
        assert not [line for line in lines if "$" in line]
    if KINDS[kind] == (".py",):
        rules = ["--isolated", "--line-length", "88", f"my_{kind}.py"]
        for words in (["check", "--select", "E,F,I,N,B,UP,SIM"], ["format", "--diff"]):
            done = python(folder, "-m", "ruff", *words, *rules)
            assert done.returncode == 0, done.stdout


def test_nothing_is_overwritten(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "arm.py").write_text("mine")
    (folder / "day.csv").write_text("mine")
    for kind, name, file in (("robot", "arm", "arm.py"), ("experiment", "day", "day")):
        assert main(["new", kind, name]) == 2
        there = "day.csv" if file == "day" else file
        assert capsys.readouterr().err == (
            f"rems: There is a file {there} here already, and it stays as it is; "
            "choose another name."
            " (R0907)\n"
        )
        assert (folder / there).read_text() == "mine"
    assert not (folder / "day.toml").exists()


NO_NAME = (
    "is no name for a file of Python; expected a letter, and then letters, digits or "
    "'_', 40 at most."
)


@pytest.mark.parametrize(
    ("kind", "name", "sentence"),
    [
        (
            "robt",
            "arm",
            "There is no kind 'robt'; expected one of robot, driver, input, process, "
            "output, experiment. Did you mean 'robot'?",
        ),
        ("robot", "my-arm", f"'my-arm' {NO_NAME} Type: rems new robot my_arm"),
        ("robot", "arm.py", f"'arm.py' {NO_NAME} Type: rems new robot arm"),
        ("robot", "3d", f"'3d' {NO_NAME} Type: rems new robot my_3d"),
        ("input", "../x", f"'../x' {NO_NAME} Type: rems new input x"),
        ("output", "été", f"'été' {NO_NAME} Type: rems new output t"),
        ("robot", "_", f"'_' {NO_NAME} Type: rems new robot robot"),
        (
            "robot",
            "random",
            "'random' will not do: random.py would hide the module 'random' from all "
            "programs here. Type: rems new robot my_random",
        ),
        (
            "robot",
            "numpy",
            "'numpy' will not do: numpy.py would hide the module 'numpy' from all "
            "programs here. Type: rems new robot my_numpy",
        ),
        (
            "input",
            "input",
            "'input' will not do: the file has another 'Input' in it. Type: rems new "
            "input my_input",
        ),
        (
            "robot",
            "hand",
            "'hand' will not do: the file has another 'Hand' in it. Type: rems new "
            "robot my_hand",
        ),
        (
            "driver",
            "class",
            "'class' will not do: it is a word of Python's own. Type: rems new driver "
            "my_class",
        ),
        (
            "driver",
            "none",
            "'none' will not do: it is a word of Python's own. Type: rems new driver "
            "my_none",
        ),
    ],
)
def test_names_are_checked(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    kind: str,
    name: str,
    sentence: str,
) -> None:
    before = sorted(folder.iterdir())
    assert main(["new", kind, name]) == 2
    assert uncoded(capsys.readouterr().err.rstrip("\n")) == f"rems: {sentence}"
    assert sorted(folder.iterdir()) == before


def test_a_folder_that_cannot_be_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Root may write anywhere, so: a folder that is gone."""
    if sys.platform == "win32":
        pytest.skip("Windows removes no folder in which a program is")
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert main(["new", "robot", "arm"]) == 2
    assert capsys.readouterr().err == (
        "rems: cannot write arm.py: No such file or directory. The folder in which "
        "you are was removed. Go to another one: cd ~ (R0905)\n"
    )


def test_the_robot_does_what_robots_must(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "robot", "checked_robot"]) == 0
    assert main(["check", "checked_robot.py:CheckedRobot", "--alone"]) == 0
    assert "nothing wrong" in capsys.readouterr().out
