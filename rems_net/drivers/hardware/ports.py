"""Ports: the serial ports of this machine, and why one of them can't be opened."""

import errno
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from rems_net.libraries import load

#: bits of a file's mode: its group may read and write
READ_WRITE = 0o060


class Line(Protocol):
    """An open serial port, with the methods of pyserial."""

    baudrate: int

    @property
    def in_waiting(self) -> int: ...
    def read(self, size: int = 1, /) -> bytes: ...
    def write(self, data: bytes, /) -> int | None: ...
    def close(self) -> None: ...


class Port(NamedTuple):
    """A port of this machine: its name, the system's description, whether by USB.

    serial: number of the USB adapter; "" if it has none
    """

    device: str
    text: str
    usb: bool
    serial: str = ""


def ports() -> list[Port]:
    """Return the serial ports of this machine, those of USB first."""
    load("serial", "hardware")
    found: Any = load("serial.tools.list_ports", "hardware").comports()
    each = [
        Port(p.device, p.description or "", p.vid is not None, p.serial_number or "")
        for p in found
    ]
    return sorted(each, key=lambda port: (not port.usb, port.device))


def moved(device: str, serial: str, found: Sequence[Port]) -> str:
    """Return the port at which a USB adapter is now: plugged in anew, it may differ.

    serial: number of the adapter that was at `device`; with "" that is returned.
    """
    if not serial or any(port.device == device for port in found):
        return device
    return next((port.device for port in found if port.serial == serial), device)


def refusal(device: str, error: Exception) -> str:
    """Return why a port could not be opened, and what to do, in sentences."""
    if not isinstance(error, OSError | ValueError):
        error = OSError(*error.args)  # termios.error: it disappeared meanwhile
    number = getattr(error, "errno", None)
    # pyserial gives no number on Windows, nor if it could not lock the port.
    said = str(error)
    if number == errno.ENOENT or "FileNotFoundError" in said:
        return f"there is no port {device}. {_emulated(device)}{there_are()}"
    wrong = number in (errno.EISDIR, errno.ENOTTY) or f"({errno.ENOTTY}, " in said
    denied = number == errno.EACCES or "PermissionError" in said
    # Windows denies the permission for a folder.
    if wrong or (denied and sys.platform == "win32" and Path(device).is_dir()):
        return f"{device} is no serial port. {there_are()}"
    if denied and sys.platform != "win32":
        return f"you may not open {device}. {_permit(device)}"
    if denied or number in (errno.EBUSY, errno.EAGAIN) or "lock" in said:
        which = "" if sys.platform == "win32" else f" To find it, type: lsof {device}"
        return (
            f"another program uses {device}: a serial monitor, a page in a browser, "
            f"another `rems`. Close it, and try again.{which}"
        )
    return f"{device} can't be opened as a serial port: {said}. {there_are()}"


def there_are() -> str:
    """Return sentences: the ports there are, or what the user has to check."""
    found = ports()
    usb = [port.device for port in found if port.usb]
    each = ", ".join(usb or [port.device for port in found[:8]])
    which = f"{each}. To see what answers, type: rems board ports."
    if usb:
        return f"There are: {which}"
    return (
        f"There is {'none of USB' if found else 'no serial port'} here. Is the cable "
        "one for data (some only charge)? Windows and macOS may need the driver of the "
        f"board's USB chip.{f' Of other kinds: {which}' if found else ''}"
    )


def _emulated(device: str) -> str:
    """Return how to start an emulator for a name that is no system's port."""
    if device.upper().startswith(("/DEV/", "COM")):
        return ""
    return f"An emulator's? Start that first: rems board emulate WHAT --port {device}. "


def _permit(device: str) -> str:
    """Return how to get the right to open a port; on Linux, ports have groups."""
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
