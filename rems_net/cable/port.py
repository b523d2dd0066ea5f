"""Ports: which serial ports there are, and one of them opened."""

from __future__ import annotations

import errno
import sys
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from rems_net.drivers.needs import load
from rems_net.errors import FabricError

#: bits per second of the console; of one whose robot has the cable for a network
BAUDS = (115_200, 921_600)


class Line(Protocol):
    """What is used of a serial port."""

    baudrate: int
    timeout: float | None

    @property
    def in_waiting(self) -> int: ...
    def read(self, size: int = 1, /) -> bytes: ...
    def write(self, portion: bytes, /) -> int | None: ...
    def close(self) -> None: ...


class Port(NamedTuple):
    """A port that is there, and what the system knows of it."""

    device: str
    text: str
    usb: bool


def ports() -> list[Port]:
    """The serial ports of this machine, those of USB first."""
    load("serial", "hardware")
    found: Any = load("serial.tools.list_ports", "hardware").comports()
    each = [Port(p.device, p.description or "", p.vid is not None) for p in found]
    return sorted(each, key=lambda port: (not port.usb, port.device))


def open_port(device: str, baud: int = BAUDS[0]) -> Line:
    """Open a port for this program alone; a read waits for at most 50 ms.

    Raises FabricError saying why it can't be: not there, not permitted, in use.
    """
    library = load("serial", "hardware")
    line = library.Serial()
    line.port, line.baudrate = device, baud
    line.timeout, line.write_timeout = 0.05, 2.0
    # On most boards these two lines hold the chip in reset, or start its loader.
    line.dtr = line.rts = False
    line.exclusive = None if sys.platform == "win32" else True
    try:
        line.open()
    except (OSError, ValueError) as error:
        raise FabricError(_why(device, error)) from None
    except Exception as error:  # termios.error: gone while it was opened
        raise FabricError(_why(device, OSError(*error.args))) from None
    opened: Line = line
    return opened


def _why(device: str, error: Exception) -> str:
    number = getattr(error, "errno", None)
    # pyserial leaves the number out on Windows, and where it could not lock.
    said = str(error)
    if number == errno.ENOENT or "FileNotFoundError" in said:
        return f"there is no port {device}. {there_are()}"
    denied = number == errno.EACCES or "PermissionError" in said
    if denied and sys.platform != "win32":
        return f"you may not open {device}. {_permit(device)}"
    if denied or number in (errno.EBUSY, errno.EAGAIN) or "lock" in said:
        return (
            f"another program uses {device}: a serial monitor, a page in a browser, "
            "another `rems`. Close it, and try again."
        )
    return f"{device} can't be opened as a serial port: {said}. {there_are()}"


def there_are() -> str:
    """A sentence: which ports there are, or what to look for."""
    found = [port for port in ports() if port.usb] or ports()
    if found:
        each = ", ".join(port.device for port in found[:8])
        return f"There are: {each}. `rems provision` lists them."
    return (
        "There is no serial port here. Is the cable one for data (some only charge)? "
        "Windows and macOS may need the driver of the board's USB chip."
    )


def _permit(device: str) -> str:
    try:
        group = Path(device).group()
    except (OSError, KeyError, NotImplementedError):
        group = "dialout"
    return (
        f"It belongs to the group {group}: ask who runs this machine for "
        f"`sudo usermod -a -G {group} $USER`, log out, and in again."
    )
