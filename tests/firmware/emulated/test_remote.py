"""A Woodbot's firmware in an experiment, where it stays, beside its models."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rems_net import client
from rems_net.recordings import recording
from tests.agents.runs import until
from tests.commands import command, finished
from tests.firmware.emulated.scene import Serve, compiled
from tests.interrupts import APART, interrupt

EXAMPLES = Path(__file__).parents[3] / "examples"


@pytest.fixture(scope="module")
def serve() -> Iterator[Serve]:
    """An open fabric, with robot/woodbot-7 on it."""
    compiled()
    emulate = "board", "emulate", "woodbot", "--name", "woodbot-7", "--library"
    with Serve() as serve:
        robot = subprocess.Popen(
            command(*emulate),
            env=os.environ | {"REMS_ROUTER": serve.endpoint},
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            **APART,
        )
        assert robot.stdout is not None
        try:
            assert "is on the fabric" in robot.stdout.readline()
            yield serve
        finally:
            interrupt(robot)
            robot.communicate(timeout=30)


@pytest.fixture(autouse=True)
def joined(serve: Serve, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("REMS_ROUTER", serve.endpoint)


@pytest.mark.slow
def test_beside_its_models(tmp_path: Path) -> None:
    """The example: it ends, and what the robot did is recorded beside the others."""
    for name in ("real_woodbot.py", "keys.csv"):
        shutil.copy(EXAMPLES / name, tmp_path)
    words = [sys.executable, "-W", "error", "real_woodbot.py"]
    done = finished(words, tmp_path, seconds=300)
    assert done.returncode == 0, done.stderr
    result = recording.read(tmp_path / "runs" / "real")
    robot = result["woodbot-7"]
    # The input speaks in percent, and the firmware in rad/s.
    told = [float(speed) for speed in robot["command/wheel/right"]]
    assert max(told) == 7.3
    assert min(told) >= 0.0
    # It was reset, drove ahead, and then to its left.
    assert abs(float(robot["state/x"][0])) < 0.05
    assert float(max(robot["state/x"])) > 0.1
    assert float(max(robot["state/y"])) > 0.02
    pairs = {frozenset((pair.a, pair.b)) for pair in result.compare()}
    assert {"woodbot-7", "kinematic"} in pairs
    assert "kinematic - woodbot-7" in done.stdout
    assert (tmp_path / "runs" / "real" / "plot.png").stat().st_size > 10_000


@pytest.mark.slow
def test_driven_with_units() -> None:
    """Its proxy converts what it is told; its firmware could not."""
    with client.join() as found:
        robot = found.robot("woodbot-7")

        def obeys() -> bool:
            robot.command.update({"wheel/left": "50 percent", "wheel/right": "-10 rpm"})
            return [float(robot.command[f"wheel/{w}"]) for w in ("left", "right")] == [
                pytest.approx(3.65),
                pytest.approx(-1.0471975512),
            ]

        until(obeys, 30)
        until(lambda: float(robot.command["wheel/left"]) == 0.0, 30)  # by itself


@pytest.mark.slow
def test_its_clock_is_estimated() -> None:
    """On one machine it is never behind, and not late by more than a stall."""
    with client.join() as found:
        figures = found.call("robot/woodbot-7", "figures", (), {})
        assert 0.0 <= figures["delay"] < 10.0
        again = found.call("robot/woodbot-7", "figures", (), {})
        assert again["offset"] == pytest.approx(figures["offset"], abs=10.0)
        *_, said = (s for s in found.why("robot/woodbot-7") if "its own clock" in s)
        assert "robot/woodbot-7 received the newest tick at most " in said
