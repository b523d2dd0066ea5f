"""The Dynabot's driver and emulated servos, on a real port, by the real library."""

from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.robot import combine
from rems_net.drivers.hardware import device_thread
from rems_net.drivers.hardware.create2.readings import CLIFFS
from rems_net.drivers.hardware.dynamixel import table
from rems_net.drivers.hardware.dynamixel.wheels import Wheels
from rems_net.emulators.dynamixel.robots import DynabotServos
from rems_net.emulators.emulator import Emulator
from rems_net.errors import SchemaError
from rems_net.robots.create2 import Create2
from rems_net.robots.scaler import Scaler
from tests.agents.runs import until
from tests.drivers.alone import keep, keep_for
from tests.drivers.hardware.dynamixel.scene import emulated, made, opened, refused

#: a command, and what the servos on the left and on the right are told for it
AHEAD = {"wheel/left": 2.0, "wheel/right": 1.0}
COUNTS = (83, -42)
STAND = {"wheel/left": 0.0, "wheel/right": 0.0}


def goals(emulator: Emulator[Any]) -> tuple[int, int]:
    """What the servos on the left and on the right obey."""
    servos = emulator.device.left, emulator.device.right
    left, right = (servo.memory[table.GOAL_VELOCITY] for servo in servos)
    return left, right


def told(emulator: Emulator[Any]) -> tuple[set[int], set[int]]:
    """What they were ever told."""
    servos = emulator.device.left, emulator.device.right
    left, right = (servo.told[table.GOAL_VELOCITY] for servo in servos)
    return left, right


def agrees(robot: Any, emulator: Emulator[Any]) -> bool:
    """Whether it says where it really is, within 4 mm or mrad."""
    true = emulator.device.robot.state
    return all(
        abs(robot.state[path] - true[path]) < 0.004 for path in true.schema.paths
    )


def stand(emulator: Emulator[Any]) -> bool:
    return not (emulator.device.left.speed or emulator.device.right.speed)


def test_it_obeys_and_says_where_it_is(tmp_path: Path) -> None:
    with emulated(tmp_path, DynabotServos()) as emulator:
        with opened(Wheels, emulator) as robot:
            keep(robot, AHEAD, lambda: robot.state["wheel/left"] > 1)
            keep(robot, AHEAD, lambda: goals(emulator) == COUNTS)
            assert robot.figures()["safe"] == ""
            keep(robot, STAND, lambda: stand(emulator))
            keep(robot, STAND, lambda: agrees(robot, emulator))
            assert robot.state.heading < 0, "the left wheel is faster: it turns right"
            assert robot.sensors["encoder/left"] == robot.state["wheel/left"]
            assert robot.status.voltage == 12.0
            assert robot.status.temperature == 32
            servo = emulator.device.left.memory
            assert servo[table.OPERATING_MODE] == table.VELOCITY_MODE
            assert servo[table.WATCHDOG] * table.WATCHDOG_STEP == robot.max_age
            servo[table.WATCHDOG] = 0
            keep(robot, STAND, lambda: servo[table.WATCHDOG] == 25)
        assert told(emulator) == ({0, COUNTS[0]}, {0, COUNTS[1]})
        until(lambda: not emulator.device.left.memory[table.TORQUE])


def test_a_wheel_that_is_mounted_the_other_way_round(tmp_path: Path) -> None:
    """What its servo is set to count like is left as it is; the rest is not."""
    device = DynabotServos()
    device.left.memory[table.DRIVE_MODE] = table.REVERSE | 0x04
    with (
        emulated(tmp_path, device) as emulator,
        opened(Wheels, emulator, reversed_left=True) as robot,
    ):
        assert device.left.memory[table.DRIVE_MODE] == table.REVERSE
        keep(robot, AHEAD, lambda: goals(emulator) == (-83, -42))
        until(lambda: device.left.radians > 1)
        keep(robot, AHEAD, lambda: robot.state["wheel/left"] > 0.2)


def test_no_faster_than_its_servos_are_allowed_to(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """A goal beyond their limit they would refuse, in silence."""
    device = DynabotServos()
    device.left.memory[table.VELOCITY_LIMIT] = 50
    with emulated(tmp_path, device) as emulator, opened(Wheels, emulator) as robot:
        keep(robot, AHEAD, lambda: goals(emulator) == (50, -42))
    assert (
        "warning: robot/b turns wheel/left at 1.20 rad/s at most, and 100 % is 6.35 "
        "rad/s: the Velocity Limit of servo 2\n"
    ) in capfd.readouterr().err


def test_what_another_program_has_left_in_its_servos(tmp_path: Path) -> None:
    """No force, and a slow start: both are kept until the power is off."""
    device = DynabotServos()
    for servo in (device.left, device.right):
        servo.memory[table.OPERATING_MODE] = table.VELOCITY_MODE
        servo.memory[table.GOAL_PWM] = 0
        servo.memory[table.PROFILE_ACCELERATION] = 1
    with emulated(tmp_path, device) as emulator, opened(Wheels, emulator) as robot:
        keep(robot, AHEAD, lambda: robot.state["wheel/left"] > 1)
        assert device.left.memory[table.GOAL_PWM] == table.FULL_PWM
        assert device.left.memory[table.PROFILE_ACCELERATION] == 0


@pytest.mark.parametrize(
    ("register", "name"),
    [(table.PWM_LIMIT, "PWM Limit"), (table.VELOCITY_LIMIT, "Velocity Limit")],
)
def test_a_limit_of_0(tmp_path: Path, register: table.Register, name: str) -> None:
    device = DynabotServos()
    device.right.memory[register] = 0
    with emulated(tmp_path, device) as emulator:
        assert f"servo 1 (wheel/right) cannot move: its {name} is 0." in refused(
            Wheels, emulator
        )


def test_a_weak_servo(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    device = DynabotServos()
    device.left.memory[table.PWM_LIMIT] = 177
    with emulated(tmp_path, device) as emulator, opened(Wheels, emulator) as robot:
        keep(robot, AHEAD, lambda: robot.state["wheel/left"] > 0.1)
    assert (
        "robot/b has little force at servo 2 (wheel/left): its PWM Limit is 20 %"
        in (capfd.readouterr().err)
    )


def test_reset_counts_from_where_it_is(tmp_path: Path) -> None:
    with (
        emulated(tmp_path, DynabotServos()) as emulator,
        opened(Wheels, emulator) as robot,
    ):
        robot.initial = {"x": 1.0}
        keep(robot, AHEAD, lambda: robot.state.x > 0.02)
        robot.reset()
        assert robot.state.x == 1.0
        keep(robot, STAND, lambda: robot.reading_age < 0.1)
        assert robot.state.x == pytest.approx(1.0, abs=0.05)


def test_one_servo_starts_anew(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with (
        emulated(tmp_path, DynabotServos()) as emulator,
        opened(Wheels, emulator) as robot,
    ):
        keep(robot, AHEAD, lambda: goals(emulator) == COUNTS)
        emulator.order("restart 2")
        keep(robot, AHEAD, lambda: robot.figures()["reconnects"] > 0)
        keep(robot, AHEAD, lambda: goals(emulator) == COUNTS)
    said = capfd.readouterr().err
    assert "servo 2 (wheel/left)" in said


def test_overloaded(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Both wheels stand, and stay so until somebody has seen to it."""
    with (
        emulated(tmp_path, DynabotServos()) as emulator,
        opened(Wheels, emulator) as robot,
    ):
        keep(robot, AHEAD, lambda: goals(emulator) == COUNTS)
        emulator.order("overload 1")
        keep(robot, AHEAD, lambda: stand(emulator))
        keep_for(robot, AHEAD, 0.5)
        assert stand(emulator)
        robot.reboot()
        keep(robot, AHEAD, lambda: robot.state.x > 0.05)
        assert goals(emulator) == COUNTS
    said = capfd.readouterr().err
    assert (
        "has lost its device (servo 1 (wheel/right) reports a hardware error: it is "
        "overloaded. Take the cause away; then type: rems call robot/b reboot)"
    ) in said
    assert "starts servo 1 (wheel/right) anew: it is overloaded" in said


def test_a_definition_without_wheels() -> None:
    pytest.importorskip("dynamixel_sdk", reason="dynamixel-sdk is not installed")
    with pytest.raises(SchemaError, match='take the definition "dynabot"'):
        combine(Scaler, Wheels)("b", options={"port": "x"}).prepare()


def test_what_it_cannot_sense_is_told(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A definition of another robot: its bumpers would never give, in silence."""
    monkeypatch.setattr(device_thread, "HELD", 0.1)
    with emulated(tmp_path, DynabotServos()) as emulator:
        robot: Any = combine(Create2, Wheels)("b", options={"port": emulator.where})
        robot.prepare()
        robot.open()
        keep_for(robot, STAND, 0.4)
        robot.close()
    cliffs = (f"sensors/cliff/{at}" for at in CLIFFS)
    # The first two are on the speed of its wheels.
    assert capfd.readouterr().err.splitlines()[2:] == [
        "warning: robot/b receives nothing from its device of sensors/bumper/left, "
        f"sensors/bumper/right, {', '.join(cliffs)}"
    ]


def test_two_wheels_with_one_servo() -> None:
    pytest.importorskip("dynamixel_sdk", reason="dynamixel-sdk is not installed")
    with pytest.raises(SchemaError, match=r"Both wheels of robot/b have the servo 1;"):
        made(Wheels, port="x", left=1).prepare()
