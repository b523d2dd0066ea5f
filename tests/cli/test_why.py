"""`rems why`: what keeps a value from coming, or makes it old."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from rems_net.client import Fabric, join
from rems_net.router.message import pack
from tests.agents.runs import ticking, until
from tests.cli.conftest import place, starting
from tests.commands import Run
from tests.signals import freeze, thaw

LAB = """\
[experiment]
name = "lab"
dt = "20 ms"
duration = "120 s"
pace = 1.0
record = false

[[robot]]
name = "sim"
host = "here"
definition = "woodbot"
driver = "kinematic"

[[robot]]
name = "driven"
host = "here"
definition = "woodbot"
driver = "kinematic"

[[robot]]
name = "target"
host = "here"
definition = "woodbot"
driver = "kinematic"

[[robot]]
name = "shadow"
host = "apart"
definition = "woodbot"
driver = "kinematic"
command = "robot/sim/command"
"""


@pytest.fixture(scope="module")
def notes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The runtime folder of a run that all these tests ask."""
    folder = tmp_path_factory.mktemp("why")
    (folder / "lab.toml").write_text(LAB)
    with starting(folder) as start:
        with place(folder) as notes:
            start("run", "lab.toml")
            ticking(2)
        yield notes


@pytest.fixture
def fabric(notes: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Fabric]:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(notes))
    with join() as here:
        yield here


def test_nothing_has_come(fabric: Fabric, rems: Run) -> None:
    done = rems("why", "robot/sim/command")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == (
        "Nothing that fits has come at robot/sim/command from a program outside yet. "
        "It takes a value that any program puts at robot/sim/command.\n"
    )
    shadow = rems("why", "robot/shadow").stdout.splitlines()
    assert re.fullmatch(
        r"robot/shadow/command has the value from robot/sim/command at "
        r"\d+\.\d\d s, 0\.0\d s of fabric time ago\.",
        shadow[0],
    )
    assert re.fullmatch(
        r"robot/shadow/state was written at tick \d+ \(\d+\.\d\d s\), the newest that "
        r"robot/shadow has made\.",
        shadow[1],
    )


def test_a_command_that_is_too_old(fabric: Fabric) -> None:
    port = "robot/driven/command"
    fabric.robot("driven").command = {"wheel": {"left": 1.0}}  # and the right one stays
    stands = "robot/driven stands still: that is older than the 0.5 s for which it"
    until(lambda: fabric.why(port)[1:2] == [f"{stands} obeys a command."])
    assert re.fullmatch(r".* at \d+\.\d\d s, .*", fabric.why(port)[0])


def test_what_was_dropped(fabric: Fabric) -> None:
    port = "robot/target/command"
    for payload in (b"\xc1", pack({"wheel": {"left": 1.0, "right": 900.0}})):
        fabric.session.put(f"rems/{port}", payload)
        until(lambda: fabric.why(port)[-1].startswith("robot/target"))
    until(lambda: len(fabric.why(port)) == 3)
    said = fabric.why(port)
    assert said[0].startswith(f"Nothing that fits has come at {port} ")
    assert said[1].startswith(f"{port} has dropped 1 x: ")
    assert "900.0" in said[2]


def test_paused_and_stopped(fabric: Fabric, rems: Run) -> None:
    rems("clock", "pause")
    rems("stop")
    first, second, *_ = rems("why", "robot/sim/state").stdout.splitlines()
    assert re.fullmatch(
        r"The clock is paused after tick \d+\. Type: rems clock resume", first
    )
    assert second == "STOP holds, until `rems stop --release`."
    rems("stop", "--release")
    rems("clock", "resume")


def test_a_held_tick(fabric: Fabric) -> None:
    row = next(r for r in fabric.agents() if r["agent"] == "robot/shadow")
    pid = int(row["host"].rpartition(":")[2])
    freeze(pid)
    try:
        held = re.compile(
            r"Tick \d+ has been held for \d+\.\d s by robot/shadow on \S+\."
        )
        until(lambda: held.fullmatch(fabric.why("robot/sim/state")[0]))
    finally:
        thaw(pid)


@pytest.mark.parametrize(
    ("key", "sentence"),
    [
        (
            "robot/sim/comand",
            "robot/sim has no port 'comand'; it has command, state, sensors. Did you "
            "mean 'command'?",
        ),
        ("robot/smi/state", "Nothing lives at 'robot/smi/state'."),
        ("rbot/sim", "'rbot/sim' begins with 'rbot'; "),
    ],
)
def test_mistakes(fabric: Fabric, rems: Run, key: str, sentence: str) -> None:
    done = rems("why", key)
    assert (done.returncode, done.stdout) == (2, "")
    assert sentence in done.stderr


def test_no_run(program: Run) -> None:
    assert "No fabric 'rems' is running" in program("why", "robot/sim").stderr
