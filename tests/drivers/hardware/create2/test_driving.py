"""A Create 2's driver and an emulated one, on a real port: what it obeys and says."""

import re
from pathlib import Path
from typing import Any

import pytest

from rems_net import Definition, In, Out
from rems_net.agents.robot import combine
from rems_net.drivers.hardware.create2.open_interface import OpenInterface
from rems_net.emulators.create2.device import Create2Device
from rems_net.emulators.create2.interface import FULL, PASSIVE, SAFE
from rems_net.errors import FieldValueError, SchemaError
from rems_net.robots.create2 import Create2
from rems_net.robots.woodbot import Woodbot
from tests.agents.runs import until
from tests.drivers.hardware.create2.scene import (
    driven,
    emulated,
    keep,
    keep_for,
    opened,
    wheels,
)
from tests.drivers.hardware.refusal import refusal


def test_it_obeys_and_says_where_it_is(tmp_path: Path) -> None:
    with emulated(tmp_path) as emulator:
        body = emulator.device.body
        with opened(emulator) as robot:
            keep(robot, (200, 100), lambda: robot.state.heading < -0.2)
            assert robot.figures()["safe"] == ""
            keep(robot, (0, 0), lambda: wheels(emulator) == (0, 0))
            keep_for(robot, (0, 0), 0.1)
            state, true = robot.state, body.robot.state
            # Within some counts of its encoders, of 0.44 mm each.
            assert state.x == pytest.approx(true.x, abs=0.003)
            assert state.y == pytest.approx(true.y, abs=0.003)
            assert state.heading == pytest.approx(true.heading, abs=0.01)
            assert robot.sensors["encoder/left"] == state["wheel/left"] > 1
            assert robot.status.mode == "safe"
            assert robot.status["battery/voltage"] == pytest.approx(16.4, abs=0.1)
            assert 9_000 < robot.status["battery/charge"] < 9_706
        assert emulator.device.interface.mode == PASSIVE
        assert wheels(emulator) == (0, 0)
        assert {*driven(emulator)} == {(0, 0), (200, 100)}


@pytest.mark.parametrize("mode", ["safe", "full"])
@pytest.mark.parametrize("before", [PASSIVE, SAFE, FULL])
def test_a_roomba_that_reports_its_mode_plus_one(
    tmp_path: Path, mode: str, before: int, capfd: pytest.CaptureFixture[str]
) -> None:
    with emulated(tmp_path) as emulator:
        emulator.order("mode plus-one")
        emulator.device.interface.mode = before  # as an earlier run left it
        with opened(emulator, mode=mode) as robot:
            keep(robot, (200, 100), lambda: robot.state.heading < -0.2)
            assert robot.status.mode == mode
            emulator.order("lift")
            keep(robot, (200, 100), lambda: robot.status["wheel_drop/left"])
            emulator.order("lower")
            keep(robot, (200, 100), lambda: wheels(emulator) == (200, 100))
    said = capfd.readouterr().err
    assert "robot/b reports its mode plus one, as some Roombas do" in said


def test_such_a_roomba_at_its_charger(tmp_path: Path) -> None:
    with emulated(tmp_path) as emulator:
        emulator.order("mode plus-one")
        emulator.order("charger in")
        with opened(emulator) as robot:
            keep_for(robot, (200, 100), 0.3)
            assert wheels(emulator) == (0, 0)
            emulator.order("charger out")
            keep(robot, (200, 100), lambda: wheels(emulator) == (200, 100))


def test_a_robot_that_never_moves_is_named(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with emulated(tmp_path) as emulator:
        emulator.order("charger in")
        with opened(emulator) as robot:
            keep_for(robot, (200, 200), 1.5)
    said = capfd.readouterr().err
    assert "robot/b stands by itself: it is at its charger" in said
    assert re.search(r"robot/b was commanded to move for 1\.\d s, and its state", said)
    with emulated(tmp_path) as emulator, opened(emulator) as robot:
        keep_for(robot, (0, 0), 1.5)
    assert "was commanded to move" not in capfd.readouterr().err


@pytest.mark.parametrize(("battery", "per_frame"), [("impossible", 1), ("unknown", 2)])
def test_values_of_a_battery_that_cannot_be(
    tmp_path: Path, battery: str, per_frame: int
) -> None:
    with emulated(tmp_path) as emulator, opened(emulator) as robot:
        keep(robot, (0, 0), lambda: robot.status["battery/charge"] > 0)
        assert robot.status["battery/impossible"] == 0
        emulator.order(f"battery {battery}")
        keep(robot, (0, 0), lambda: robot.status["battery/impossible"] > 0)
        keep_for(robot, (0, 0), 0.1)
        assert robot.status["battery/impossible"] % per_frame == 0
        assert 9_000 < robot.status["battery/charge"] < 9_706
        assert 9_000 < robot.status["battery/capacity"] < 9_706
        assert robot.status["battery/voltage"] > 10


def test_its_sensors(tmp_path: Path) -> None:
    with emulated(tmp_path) as emulator, opened(emulator, mode="full") as robot:
        assert robot.status.mode == "off"  # before the first reading is taken in

        def sense() -> Any:
            robot.sense()
            return robot

        emulator.order("bump left")
        until(lambda: sense().sensors["bumper/left"])
        assert not robot.sensors["bumper/right"]
        emulator.order("cliff")
        until(lambda: sense().sensors["cliff/front_left"])
        assert robot.status["signal/cliff/right"] < 0.01
        emulator.order("press spot")
        until(lambda: sense().status["button/spot"])
        until(lambda: not sense().status["button/spot"])
        assert robot.status.mode == "full"


def test_it_beeps_and_shows(tmp_path: Path) -> None:
    with emulated(tmp_path) as emulator, opened(emulator) as robot:
        interface = emulator.device.interface
        robot.beep(60, 0.5)
        until(lambda: interface.plays > 0)
        assert list(interface.songs.values()) == [0.5]
        robot.display("Hi")
        until(lambda: interface.display == "Hi  ")
        with pytest.raises(FieldValueError, match=r"a note of MIDI, 31 to 127"):
            robot.beep(7)
        with pytest.raises(FieldValueError, match=r"plain ASCII"):
            robot.display("ä")


def test_reset_counts_from_where_it_is(tmp_path: Path) -> None:
    with emulated(tmp_path) as emulator, opened(emulator) as robot:
        robot.initial = {"x": 1.0}
        keep(robot, (200, 200), lambda: robot.state.x > 0.05)
        robot.reset()
        assert robot.state.x == 1.0
        keep(robot, (0, 0), lambda: robot.state["wheel/left"] < 1)
        assert robot.state.x == pytest.approx(1.0, abs=0.05)


# -- when it stops by itself -----------------------------------------------------


def test_lifted_and_put_down(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with emulated(tmp_path) as emulator, opened(emulator) as robot:
        keep(robot, (100, 100), lambda: wheels(emulator) == (100, 100))
        emulator.order("lift")
        keep(robot, (100, 100), lambda: robot.status["wheel_drop/left"])
        keep_for(robot, (100, 100), 0.3)
        assert wheels(emulator) == (0, 0)
        assert robot.status.mode == "passive"
        emulator.order("lower")
        keep(robot, (100, 100), lambda: wheels(emulator) == (100, 100))
    said = capfd.readouterr().err
    assert "robot/b stands by itself: a wheel hangs. Put it on the floor" in said
    assert "robot/b obeys its commands again" in said


def test_at_the_edge_of_a_table(tmp_path: Path) -> None:
    """It can be driven back, and does not creep over the edge."""
    with emulated(tmp_path) as emulator, opened(emulator) as robot:
        body = emulator.device.body
        keep(robot, (100, 100), lambda: wheels(emulator) == (100, 100))
        emulator.order("cliff")
        keep(robot, (100, 100), lambda: robot.status.mode == "passive")
        edge = body.robot.state.x
        keep_for(robot, (100, 100), 0.5)
        assert body.robot.state.x == edge
        keep(robot, (-100, -100), lambda: wheels(emulator) == (-100, -100))


# -- what keeps it from starting -------------------------------------------------


def refused(**options: Any) -> str:
    robot = combine(Create2, OpenInterface)("b", options=options)
    robot.prepare()
    return refusal(robot)


def test_another_device(tmp_path: Path) -> None:
    class Thermometer(Create2Device):
        def live(self, dt: float) -> list[bytes]:
            return [b"temp 21.5\n"]

    with emulated(tmp_path, Thermometer()) as emulator:
        said = refused(port=emulator.where)
        assert f"what answers at {emulator.where} is no Create 2 at 115200" in said
        assert " 21.5\\n" in said


def test_another_definition() -> None:
    options = {"port": "x"}
    with pytest.raises(
        SchemaError, match=r"robot/b has a wheel_radius of 0\.02 m, and"
    ):
        combine(Woodbot, OpenInterface)("b", options=options).prepare()
    # It has two wheels, and is where they have taken it.
    size = {"wheel_radius": 0.0355, "track": 0.24}
    combine(Woodbot, OpenInterface)("b", options=options, parameters=size).prepare()

    class Cart(Definition):
        parameters = Woodbot.parameters
        command = In(Woodbot.state)
        state = Out(Woodbot.state)

    with pytest.raises(SchemaError, match="Cart has no wheel/left, wheel/right: "):
        combine(Cart, OpenInterface)("b", options={"port": "x"}).prepare()
