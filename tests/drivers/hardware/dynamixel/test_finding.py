"""What a driver says of servos that are not as they should be: what to check."""

import re
from pathlib import Path

import pytest

from rems_net.cable.device import dynamixel
from rems_net.drivers.hardware.dynamixel import table
from rems_net.drivers.hardware.dynamixel.arms import Arms
from rems_net.drivers.hardware.dynamixel.wheels import Wheels
from rems_net.emulators.dynamixel.robots import DynabotServos, ScalerServos
from rems_net.emulators.dynamixel.servo import Servo
from tests.agents.runs import until
from tests.drivers.hardware.dynamixel.scene import emulated, opened, refused

LEFT = r"servo 2 \(wheel/left\)"


def test_one_does_not_answer(tmp_path: Path) -> None:
    """Another is there, that nobody asked for: it may be the one."""
    device = DynabotServos()
    device.left.memory[table.ID] = 7
    with emulated(tmp_path, device) as emulator:
        said = refused(Wheels, emulator)
    assert re.fullmatch(
        LEFT + r" does not answer at 1000000 bits per second; servo 1 \(wheel/right\) "
        r"does\. Check, in this order: 1\. the cable .* 3\. its ID: there is servo 7, "
        r"XL430-W250 \(model 1060\), that is not asked for; 4\. its Baud Rate.*",
        said,
    ), said


def test_one_of_many_does_not_answer(tmp_path: Path) -> None:
    with emulated(tmp_path, ScalerServos()) as emulator:
        emulator.order("cut 13")
        until(lambda: not all(servo.there for servo in emulator.device.servos))
        said = refused(Arms, emulator)
    assert said.startswith(
        "servo 13 (left/wrist/1) does not answer at 4000000 bits per second; servo 1 "
        "(left/shoulder) and 16 others do. Check, in this order: 1. the cable"
    )


def test_none_answers(tmp_path: Path) -> None:
    device = DynabotServos()
    for servo in device.servos:
        servo.there = False
    with emulated(tmp_path, device) as emulator:
        said = refused(Wheels, emulator)
    assert re.fullmatch(
        r"no servo answers at \S+, at 1000000 bits per second or another usual "
        r"speed\. Check, in this order: 1\. that the servos have power .*",
        said,
    ), said


def test_another_speed(tmp_path: Path) -> None:
    with emulated(tmp_path, DynabotServos(baud=57_600)) as emulator:
        said = refused(Wheels, emulator)
        assert re.fullmatch(
            r"no servo answers at \S+ at 1000000 bits per second, but " + LEFT + r" "
            r"does at 57600\. Set options = \{ baud = 57600 \}, or set .*",
            said,
        ), said
        with opened(Wheels, emulator, baud=57_600):
            pass


def test_another_model(tmp_path: Path) -> None:
    device = DynabotServos()
    device.left.memory[table.MODEL] = 1200
    with emulated(tmp_path, device) as emulator:
        said = refused(Wheels, emulator)
    assert re.fullmatch(
        LEFT
        + r" reports at 1000000 bits per second that it is XL330-M288 \(model 1200\);"
        r" expected XL430-W250\. Check, in this order: 1\. which servo .* swapped\."
        r" \(R0310\)",
        said,
    ), said


@pytest.mark.parametrize(
    ("number", "model"), [(1020, "XM430-W350"), (1040, "XH430-V350")]
)
def test_wheels_of_another_model_that_are_meant(
    tmp_path: Path, number: int, model: str
) -> None:
    device = DynabotServos()
    for servo in device.servos:
        servo.memory[table.MODEL] = number
    with (
        emulated(tmp_path, device) as emulator,
        opened(Wheels, emulator, model=model),
    ):
        assert device.left.memory[table.TORQUE]


def test_torque_is_refused(tmp_path: Path) -> None:
    with emulated(tmp_path, DynabotServos()) as emulator:
        emulator.device.left.strong = False
        said = refused(Wheels, emulator)
    assert re.fullmatch(
        LEFT
        + r" keeps its torque off, though the command was to switch it on\. Check, in "
        r"this order: 1\. that its supply .*",
        said,
    ), said


def test_hot_from_the_start(tmp_path: Path) -> None:
    """It is started anew, once, which does not help."""
    with emulated(tmp_path, DynabotServos()) as emulator:
        emulator.order("overheat 2")
        until(lambda: emulator.device.left.hot)
        said = refused(Wheels, emulator)
    assert re.match(LEFT + " reports a hardware error: it is too hot. Take", said), said


def test_ill_from_before(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Who starts the robot stands beside it: what is over is forgotten then."""
    device = DynabotServos()
    device.left.fail(0x20)
    with emulated(tmp_path, device) as emulator, opened(Wheels, emulator):
        assert device.left.memory[table.TORQUE]
    assert "starts servo 2 (wheel/left) anew: it is overl" in capfd.readouterr().err


def test_two_motors_of_a_joint_that_disagree(tmp_path: Path) -> None:
    device = ScalerServos()
    second = next(servo for servo in device.servos if servo.number == 104)
    second.position += 300
    with emulated(tmp_path, device) as emulator:
        said = refused(Arms, emulator)
        assert not any(servo.memory[table.TORQUE] for servo in device.servos)
    assert re.fullmatch(
        r"servo 4 \(right/shoulder\) and servo 104 turn the same joint, and are 26 "
        r"degrees apart: they would pull against each other\. Check, in this order: .*",
        said,
    ), said


def test_a_servo_that_answers_to_reading_only(tmp_path: Path) -> None:
    device = DynabotServos()
    device.left.memory[table.STATUS_RETURN] = 1
    with emulated(tmp_path, device) as emulator, opened(Wheels, emulator):
        assert device.left.memory[table.STATUS_RETURN] == 2


def test_a_stranger_on_the_bus_does_no_harm(tmp_path: Path) -> None:
    device = DynabotServos()
    device.servos.append(Servo({table.ID: 9, table.BAUD: 3}))
    with emulated(tmp_path, device) as emulator, opened(Wheels, emulator):
        pass
    assert table.TORQUE not in device.servos[-1].told


def test_rems_ports_says_which_are_there(tmp_path: Path) -> None:
    with emulated(tmp_path, DynabotServos()) as emulator:
        assert dynamixel(emulator.where) == (
            "DYNAMIXEL servos 1, 2: XL430-W250 (model 1060), at options baud = 1000000"
        )
