"""A gamepad by the kernel's records, which a FIFO gives as its device does."""

import os
import struct
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rems_net import Experiment
from rems_net.agents.wall import wall
from rems_net.errors import AgentError, ExperimentError
from rems_net.events import Event, listening
from rems_net.teleop import joystick
from rems_net.teleop.deadman import SILENT
from tests.inputs.stepping import moves

if sys.platform == "win32":
    pytest.skip("Windows has no files like Linux's gamepads", allow_module_level=True)

#: The first records of a pad with 8 axes, by the kernel's documentation: its values at
#: the start have 128 added to their type.
START = b"".join(struct.pack("<IhBB", 1000, 0, 0x82, n) for n in range(8))


def axis(number: int, value: int) -> bytes:
    return struct.pack("<IhBB", 2000, value, 2, number)


@pytest.fixture
def pad(tmp_path: Path) -> Iterator[tuple[Path, int]]:
    """A device's path, and the end at which the kernel writes."""
    path = tmp_path / "js0"
    os.mkfifo(path)
    end = os.open(path, os.O_RDWR)
    os.write(end, START)
    yield path, end
    os.close(end)


def lab(path: Path, **settings: object) -> Experiment:
    made = Experiment("lab", duration="60 s")
    made.input("pad", "gamepad", options={"device": str(path), **settings})
    made.robot("wood", "woodbot", "kinematic", command="input/pad")
    return made


def test_the_stick_drives(pad: tuple[Path, int]) -> None:
    path, end = pad
    with lab(path).engine() as engine:
        stick = engine["input/pad"]
        engine.step(1)
        assert stick.value == stick.value.schema()
        os.write(end, axis(1, -32767)[:3])  # a record in two pieces
        os.write(end, axis(1, -32767)[3:])
        moves(engine, lambda: stick.value["ahead"] == 100)
        os.write(end, axis(1, 0) + axis(0, 32767))
        moves(engine, lambda: stick.value["turn"] == -100)
        assert stick.value["ahead"] == 0
        wood = engine["robot/wood"]
        moves(engine, lambda: wood.state["heading"] < -0.1)
        os.write(end, axis(0, 3000))  # within the dead zone
        moves(engine, lambda: stick.value["turn"] == 0)


def test_a_pad_that_is_pulled_out_is_at_rest(tmp_path: Path) -> None:
    path = tmp_path / "js0"
    os.mkfifo(path)
    end = os.open(path, os.O_RDWR)
    events: list[Event] = []
    with listening(events.append), lab(path).engine() as engine:
        os.write(end, START)
        stick = engine["input/pad"]
        engine.step(1)
        os.write(end, axis(1, -32767))
        moves(engine, lambda: stick.value["ahead"] == 100)
        os.close(end)
        moves(engine, lambda: stick.value["ahead"] == 0)
        assert [e.text for e in events if e.kind == "gamepad"] == [
            f"the gamepad at {path} is gone: its stick is at rest"
        ]


def test_a_pad_that_goes_silent_is_at_rest(pad: tuple[Path, int]) -> None:
    """As a wireless one does that goes out of range; its stick must rest once then."""
    path, end = pad
    events: list[Event] = []
    with listening(events.append), lab(path).engine() as engine:
        stick = engine["input/pad"]
        engine.step(1)
        os.write(end, axis(1, -32767))
        moves(engine, lambda: stick.value["ahead"] == 100)
        begun = wall()

        def trembles() -> bool:
            os.write(end, axis(1, -32767))
            return wall() > begun + 1.5 * SILENT

        moves(engine, trembles)
        assert stick.value["ahead"] == 100
        moves(engine, lambda: stick.value["ahead"] == 0)
        (said,) = [e.text for e in events if e.kind == "gamepad"]
        assert said.startswith(f"the gamepad at {path} has sent nothing for 1 s while")
        os.write(end, axis(1, -30000))  # it is back, and still pushed
        moves(engine, lambda: engine["input/pad"]._joystick.axes[1] > -0.95)
        assert stick.value["ahead"] == 0
        os.write(end, axis(1, 0) + axis(1, -32767))
        moves(engine, lambda: stick.value["ahead"] == 100)


def test_a_stick_that_is_pushed_at_the_start(tmp_path: Path) -> None:
    path = tmp_path / "js0"
    os.mkfifo(path)
    end = os.open(path, os.O_RDWR)
    os.write(end, START + struct.pack("<IhBB", 1000, -32767, 0x82, 1))
    events: list[Event] = []
    with listening(events.append), lab(path).engine() as engine:
        moves(engine, lambda: [e for e in events if e.kind == "gamepad"])
        (said,) = [e.text for e in events if e.kind == "gamepad"]
        assert said == (
            f"the gamepad at {path} is pushed at the start: let its stick go once, and "
            "it drives"
        )
        stick = engine["input/pad"]
        os.write(end, axis(1, -32000))
        moves(engine, lambda: engine["input/pad"]._joystick.axes[1] > -0.99)
        assert stick.value["ahead"] == 0
        os.write(end, axis(1, 0) + axis(1, -32767))
        moves(engine, lambda: stick.value["ahead"] == 100)
    os.close(end)


def test_an_axis_that_it_does_not_have(pad: tuple[Path, int]) -> None:
    path, _ = pad
    with (
        pytest.raises(AgentError, match="ahead is axis 9, and the gamepad has"),
        lab(path, ahead=9).engine() as engine,
    ):
        moves(engine, lambda: False)


def test_none_and_two(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joystick, "FOLDER", tmp_path)
    with pytest.raises(ExperimentError, match="there is no gamepad: nothing in"):
        joystick.find("")
    with pytest.raises(ExperimentError, match="there is no gamepad at js7; here is no"):
        joystick.find("js7")
    for name in ("js0", "js1"):
        (tmp_path / name).touch()
    with pytest.raises(ExperimentError, match=r'there are 2 gamepads: .* device = "'):
        joystick.find("")
