"""Joystick: a gamepad as Linux reports it, in a thread of its own.

Source: the kernel's Documentation/input/joydev/joystick-api.rst. A record has 8 bytes:
time in ms, value from -32767 to 32767, type (1 button, 2 axis; 128 is added for the
values at the start), number.
"""

import os
import select
from collections.abc import Callable, Sequence
from pathlib import Path
from struct import Struct
from threading import Event, Thread

from rems_net.errors import ExperimentError, some
from rems_net.teleop.deadman import Deadman

_RECORD = Struct("<IhBB")
_AXIS, _AT_START = 2, 128
#: value of an axis at its end
_END = 32767.0
#: s. The thread looks so often whether it shall end.
_LOOK = 0.1
#: numbers of axes that are kept
AXES = 16
FOLDER = Path("/dev/input")


def find(device: str) -> Path:
    """Return the file of the gamepad; without a name, of the only one here.

    Raises ExperimentError if there is none, or more than one.
    """
    if device:
        if not Path(device).exists():
            raise ExperimentError(
                f"there is no gamepad at {device}; here {_here()}. Type: ls {FOLDER} "
                "(R0310)"
            )
        return Path(device)
    found = sorted(FOLDER.glob("js*"))
    if len(found) > 1:
        raise ExperimentError(
            f"there are {len(found)} gamepads: {some(map(str, found))}; write which "
            f'one: device = "{found[0]}" (R0310)'
        )
    if not found:
        raise ExperimentError(
            f"there is no gamepad: nothing in {FOLDER} is named js0. Connect one, or "
            'drive by keys: type = "keyboard", and rems drive input/NAME. On Windows '
            'and macOS, type once: pip install "rems-net[gamepad]" (R0310)'
        )
    return found[0]


def _here() -> str:
    found = some(map(str, sorted(FOLDER.glob("js*"))))
    return f"is {found}" if found != "none" else "is none"


class Joystick:
    """The newest values of a gamepad's axes.

    axes: from -1 to 1, by number.  here: whether the gamepad is connected; else
    everything is at rest.  deadman: whether its stick counts.

    deflected: returns whether axes with these values drive.
    """

    def __init__(self, path: Path, deflected: Callable[[Sequence[float]], bool] = any):
        self.path = path
        self.deadman, self._deflected = Deadman(), deflected
        self.axes = [0.0] * AXES
        #: numbers of the axes that the gamepad has
        self.known: set[int] = set()
        self.here = True
        self._ending = Event()
        try:
            self._file = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
        except OSError as error:
            raise ExperimentError(
                f"the gamepad at {path} cannot be read: {error.strerror}. On Linux, "
                "type once: sudo usermod -aG input $USER, and log in again. (R0310)"
            ) from None
        self._thread = Thread(target=self._run, name=f"gamepad {path}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread, and close the file."""
        self._ending.set()
        self._thread.join()
        os.close(self._file)

    def _run(self) -> None:
        rest = b""
        while self.here and not self._ending.is_set():
            if not select.select([self._file], [], [], _LOOK)[0]:
                continue
            try:
                piece = os.read(self._file, 64 * _RECORD.size)
            except BlockingIOError:
                continue
            except OSError:  # it was pulled out
                piece = b""
            if not piece:
                self._leave()
            rest += piece
            whole = len(rest) - len(rest) % _RECORD.size
            for record in _RECORD.iter_unpack(rest[:whole]):
                self._take(*record)
            rest = rest[whole:]

    def _leave(self) -> None:
        """Put everything at rest: a gamepad that is gone holds no stick."""
        self.here = False
        self.axes = [0.0] * AXES

    def _take(self, _: int, value: int, kind: int, number: int) -> None:
        if kind & ~_AT_START == _AXIS and number < AXES:
            self.known.add(number)
            self.axes[number] = max(-1.0, value / _END)
        deflected = self._deflected(self.axes)
        if kind & _AT_START and deflected:
            self.deadman = Deadman()  # it was pushed before: it has to rest once
        self.deadman.sign(deflected)
