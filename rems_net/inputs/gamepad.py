"""GamepadInput: a stick that is a real one, of a gamepad on this machine."""

import sys
from importlib.util import find_spec

from rems_net.agents.agent import Input
from rems_net.agents.ports import Out, Settings
from rems_net.agents.tick import Tick
from rems_net.defdict import integer, percent, text
from rems_net.errors import ExperimentError
from rems_net.events import warn
from rems_net.teleop.joystick import AXES, Joystick, find
from rems_net.teleop.sdl import SdlPad
from rems_net.teleop.stick import FULL, STICK


class GamepadInput(Input):
    """A gamepad that is connected to this machine.

    On Linux its file is read, elsewhere SDL: `pip install "rems-net[gamepad]"`. The
    left stick drives ahead and turns, the right one goes sideways. A gamepad that is
    pulled out is at rest. Its experiment needs a pace, such as 1.
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
    _is_told = False

    def open(self) -> None:
        """Open the gamepad. Raises ExperimentError without one."""
        super().open()
        self._joystick = _connected(str(self.options.device))

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
        if not joystick.here and not self._is_told:
            self._is_told = True
            text = f"the gamepad at {joystick.path} is gone: its stick is at rest"
            warn("gamepad", text, self.key, tick.n)
        self._check_axes(joystick)
        # Ahead, left and counter-clockwise are negative on all gamepads.
        return {name: self._percent(joystick, name) for name in STICK.paths}

    def _check_axes(self, joystick: Joystick | SdlPad) -> None:
        known = joystick.known
        for name in STICK.paths:
            if known and self.options[name] > max(known):
                raise ExperimentError(
                    f"{name} is axis {self.options[name]}, and the gamepad has the "
                    f"axes 0 to {max(known)}; write another number: {name} = 0 (R0408)"
                )

    def _percent(self, joystick: Joystick | SdlPad, name: str) -> float:
        """Return an axis without its dead zone, in percent."""
        value = -joystick.axes[int(self.options[name])]
        dead = float(self.options.dead_zone) / FULL
        beyond = max(0.0, abs(value) - dead) / (1.0 - dead)
        return FULL * beyond * (1.0 if value > 0 else -1.0)


def _connected(device: str) -> Joystick | SdlPad:
    """Return the gamepad: by its file on Linux, or by SDL if a number is given."""
    by_sdl = sys.platform != "linux" and find_spec("pygame") is not None
    if device.isdigit() or (by_sdl and not device):
        return SdlPad(device)
    return Joystick(find(device))
