"""What can go wrong on the line of a Create 2, and what its driver makes of it."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from tests.agents.runs import until
from tests.drivers.hardware.create2.scene import (
    driven,
    emulated,
    keep,
    keep_for,
    opened,
    wheels,
)


@pytest.mark.parametrize("fault", ["corrupt", "drop", "lose"])
def test_5_percent_of_what_it_says(tmp_path: Path, fault: str) -> None:
    """Its loop is kept, what was damaged is counted, and no command is wrong."""
    with emulated(tmp_path) as emulator:
        with opened(emulator) as robot:
            emulator.tell(f"{fault} 0.05")
            keep(robot, (300, 250), lambda: emulator.said.done > 5)
            keep_for(robot, (300, 250), 0.2)
            figures = robot.figures()
            assert figures["rejected"] >= (3 if fault != "lose" else 0)
            assert figures["rejected"] < figures["cycles"] / 4
            assert (figures["reconnects"], figures["expired"]) == (0, 0)
            emulator.tell("fine")
            keep(robot, (0, 0), lambda: wheels(emulator) == (0, 0))
            keep_for(robot, (0, 0), 0.2)
            true = emulator.device.body.robot.state
            assert robot.state.x == pytest.approx(true.x, abs=0.005)
        assert driven(emulator) == {(0, 0), (300, 250)}


def test_5_percent_of_what_it_is_told(tmp_path: Path) -> None:
    """Commands have no check sum: a broken one is seen by what it says it obeys."""
    with emulated(tmp_path) as emulator, opened(emulator) as robot:
        emulator.tell("drop 0.05 heard")
        keep(robot, (300, 250), lambda: emulator.heard.done > 5)
        emulator.tell("fine")
        keep(robot, (200, 200), lambda: wheels(emulator) == (200, 200))
        keep_for(robot, (200, 200), 0.1)
        assert wheels(emulator) == (200, 200)
        assert robot.figures()["rejected"] > 0
        assert robot.figures()["reconnects"] == 0


def test_an_echo(tmp_path: Path) -> None:
    with emulated(tmp_path) as emulator, opened(emulator) as robot:
        emulator.tell("echo")
        keep(robot, (100, 100), lambda: wheels(emulator) == (100, 100))
        keep(robot, (100, 100), lambda: robot.state.x > 0.02)


def test_it_answers_late(tmp_path: Path) -> None:
    """Later than max_age: nothing is obeyed any more, until it answers again."""
    with emulated(tmp_path) as emulator, opened(emulator) as robot:
        emulator.tell("late 0.05")
        keep(robot, (100, 100), lambda: wheels(emulator) == (100, 100))
        keep_for(robot, (100, 100), 0.3)
        assert wheels(emulator) == (100, 100)
        emulator.tell("late 0.8")
        keep(robot, (100, 100), lambda: wheels(emulator) == (0, 0))
        emulator.tell("fine")
        keep(robot, (100, 100), lambda: wheels(emulator) == (100, 100))


def unplugged(tmp_path: Path, seconds: float) -> None:
    with emulated(tmp_path) as emulator, opened(emulator) as robot:
        body = emulator.device.body
        keep(robot, (100, 100), lambda: wheels(emulator) == (100, 100))
        begun = time.monotonic()
        emulator.tell(f"unplug {seconds}")
        keep(robot, (100, 100), lambda: not robot.figures()["connected"])
        # It has no watchdog of its own: this is why its page says: on a stand.
        assert wheels(emulator) == (100, 100)
        keep(robot, (100, 100), lambda: time.monotonic() > begun + seconds - 0.3)
        # From now on nobody says anything; it is back, and stands.
        until(lambda: wheels(emulator) == (0, 0))
        until(lambda: robot.figures()["reconnects"] > 0)
        assert wheels(emulator) == (0, 0)
        keep(robot, (100, 100), lambda: wheels(emulator) == (100, 100))
        keep(robot, (0, 0), lambda: wheels(emulator) == (0, 0))
        keep_for(robot, (0, 0), 0.1)
        # Its encoders have counted all the way.
        assert robot.state.x == pytest.approx(body.robot.state.x, abs=0.005)


def test_unplugged_and_back(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    unplugged(tmp_path, 1.0)
    said = capfd.readouterr().err
    assert "warning: robot/b has lost its device (" in said
    assert "warning: robot/b is back after " in said


@pytest.mark.slow
def test_unplugged_for_5_s(tmp_path: Path) -> None:
    unplugged(tmp_path, 5.0)


def test_without_power(tmp_path: Path) -> None:
    """It starts anew, stands, and counts from zero: its driver does not jump."""
    with emulated(tmp_path) as emulator, opened(emulator) as robot:
        keep(robot, (300, 300), lambda: robot.state.x > 0.1)
        emulator.tell("brownout 1.2")
        keep(robot, (300, 300), lambda: not robot.figures()["connected"])
        assert wheels(emulator) == (0, 0)
        before = robot.state.x
        until(lambda: robot.figures()["reconnects"] > 0)
        assert wheels(emulator) == (0, 0)
        keep(robot, (300, 300), lambda: wheels(emulator) == (300, 300))
        assert abs(robot.state.x - before) < 0.1


def test_a_wrong_bit_has_set_its_speed(tmp_path: Path) -> None:
    """Of 145, which drives, that makes 129: it is deaf, goes on, and is called back."""
    with emulated(tmp_path) as emulator, opened(emulator) as robot:
        keep(robot, (100, 100), lambda: wheels(emulator) == (100, 100))
        robot.perform(lambda: robot.line.write(bytes([129, 1])))
        until(lambda: emulator.device.baud == 600)
        until(lambda: wheels(emulator) == (0, 0))
        keep(robot, (100, 100), lambda: wheels(emulator) == (100, 100))
        assert robot.figures()["reconnects"] == 1


def test_closed_while_it_is_unplugged(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with emulated(tmp_path) as emulator, opened(emulator) as robot:
        keep(robot, (100, 100), lambda: wheels(emulator) == (100, 100))
        emulator.tell("unplug 60")
        keep(robot, (100, 100), lambda: not robot.figures()["connected"])
    assert "robot/b is out of reach: that it stands" in capfd.readouterr().err
