"""SdlPad: a gamepad on Windows and macOS, read by SDL in a thread of its own.

The library is pygame-ce, of the extra `gamepad`. SDL knows which axis of a gamepad is
which, so the axes are in the order in which Linux numbers those of an Xbox pad.
"""

import os
from collections.abc import Callable, Sequence
from threading import Event, Thread
from typing import Any

from rems_net.errors import ExperimentError, some
from rems_net.libraries import load
from rems_net.teleop.deadman import Deadman
from rems_net.teleop.joystick import AXES

#: s. Between two looks at the gamepad; SDL has no call that waits without a window.
PERIOD = 0.01
#: s. SDL looks for gamepads this long; on macOS they are reported one by one.
SEARCH = 0.5
#: SDL's numbers of: left x and y, left trigger, right x and y, right trigger
ORDER = (0, 1, 4, 2, 3, 5)
#: buttons that SDL knows; one that is pressed or released is a sign of the gamepad, too
BUTTONS = 15
_END = 32767.0


class SdlPad:
    """The newest values of a gamepad's axes, as of `Joystick`.

    device: its number, "0" for the first one; "" for the only one.  Raises
    ExperimentError if there is none or several, or if SDL does not know its axes;
    MissingPartError without the library.
    """

    def __init__(
        self, device: str = "", deflected: Callable[[Sequence[float]], bool] = any
    ):
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        self._pygame = load("pygame", "gamepad")
        self._controller = load("pygame._sdl2.controller", "gamepad")
        self._device = device
        self.path = f"number {device or 0}"
        self.axes = [0.0] * AXES
        self.known = {*range(len(ORDER))}
        self.deadman, self._deflected = Deadman(), deflected
        #: the newest values of its axes and buttons
        self._newest: list[int] = []
        self.here = True
        self._ending, self._began = Event(), Event()
        self._error: ExperimentError | None = None
        self._thread = Thread(target=self._run, name="gamepad", daemon=True)
        self._thread.start()
        self._began.wait()
        if self._error is not None:
            self._thread.join()
            raise self._error

    def close(self) -> None:
        """End the thread, and close the gamepad."""
        self._ending.set()
        self._thread.join()

    def _run(self) -> None:
        """Read until the end. All calls of SDL are in this thread."""
        display = self._pygame.display
        shown = display.get_init()
        if not shown:  # SDL reads gamepads for programs with a display only
            os.environ["SDL_VIDEODRIVER"] = "dummy"
            os.environ["SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS"] = "1"
            display.init()
        self._controller.init()
        try:
            pad = self._open()
            self._began.set()
            while self.here and not self._ending.wait(PERIOD):
                self._read(pad)
            pad.quit()
        except ExperimentError as error:
            self._error = error
        finally:
            self._leave()
            self._controller.quit()
            if not shown:
                display.quit()
            self._began.set()

    def _open(self) -> Any:
        """Return the gamepad. Raises ExperimentError."""
        control, pump = self._controller, self._pygame.event.pump
        for _ in range(int(SEARCH / PERIOD)):
            pump()
            if control.get_count():
                break
            self._ending.wait(PERIOD)
        count = control.get_count()
        numbers = [str(i) for i in range(count)]
        if not count:
            raise ExperimentError(
                "there is no gamepad: SDL finds none here. Connect one, or drive by "
                'keys: type = "keyboard", and rems drive input/NAME. (R0310)'
            )
        if self._device not in (numbers if self._device or count > 1 else [""]):
            raise ExperimentError(
                f"there is no gamepad {self._device!r}; here are the numbers "
                f'{some(numbers)}. Write which one: device = "0" (R0310)'
            )
        number = int(self._device or 0)
        if not control.is_controller(number):
            raise ExperimentError(
                f"SDL does not know the axes of gamepad {number}. Connect another one, "
                'or drive by keys: type = "keyboard" (R0310)'
            )
        pad = control.Controller(number)
        self.path = f"number {number} ({pad.name})"
        return pad

    def _read(self, pad: Any) -> None:
        self._pygame.event.pump()
        if not pad.attached():
            self._leave()
            return
        values = [pad.get_axis(number) for number in ORDER]
        for i, value in enumerate(values):
            self.axes[i] = max(-1.0, value / _END)
        values += map(pad.get_button, range(BUTTONS))
        if values != self._newest:  # SDL has no times of reports
            self._newest = values
            self.deadman.sign(self._deflected(self.axes))

    def _leave(self) -> None:
        """Put everything at rest: a gamepad that is gone holds no stick."""
        self.here = False
        self.axes = [0.0] * AXES
