"""The driver of SCALER's arms and 18 emulated servos, on a real port."""

import csv
import time
from math import pi
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st

from rems_net import Experiment
from rems_net.agents.protocol.plan import HERE
from rems_net.agents.robot import combine
from rems_net.drivers.hardware.dynamixel import table
from rems_net.drivers.hardware.dynamixel.arms import JOINTS, Arms
from rems_net.emulators.dynamixel.robots import ScalerServos
from rems_net.emulators.dynamixel.servo import Servo
from rems_net.errors import SchemaError
from rems_net.robots.dynabot import Dynabot
from rems_net.robots.limb import paths
from rems_net.robots.scaler import ARMS, Scaler, ScalerLeft
from tests.agents.runs import Told, until
from tests.drivers import alone
from tests.drivers.alone import keep, keep_for
from tests.drivers.hardware.dynamixel.scene import emulated, opened

#: the left arm goes somewhere; the right one holds
THERE = {
    "left/shoulder": 0.3,
    "left/top": 0.1,
    "left/bottom": 1.4,
    "left/wrist/1": 0.2,
    "left/wrist/2": -0.3,
    "left/wrist/3": 3.0,
    "left/speed": 0.5,
}
HOLD = {"left/speed": 0.0, "right/speed": 0.0}


def servo(device: ScalerServos, number: int) -> Servo:
    return next(one for one in device.servos if one.number == number)


def arrived(robot: Any) -> bool:
    return all(
        abs(robot.state[path] - angle) < 0.002
        for path, angle in THERE.items()
        if "speed" not in path
    )


def test_a_homing_offset_is_named(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """It moves the zero of a joint: somebody may have set it for another robot."""
    device = ScalerServos()
    servo(device, 13).memory[table.HOMING_OFFSET] = 512
    with emulated(tmp_path, device) as emulator, opened(Arms, emulator) as robot:
        keep_for(robot, HOLD, 0.1)
    said = capfd.readouterr().err
    assert "counts angles of servo 13 (left/wrist/1) from 45.0 degrees: its Hom" in said


def test_the_joints_are_the_definitions() -> None:
    assert list(JOINTS) == [path for arm in ARMS for path in paths(arm)]
    numbers = [joint.servo for joint in JOINTS.values()]
    numbers += [joint.twin for joint in JOINTS.values() if joint.twin]
    assert sorted(numbers) == [*range(1, 7), *range(13, 19), *range(101, 107)]


@given(st.sampled_from(sorted(JOINTS)), st.floats(-3.14, 3.14))
def test_an_angle_is_counts_as_in_the_original(path: str, angle: float) -> None:
    """hw = wrap((q + offset + pi) * direction), of the facts of the original."""
    left = [0, pi / 2, -pi / 2, 0, 0, 0]
    right = [0, pi / 2, -pi / 2, 0, 0, pi]
    arm = path.partition("/")[0]
    at = paths(arm).index(path)
    offset = {"left": left, "right": right}[arm][at]
    ways = {"left": [1, -1, 1, 1, 1, 1], "right": [1, 1, -1, 1, -1, 1]}[arm]
    hardware = ((angle + offset + pi) * ways[at]) % (2 * pi)
    counts = JOINTS[path].counts(angle)
    apart = (counts * 2 * pi / 4096 - hardware + pi) % (2 * pi) - pi
    assert abs(apart) <= pi / 4096 + 1e-9
    again = (JOINTS[path].angle(counts) - angle + pi) % (2 * pi) - pi
    assert abs(again) <= pi / 4096 + 1e-9


def test_they_go_where_they_are_told_and_hold(tmp_path: Path) -> None:
    device = ScalerServos()
    with emulated(tmp_path, device) as emulator:
        with opened(Arms, emulator) as robot:
            begin = Scaler.state.schema()
            robot.sense()
            for path in JOINTS:
                assert robot.state[path] == pytest.approx(begin[path], abs=0.002)
            keep(robot, THERE, lambda: robot.sensors["left/velocity/wrist/3"] > 1)
            # 0.5 of its 5.445 rad/s.
            assert robot.sensors["left/velocity/wrist/3"] < 2.75
            keep(robot, THERE, lambda: arrived(robot))
            angles = device.angles()
            for path in JOINTS:
                assert angles[path] == pytest.approx(robot.state[path], abs=0.01)
                if path.startswith("right"):
                    assert angles[path] == pytest.approx(begin[path], abs=0.002)
            # Its second motor faces the first, and turns the other way.
            first, second = servo(device, 1), servo(device, 101)
            turned = first.position - JOINTS["left/shoulder"].counts(0.0)
            assert first.position + second.position == pytest.approx(0, abs=3)
            assert turned == pytest.approx(0.3 / table.POSITION, abs=2)
            assert robot.figures()["safe"] == ""
        # Without torque they would fall.
        assert all(one.memory[table.TORQUE] for one in device.servos)


def test_the_left_arm_alone_moves_by_its_own_servos(tmp_path: Path) -> None:
    device = ScalerServos(arms=("left",))
    with emulated(tmp_path, device) as emulator:
        left = combine(ScalerLeft, Arms)("b", options={"port": emulator.where})
        with alone.opened(left) as robot:
            assert len(device.servos) == 9
            keep(robot, THERE, lambda: arrived(robot))
            assert robot.figures()["safe"] == ""
        assert all(one.memory[table.TORQUE] for one in device.servos)
    assert device.status().startswith("left arm at 17 6 80 ")


def test_an_arm_whose_writer_is_silent_holds_and_the_other_goes_on(
    tmp_path: Path,
) -> None:
    """A real run: two writers, one driver, and what its device thread obeys."""
    with emulated(tmp_path, ScalerServos()) as emulator:
        parts = Path(__file__).parents[3] / "engine"
        lab = Experiment("two", dt=0.05, duration=5.0, pace=1, folder=parts)
        lab.record = False
        lab.input("left", "sharers.py:Left", host=HERE)
        lab.input("right", "sharers.py:Right", host=HERE)
        lab.robot(
            "arms",
            "scaler",
            "scaler",
            command=["input/left", "input/right"],
            options={"port": emulator.where},
        )
        lab.output("log", "csv", host=HERE)
        lab.run(tmp_path / "out", show=Told())
    with (tmp_path / "out" / "arms.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    left, right = (
        [float(row[f"state/{arm}/wrist/3 [rad]"]) for row in rows]
        for arm in ("left", "right")
    )
    assert left[-1] == pytest.approx(left[50], abs=0.01)  # it held, by 2.5 s
    assert 0.1 < left[-1] < 0.5
    assert right[-1] > right[50] + 0.4
    assert [rows[-1][f"command/{arm}/speed [ratio]"] for arm in ("left", "right")] == [
        "0.0",
        "0.05",
    ]


def test_they_hold_where_they_are_when_nobody_tells_them_anything(
    tmp_path: Path,
) -> None:
    device = ScalerServos()
    with emulated(tmp_path, device) as emulator, opened(Arms, emulator) as robot:
        slow = THERE | {"left/speed": 0.1}
        keep(robot, slow, lambda: robot.state["left/wrist/3"] > 0.2)
        until(lambda: robot.figures()["safe"])
        at = servo(device, 15).position

        def still() -> bool:
            before = servo(device, 15).position
            time.sleep(0.05)
            return servo(device, 15).position == before

        until(still)
        # Where it was when it was told to hold, some exchanges of 20 ms ago.
        assert abs(servo(device, 15).position - at) * table.POSITION < 0.6
        assert 0.2 < device.angles()["left/wrist/3"] < 2.0
        keep(robot, HOLD, lambda: robot.figures()["safe"] == "")
        keep_for(robot, HOLD, 0.2)
        assert still()


def test_turns_of_before_are_not_turned_back(tmp_path: Path) -> None:
    """A servo that was turned by hand, and has kept its power, counts several turns."""
    device = ScalerServos()
    servo(device, 15).position += 2 * table.TURN
    servo(device, 101).position -= table.TURN
    before = {one.number: one.position for one in device.servos}
    with emulated(tmp_path, device) as emulator, opened(Arms, emulator) as robot:
        keep_for(robot, HOLD, 0.1)
        robot.sense()
        assert robot.state["left/wrist/3"] == pytest.approx(0, abs=0.002)
        keep(robot, THERE | {"left/speed": 1}, lambda: arrived(robot))
        for number in (15, 101):
            moved = servo(device, number).position - before[number]
            assert abs(moved) < table.TURN / 2 + 3


def test_a_joint_that_stands_past_its_range(tmp_path: Path) -> None:
    """It goes the short way back, and not once round."""
    device = ScalerServos()
    bottom = servo(device, 3), servo(device, 103)
    over = (3.2 - pi / 2) / table.POSITION
    bottom[0].position += over
    bottom[1].position -= over
    before = bottom[0].position
    with emulated(tmp_path, device) as emulator, opened(Arms, emulator) as robot:
        keep_for(robot, HOLD, 0.1)
        robot.sense()
        assert robot.state["left/bottom"] == pytest.approx(3.2, abs=0.002)
        keep(robot, THERE, lambda: arrived(robot))
        moved = (bottom[0].position - before) * table.POSITION
        assert moved == pytest.approx(1.4 - 3.2, abs=0.01)


def test_unplugged_they_hold(tmp_path: Path) -> None:
    device = ScalerServos()
    with emulated(tmp_path, device) as emulator, opened(Arms, emulator) as robot:
        slow = THERE | {"left/speed": 0.1}
        keep(robot, slow, lambda: robot.state["left/wrist/3"] > 0.2)
        for one in device.servos:
            one.told.clear()
        emulator.order("unplug 1")
        until(lambda: device.servos[0].memory[table.WATCHDOG] < 0)
        held = {one.number: one.position for one in device.servos}
        until(lambda: robot.figures()["reconnects"] > 0)
        assert all(one.memory[table.TORQUE] for one in device.servos)
        for one in device.servos:
            assert one.told[table.TORQUE] == {1}, "they had torque all the time"
        for one in device.servos:
            # One exchange's worth, until its watchdog is let go and it is told.
            moved = abs(one.position - held[one.number]) * table.POSITION
            assert moved < 0.2, one.number
        keep(robot, slow, lambda: robot.state["left/wrist/3"] > 0.6)


def test_who_is_silent_is_named(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """And not one of those that are asked after it."""
    device = ScalerServos()
    with emulated(tmp_path, device) as emulator, opened(Arms, emulator) as robot:
        robot.silence = 0.3
        emulator.order("cut 13")
        keep(robot, HOLD, lambda: not robot.figures()["connected"])
    said = capfd.readouterr().err
    assert "the last: servo 13 (left/wrist/1) does not answer); it tries to re" in said


def test_5_percent_of_all_packets(tmp_path: Path) -> None:
    device = ScalerServos()
    with emulated(tmp_path, device) as emulator, opened(Arms, emulator) as robot:
        assert "restart 1|101|...|18" in emulator.words
        emulator.order("corrupt 0.05")
        emulator.order("corrupt 0.05 heard")
        keep(robot, THERE, lambda: emulator.said.done > 30)
        keep(robot, THERE, lambda: arrived(robot))
        figures = robot.figures()
        assert figures["reconnects"] < 2, "more than a very busy machine adds"
        assert figures["rejected"] < figures["cycles"] / 3
        assert robot.status.damaged > 20
        wrist = servo(device, 15).told[table.GOAL_POSITION]
        path = "left/wrist/3"
        ends = [JOINTS[path].counts(angle) for angle in (0.0, 3.0)]
        # Where many are damaged in a row, on a busy machine, it holds on its way.
        assert {*ends} <= wrist
        assert (min(wrist), max(wrist)) == (min(ends), max(ends))


def test_a_definition_without_arms() -> None:
    pytest.importorskip("dynamixel_sdk", reason="dynamixel-sdk is not installed")
    with pytest.raises(SchemaError, match='take the definition "scaler"'):
        combine(Dynabot, Arms)("b", options={"port": "x"}).prepare()
