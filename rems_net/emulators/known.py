"""What can be emulated, by name, for `rems emulate`."""

from __future__ import annotations

import tempfile
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rems_net.emulators.emulator import Emulator

#: name -> what makes it, given where: text, so that only what is asked for is imported
KNOWN = {
    "create2": "rems_net.emulators.create2.device:create2",
    "woodbot-ws": "rems_net.emulators.woodbot_websocket:woodbot_websocket",
    "dynabot": "rems_net.emulators.dynamixel.robots:dynabot",
    "scaler": "rems_net.emulators.dynamixel.robots:scaler",
}


def emulated(name: str, port: str = "") -> Emulator[Any]:
    """Return the emulator of a device, not started yet.

    port: where it is to be; "" for a place of its own.
    """
    module, _, function = KNOWN[name].partition(":")
    made: Emulator[Any] = getattr(import_module(module), function)(port)
    return made


def path_for(name: str, port: str) -> Path:
    """Where the terminal of a serial device is, unless it is said."""
    return Path(port) if port else Path(tempfile.gettempdir()) / f"rems-{name}"
