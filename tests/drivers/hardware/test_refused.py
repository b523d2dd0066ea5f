"""What a driver says instead of opening: what to check, and what to type."""

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.robot import combine
from rems_net.drivers.hardware.create2.open_interface import OpenInterface
from rems_net.drivers.hardware.driven import Driven
from rems_net.drivers.hardware.dynamixel import table
from rems_net.drivers.hardware.dynamixel.arms import Arms
from rems_net.drivers.hardware.dynamixel.wheels import Wheels
from rems_net.drivers.hardware.ports import Port, moved
from rems_net.emulators.create2.device import Create2Device
from rems_net.emulators.dynamixel.robots import DynabotServos, ScalerServos
from rems_net.emulators.dynamixel.servo import Servo
from rems_net.emulators.emulator import Emulator
from rems_net.emulators.terminal import Terminal
from rems_net.errors import ExperimentError, uncoded
from rems_net.robots.create2 import Create2
from rems_net.robots.dynabot import Dynabot
from rems_net.robots.scaler import Scaler
from rems_net.testing import check_robot
from tests.commands import finished
from tests.drivers.hardware.refusal import refusal

DEFINITIONS: dict[type[Driven], Any] = {
    OpenInterface: Create2,
    Wheels: Dynabot,
    Arms: Scaler,
}
#: two wheels that find the joints of two arms
JOINTS = (
    r"servo 2 \(wheel/left\) reports at 4000000 bits per second that it is XM430-W350 "
    r"\(model 1020\); expected XL430-W250\. Check, in this order: 1\. whether this is "
    r"another robot: there are the servos 1, 2, 3, 4, 5, 6 and 12 others, and 2, 1 are "
    r"needed; 2\. which servo has this ID, with DYNAMIXEL Wizard: IDs may have been "
    r'swapped; 3\. if your robot is made so, write options = { model = "XM430-W350" }\.'
)


@contextmanager
def emulated(folder: Path, device: Any) -> Iterator[Emulator[Any]]:
    pytest.importorskip("pty", reason="there are no pseudo-terminals here")
    pytest.importorskip("dynamixel_sdk", reason="dynamixel-sdk is not installed")
    with Emulator(device, Terminal(folder / "port")) as emulator:
        yield emulator


def refused(port: str, driver: type[Driven] = OpenInterface, **options: Any) -> str:
    """What it says instead of opening, with PORT for the port."""
    robot = combine(DEFINITIONS[driver], driver)("b", options={"port": port} | options)
    robot.prepare()
    said = refusal(robot).replace(port, "PORT")
    assert said.endswith(" (R0310)")
    return uncoded(said)


def where_it_is(emulator: Emulator[Any]) -> str:
    """And what it does; whatever the mode of its interface."""
    return emulator.status().removeprefix("off, ").removeprefix("passive, ")


def two_alike() -> DynabotServos:
    """Three servos, two of which have the same ID, and stand elsewhere."""
    device = DynabotServos()
    device.servos.append(Servo({table.ID: 2, table.BAUD: 3}, 100.0))
    return device


@pytest.mark.parametrize(
    ("device", "driver", "options", "says"),
    [
        pytest.param(
            lambda: Create2Device(boot=0),
            OpenInterface,
            {"baud": 57_600},
            "no Create 2 answers at PORT at 57600 bits per second, but one does at "
            r"115200\. Set options = { baud = 115200 }\.",
            id="another speed",
        ),
        pytest.param(
            lambda: Create2Device(boot=0),
            Wheels,
            {},
            r"no servo answers at PORT, .*2\. that this is the port of their adapter: "
            r"rems board ports PORT; 3\. .*",
            id="a Create 2, and not servos",
        ),
        pytest.param(
            DynabotServos,
            OpenInterface,
            {},
            r"nothing answers at PORT\. Check, in this order: 1\. is the robot charged"
            r".* 3\. Is it that port, and a Create 2 there\? Type: rems board "
            r"ports PORT",
            id="servos, and not a Create 2",
        ),
        pytest.param(
            ScalerServos,
            Wheels,
            {},
            JOINTS,
            id="the servos of another robot",
        ),
        pytest.param(
            ScalerServos,
            Wheels,
            {"baud": 4_000_000},
            JOINTS,
            id="those, at their speed",
        ),
        pytest.param(
            lambda: DynabotServos(baud=4_000_000),
            Arms,
            {"baud": 1_000_000},
            r"no servo answers at PORT at 1000000 .* Or is it another robot\? There "
            r"are the servos 1, 2; 1, 101, 2, 102, 3, 103 and 12 others are needed\.",
            id="wheels, and not arms",
        ),
        pytest.param(
            two_alike,
            Wheels,
            {},
            r"what servo 2 \(wheel/left\) answers is damaged, though it did before\. "
            r"Check, in this order: 1\. that no two servos have the same ID: .*",
            id="two servos with one ID",
        ),
    ],
)
def test_what_is_there_is_another(
    tmp_path: Path, device: Any, driver: type[Driven], options: Any, says: str
) -> None:
    """And whatever it is, it does not move, and no servo is set."""
    with emulated(tmp_path, device()) as emulator:
        before = where_it_is(emulator)
        said = refused(emulator.where, driver, **options)
        assert re.fullmatch(says, said), said
        assert where_it_is(emulator) == before
        told = [servo.told for servo in getattr(emulator.device, "servos", ())]
        assert not any(table.OPERATING_MODE in one for one in told)


def test_unplugged_while_it_is_reached(tmp_path: Path) -> None:
    class Pulled(Create2Device):
        def hear(self, portion: bytes) -> list[bytes]:
            emulator.unplug(60)
            return []

    with emulated(tmp_path, Pulled()) as emulator:
        said = refused(emulator.where)
    assert said.startswith("the line at PORT broke off, as when a plug is pulled out: ")
    assert said.endswith(" 3. that its port is still there: rems board ports")


def test_a_port_in_use(tmp_path: Path) -> None:
    with emulated(tmp_path, Create2Device(boot=0)) as emulator:
        import serial

        with serial.Serial(emulator.where, exclusive=True):
            said = refused(emulator.where)
    assert said.startswith("another program uses PORT: a serial monitor, ")
    assert sys.platform == "win32" or said.endswith("type: lsof PORT")


def test_what_is_no_port(tmp_path: Path) -> None:
    pytest.importorskip("serial", reason="pyserial is not installed")
    said = refused(str(tmp_path / "ttyRobot"))
    assert said.startswith(
        "there is no port PORT. An emulator's? Start that first: rems board emulate "
        "WHAT --port PORT. There "
    )
    for name in ("/dev/ttyNONE", "COM399"):
        assert refused(name).startswith("there is no port PORT. There ")
    essay = tmp_path / "essay.txt"
    essay.touch()
    for path in (essay, tmp_path):
        assert re.match("PORT (is no serial port|can't be opened)", refused(str(path)))


def test_not_permitted() -> None:
    """As a user without rights, whoever runs the tests."""
    pty = pytest.importorskip("pty", reason="there are no pseudo-terminals here")
    ends = *pty.openpty(), *pty.openpty()
    mine, ours = (Path(os.ttyname(end)) for end in ends[1::2])
    mine.chmod(0)
    ours.chmod(0o060)
    group = ours.group()
    code = (
        "import grp, os, sys\n"
        "from tests.drivers.hardware.test_refused import refused\n"
        "refused('/dev/ttyNONE')\n"  # imports what it may not read later
        "os.geteuid() or (os.setgroups([]), os.setgid(65534), os.setuid(65534))\n"
        "for path in sys.argv[1:]: print(refused(path))"
    )
    done = finished([sys.executable, "-c", code, mine, ours])
    for end in ends:
        os.close(end)
    chmod = r"Only administrators may: ask who .* `sudo chmod a\+rw PORT`\."
    join = rf"It belongs to the group {group}: .* `sudo usermod .* log out, .*"
    second = chmod if group in ("root", "wheel") else join
    assert not done.returncode, done.stderr
    for line, says in zip(done.stdout.splitlines(), (chmod, second), strict=True):
        assert re.fullmatch(rf"you may not open PORT\. {says}", line), done


def test_whether_it_may_move_is_asked_first() -> None:
    with pytest.raises(ExperimentError, match=r"put it on a stand.* --moves"):
        check_robot(Create2, OpenInterface, options={"port": "x"})


def test_an_adapter_that_comes_back_under_another_name() -> None:
    """It is known by its serial number; another adapter is not taken for it."""
    mine, other = Port("COM7", "", True, "A5069RR4"), Port("COM4", "", True, "0001")
    assert moved("COM3", "A5069RR4", [other, mine]) == "COM7"
    assert moved("COM3", "A5069RR4", [other]) == "COM3"
    assert moved("COM4", "A5069RR4", [other, mine]) == "COM4"
    assert moved("COM3", "", [Port("COM5", "", True)]) == "COM3"
