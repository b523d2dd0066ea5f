"""A gamepad by SDL: a virtual one, which SDL itself has for such tests."""

import ctypes
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.errors import ExperimentError
from rems_net.events import Event, listening
from rems_net.teleop.sdl import SdlPad
from tests.agents.runs import until
from tests.inputs.stepping import moves

#: lists the libraries that this process has loaded
MAPS = Path("/proc/self/maps")
#: of SDL: subsystems of joysticks and gamepads, and the type of a virtual gamepad
SYSTEMS, GAMEPAD = 0x2200, 1
UP, LEFT = 1, 0


class Sdl:
    """The library that pygame has loaded, with a virtual gamepad."""

    def __init__(self) -> None:
        self.library = ctypes.CDLL(_loaded())
        self.library.SDL_JoystickFromInstanceID.restype = ctypes.c_void_p
        assert self.library.SDL_InitSubSystem(SYSTEMS) == 0

    def plug(self) -> None:
        assert self.library.SDL_JoystickAttachVirtual(GAMEPAD, 6, 15, 0) >= 0

    def pull(self) -> None:
        assert self.library.SDL_JoystickDetachVirtual(0) == 0

    def push(self, axis: int, value: float) -> None:
        number = self.library.SDL_JoystickGetDeviceInstanceID(0)
        pad = ctypes.c_void_p(self.library.SDL_JoystickFromInstanceID(number))
        end = ctypes.c_int16(int(32767 * value))
        assert self.library.SDL_JoystickSetVirtualAxis(pad, axis, end) == 0

    def close(self) -> None:
        while self.library.SDL_NumJoysticks() > 0:
            self.pull()
        if sys.platform == "win32":
            return  # a thread of Wine may still run a library that SDL would unload
        self.library.SDL_QuitSubSystem(SYSTEMS)


def _loaded() -> str:
    """Return the name of the SDL that pygame has loaded, or "" if we can't find it."""
    if sys.platform == "win32":
        return "SDL2.dll"
    lines = MAPS.read_text(encoding="utf-8").splitlines() if MAPS.exists() else []
    return next((line.split()[-1] for line in lines if "libSDL2-2" in line), "")


@pytest.fixture
def sdl(monkeypatch: pytest.MonkeyPatch) -> Iterator[Sdl]:
    monkeypatch.setenv("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    for name in ("SDL_VIDEODRIVER", "SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS"):
        monkeypatch.setenv(name, os.environ.get(name, ""))
    pytest.importorskip("pygame", reason="pygame-ce is not installed")
    if not _loaded():
        pytest.skip(
            f"SDL is not found on {sys.platform}, so it gets no virtual gamepad"
        )
    made = Sdl()
    try:
        yield made
    finally:
        made.close()


def lab(**settings: Any) -> Experiment:
    made = Experiment("lab", duration="60 s")
    made.input("pad", "gamepad", options={"device": "0", **settings})
    made.robot("wood", "woodbot", "kinematic", command="input/pad")
    return made


def test_the_stick_drives_until_it_is_pulled_out(sdl: Sdl) -> None:
    sdl.plug()
    events: list[Event] = []
    with listening(events.append), lab().engine() as engine:
        stick, wood = engine["input/pad"], engine["robot/wood"]
        engine.step(1)
        assert stick.value == stick.value.schema()
        moves(engine, lambda: stick._joystick.deadman.drives)
        sdl.push(UP, -1.0)
        moves(engine, lambda: stick.value["ahead"] == 100)
        sdl.push(UP, 0.0)
        sdl.push(LEFT, 1.0)
        moves(engine, lambda: stick.value["turn"] == -100)
        moves(engine, lambda: wood.state["heading"] < -0.1)
        sdl.pull()
        moves(engine, lambda: stick.value["turn"] == 0)
        (said,) = [one.text for one in events if one.kind == "gamepad"]
        assert said.startswith("the gamepad at number 0 (")
        assert said.endswith(") is gone: its stick is at rest")


def test_a_pad_that_goes_silent_is_at_rest(sdl: Sdl) -> None:
    sdl.plug()
    events: list[Event] = []
    with listening(events.append), lab().engine() as engine:
        stick = engine["input/pad"]
        moves(engine, lambda: engine["input/pad"]._joystick.deadman.drives)
        sdl.push(UP, -1.0)
        moves(engine, lambda: stick.value["ahead"] == 100)
        moves(engine, lambda: stick.value["ahead"] == 0)
        (said,) = [one.text for one in events if one.kind == "gamepad"]
        assert "has sent nothing for 1 s while its stick was pushed" in said
        sdl.push(UP, -0.9)  # it is back, and still pushed
        moves(engine, lambda: engine["input/pad"]._joystick.axes[1] > -0.95)
        assert stick.value["ahead"] == 0
        sdl.push(UP, 0.0)
        moves(engine, lambda: engine["input/pad"]._joystick.deadman.drives)
        sdl.push(UP, -1.0)
        moves(engine, lambda: stick.value["ahead"] == 100)


def test_none_and_two(sdl: Sdl) -> None:
    with pytest.raises(ExperimentError, match="there is no gamepad: SDL finds none"):
        SdlPad()
    sdl.plug()
    pad = SdlPad()
    until(lambda: pad.here)
    pad.close()
    with pytest.raises(
        ExperimentError, match="there is no gamepad '7'; here are the n"
    ):
        SdlPad("7")
    sdl.plug()
    with pytest.raises(
        ExperimentError, match=r"the numbers 0, 1\. Write which one: dev"
    ):
        SdlPad()
