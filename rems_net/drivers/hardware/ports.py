"""Ports: which serial ports there are, and why one of them can't be opened."""

import errno
import sys
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from rems_net.libraries import load

#: of a file's mode: its group may read and write
READ_WRITE = 0o060


class Line(Protocol):
    """A serial port that is open, with methods of pyserial's."""

    baudrate: int

    @property
    def in_waiting(self) -> int: ...
    def read(self, size: int = 1, /) -> bytes: ...
    def write(self, data: bytes, /) -> int | None: ...
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


def refusal(device: str, error: Exception) -> str:
    """Why a port could not be opened, and what to do, in sentences."""
    number = getattr(error, "errno", None)
    # pyserial leaves the number out on Windows, and where it could not lock.
    said = str(error)
    if number == errno.ENOENT or "FileNotFoundError" in said:
        return f"there is no port {device}. {_emulated(device)}{there_are()}"
    denied = number == errno.EACCES or "PermissionError" in said
    if denied and sys.platform != "win32":
        return f"you may not open {device}. {_permit(device)}"
    if denied or number in (errno.EBUSY, errno.EAGAIN) or "lock" in said:
        which = "" if sys.platform == "win32" else f" Which one, says: lsof {device}"
        return (
            f"another program uses {device}: a serial monitor, a page in a browser, "
            f"another `rems`. Close it, and try again.{which}"
        )
    if number in (errno.EISDIR, errno.ENOTTY) or f"({errno.ENOTTY}, " in said:
        return f"{device} is no serial port. {there_are()}"
    return f"{device} can't be opened as a serial port: {said}. {there_are()}"


def there_are() -> str:
    """Sentences: which ports there are, or what to look for."""
    found = ports()
    usb = [port.device for port in found if port.usb]
    each = ", ".join(usb or [port.device for port in found[:8]])
    which = f"{each}. What answers there, says: rems board ports."
    if usb:
        return f"There are: {which}"
    return (
        f"There is {'none of USB' if found else 'no serial port'} here. Is the cable "
        "one for data (some only charge)? Windows and macOS may need the driver of the "
        f"board's USB chip.{f' Of other kinds: {which}' if found else ''}"
    )


def _emulated(device: str) -> str:
    """How a port comes to a place where the system has none."""
    if device.upper().startswith(("/DEV/", "COM")):
        return ""
    return f"An emulator's? Start that first: rems board emulate WHAT --port {device}. "


def _permit(device: str) -> str:
    """How to be allowed to open it; on Linux, where ports have groups."""
    try:
        path = Path(device)
        group, mode = path.group(), path.stat().st_mode
    except (OSError, KeyError, NotImplementedError):
        group, mode = "dialout", READ_WRITE
    if mode & READ_WRITE != READ_WRITE or group in ("root", "wheel"):
        return (
            "Only administrators may: ask who runs this machine for "
            f"`sudo chmod a+rw {device}`."
        )
    return (
        f"It belongs to the group {group}: ask who runs this machine for "
        f"`sudo usermod -a -G {group} $USER`, log out, and in again: before "
        "that you are not in it."
    )
