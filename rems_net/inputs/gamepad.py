"""GamepadInput: a stick that is a real one, of a gamepad on this machine."""

import sys
from collections.abc import Callable, Sequence
from importlib.util import find_spec

from rems_net.agents.agent import Input
from rems_net.agents.ports import Out, Settings
from rems_net.agents.tick import Tick
from rems_net.defdict import integer, percent, text
from rems_net.errors import ExperimentError
from rems_net.events import warn
from rems_net.teleop.deadman import SILENT
from rems_net.teleop.joystick import AXES, Joystick, find
from rems_net.teleop.sdl import SdlPad
from rems_net.teleop.stick import FULL, STICK


class GamepadInput(Input):
    """A gamepad that is connected to this machine.

    On Linux its file is read, elsewhere SDL: `pip install "rems-net[gamepad]"`. The
    left stick drives ahead and turns, the right one goes sideways. A gamepad that is
    pulled out is at rest, and so is one that is pushed and sends nothing for 1 s: it
    may be out of range. It counts again after its stick was let go, as one does that is
    pushed at the start. Its experiment needs a pace, such as 1.
    """

    by_hand = True
    options = Settings(
        device=text(doc="/dev/input/js0, or 0 for SDL; the only one, if empty"),
        ahead=integer(default=1, range=(0, AXES - 1), doc="number of the axis"),
        left=integer(default=3, range=(0, AXES - 1), doc="number of the axis"),
        turn=integer(default=0, range=(0, AXES - 1), doc="number of the axis"),
        dead_zone=percent(
            default=15.0,
            range=(0, 90),
            doc="nearer to the middle is at rest",
        ),
    )
    value = Out(STICK)
    _joystick: Joystick | SdlPad | None = None
    #: the newest sentence about the gamepad; "" while it drives
    _told = ""

    def open(self) -> None:
        """Open the gamepad. Raises ExperimentError without one."""
        super().open()
        self._joystick = _connected(str(self.options.device), self._is_deflected)

    def close(self) -> None:
        """Close the gamepad."""
        joystick, self._joystick = self._joystick, None
        if joystick is not None:
            joystick.close()
        super().close()

    def read(self, tick: Tick) -> dict[str, float]:
        """Return what the sticks do now, in percent."""
        joystick = self._joystick
        if joystick is None:
            return dict.fromkeys(STICK.paths, 0.0)
        self._check_axes(joystick)
        drives = joystick.here and joystick.deadman.drives
        axes = joystick.axes if drives else [0.0] * AXES
        why = "" if drives else self._why(joystick)
        if why not in ("", self._told):
            text = f"the gamepad at {joystick.path} {why}"
            warn("gamepad", text, self.key, tick.n)
        self._told = why
        return {name: self._percent(axes, name) for name in STICK.paths}

    def _why(self, joystick: Joystick | SdlPad) -> str:
        """Return why its stick does not count, if a person has to know."""
        if not joystick.here:
            return "is gone: its stick is at rest"
        if joystick.deadman.silent:
            return (
                f"has sent nothing for {SILENT:g} s while its stick was pushed: it "
                "may be out of range, so its stick is at rest. Let the stick go once, "
                "and it drives again; one that is held at its end sends nothing, so "
                "move it a little"
            )
        if self._is_deflected(joystick.axes):
            return "is pushed at the start: let its stick go once, and it drives"
        return ""

    def _is_deflected(self, axes: Sequence[float]) -> bool:
        return any(self._percent(axes, name) for name in STICK.paths)

    def _check_axes(self, joystick: Joystick | SdlPad) -> None:
        known = joystick.known
        for name in STICK.paths:
            if known and self.options[name] > max(known):
                raise ExperimentError(
                    f"{name} is axis {self.options[name]}, and the gamepad has the "
                    f"axes 0 to {max(known)}; write another number: {name} = 0 (R0408)"
                )

    def _percent(self, axes: Sequence[float], name: str) -> float:
        """Return an axis without its dead zone, in percent."""
        # Ahead, left and counter-clockwise are negative on all gamepads.
        value = -axes[int(self.options[name])]
        dead = float(self.options.dead_zone) / FULL
        beyond = max(0.0, abs(value) - dead) / (1.0 - dead)
        return FULL * beyond if value > 0 else 0.0 - FULL * beyond


def _connected(
    device: str, deflected: Callable[[Sequence[float]], bool]
) -> Joystick | SdlPad:
    """Return the gamepad: by its file on Linux, or by SDL if a number is given."""
    by_sdl = sys.platform != "linux" and find_spec("pygame") is not None
    if device.isdigit() or (by_sdl and not device):
        return SdlPad(device, deflected)
    return Joystick(find(device), deflected)
