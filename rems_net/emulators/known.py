"""Emulated devices by name, for `rems board emulate`."""

import tempfile
from importlib import import_module
from pathlib import Path
from typing import Any

from rems_net.emulators.emulator import Emulator
from rems_net.emulators.terminal import Terminal

#: Name -> class, as text, so that only the requested device is imported.
KNOWN = {
    "create2": "rems_net.emulators.create2.device:Create2Device",
    "woodbot-ws": "rems_net.emulators.woodbot_websocket:OriginalWoodbot",
    "dynabot": "rems_net.emulators.dynamixel.robots:DynabotServos",
    "scaler": "rems_net.emulators.dynamixel.robots:ScalerServos",
}


def emulated(name: str, port: str = "") -> Emulator[Any]:
    """Return the emulator of a device, not started yet.

    port: path or address of the device; "" chooses one.
    """
    where, _, cls = KNOWN[name].partition(":")
    module: Any = import_module(where)
    device = getattr(module, cls)()
    if name == "woodbot-ws":
        return Emulator(device, module.listening(port))
    path = Path(port) if port else Path(tempfile.gettempdir()) / f"rems-{name}"
    return Emulator(device, Terminal(path))
