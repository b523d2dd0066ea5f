"""Terminal: a serial port whose other end is in this program. Linux and macOS only."""

import os
import select
import sys
import time
from contextlib import suppress
from pathlib import Path

from rems_net.errors import FabricError

if sys.platform != "win32":
    import pty
    import termios
    import tty

    #: Bits per second, by the system's numbers for them.
    SPEEDS = {
        getattr(termios, name): int(name[1:])
        for name in dir(termios)
        if name[0] == "B" and name[1:].isdecimal()
    }


class Terminal:
    """A pseudo-terminal at a path that stays the same when it is unplugged.

    A program opens `path` as it would /dev/ttyUSB0. Raises FabricError if the system
    has no pseudo-terminals, or if something else is at that path.
    """

    def __init__(self, path: Path):
        self.path = path
        #: Path that a program opens.
        self.where = str(path)
        self._master = self._slave = -1
        if sys.platform == "win32":
            raise FabricError(
                "Windows has no pseudo-terminals, which emulated serial devices need. "
                "Type it in WSL (wsl --install), and run rems there, too. (R0715)"
            )
        if path.exists():  # a dangling link is of a program that was killed
            raise FabricError(
                f"there is something at {path} already, maybe another emulator. Give "
                "another path with --port, or remove it. (R0715)"
            )
        try:
            self.plug()
        except OSError as error:
            with suppress(OSError):
                self.unplug()
            raise FabricError(
                f"no port can be put at {path}: {error.strerror}. Give another path "
                "with --port, such as ./ttyRobot. (R0715)"
            ) from error

    @property
    def plugged(self) -> bool:
        """Whether a program can open it now."""
        return self._master >= 0

    @property
    def baud(self) -> int | None:
        """Bits per second that the program at the other end has set, or None."""
        if not self.plugged:
            return None
        return SPEEDS.get(termios.tcgetattr(self._slave)[5])

    def plug(self) -> None:
        """Make a new terminal, at the same path."""
        if self.plugged:
            return
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path.unlink(missing_ok=True)
        self.path.symlink_to(os.ttyname(self._slave))

    def unplug(self) -> None:
        """Remove the terminal: a program that has it open gets errors."""
        if not self.plugged:
            return
        os.close(self._master)
        os.close(self._slave)
        self._master = self._slave = -1
        self.path.unlink(missing_ok=True)

    def receive(self, seconds: float) -> bytes:
        """Return what came, after at most so many seconds; b"" if nothing did."""
        if not self.plugged:
            time.sleep(seconds)
        elif select.select([self._master], [], [], seconds)[0]:
            with suppress(OSError):  # macOS, if no program has it open
                return os.read(self._master, 4096)
        return b""

    def send(self, portion: bytes) -> None:
        """Put it on the line. Bytes that no program reads are lost."""
        if self.plugged:
            with suppress(OSError):  # full
                os.write(self._master, portion)

    def close(self) -> None:
        """Close it, and remove its path."""
        self.unplug()
