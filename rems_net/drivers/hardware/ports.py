"""Ports: which serial ports there are, and why one of them can't be opened."""

from __future__ import annotations

import errno
import sys
from pathlib import Path
from typing import Any, NamedTuple

from rems_net.drivers.needs import load


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
        return f"There are: {each}. What answers there, says: rems ports"
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
