"""What can go wrong on the line of a Create 2, and what its driver makes of it."""

from pathlib import Path

from tests.agents.runs import until
from tests.drivers.hardware.create2.scene import (
    emulated,
    keep,
    keep_for,
    opened,
    wheels,
)


def test_5_percent_of_what_it_is_told(tmp_path: Path) -> None:
    """Commands have no check sum: a broken one is seen by what it says it obeys."""
    with emulated(tmp_path) as emulator, opened(emulator) as robot:
        emulator.order("drop 0.05 heard")
        keep(robot, (300, 250), lambda: emulator.heard.done > 5)
        emulator.order("fine")
        keep(robot, (200, 200), lambda: wheels(emulator) == (200, 200))
        keep_for(robot, (200, 200), 0.1)
        assert wheels(emulator) == (200, 200)
        assert robot.figures()["rejected"] > 0
        assert robot.figures()["reconnects"] == 0


def test_it_answers_late(tmp_path: Path) -> None:
    """Later than max_age: nothing is obeyed any more, until it answers again."""
    with emulated(tmp_path) as emulator, opened(emulator) as robot:
        emulator.order("late 0.05")
        keep(robot, (100, 100), lambda: wheels(emulator) == (100, 100))
        keep_for(robot, (100, 100), 0.3)
        assert wheels(emulator) == (100, 100)
        emulator.order("late 0.8")
        keep(robot, (100, 100), lambda: wheels(emulator) == (0, 0))
        emulator.order("fine")
        keep(robot, (100, 100), lambda: wheels(emulator) == (100, 100))


def test_a_wrong_bit_has_set_its_speed(tmp_path: Path) -> None:
    """Of 145, which drives, that makes 129: it is deaf, goes on, and is called back."""
    with emulated(tmp_path) as emulator, opened(emulator) as robot:
        robot.silence = 0.4
        keep(robot, (100, 100), lambda: wheels(emulator) == (100, 100))
        robot.perform(lambda: robot.line.write(bytes([129, 1])))
        until(lambda: emulator.device.baud == 600)
        until(lambda: wheels(emulator) == (0, 0))
        keep(robot, (100, 100), lambda: wheels(emulator) == (100, 100))
        assert robot.figures()["reconnects"] == 1
