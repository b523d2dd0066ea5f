"""What can be emulated, by name, for `rems emulate`."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

#: name -> what makes it, given where: text, so that only what is asked for is imported
KNOWN = {
    "create2": "rems_net.emulators.create2.device:create2",
    "woodbot-ws": "rems_net.emulators.woodbot_websocket:woodbot_websocket",
    "dynabot": "rems_net.emulators.dynamixel.robots:dynabot",
    "scaler": "rems_net.emulators.dynamixel.robots:scaler",
}


class Emulated(Protocol):
    """A device without hardware, that lives as long as its `with` lasts."""

    #: what ended it before its time
    failure: BaseException | None

    def __enter__(self) -> Self: ...
    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...
    @property
    def where(self) -> str:
        """What a driver takes for its port: a path, or an address."""

    @property
    def words(self) -> list[str]:
        """What it can be told, such as `unplug SECONDS`."""

    def tell(self, words: str) -> None:
        """Let something happen, such as `unplug 5`. Raises ExperimentError."""

    def status(self) -> str:
        """How it is, in a few words: what it obeys, and where it is."""


def emulated(name: str, port: str = "") -> Emulated:
    """Return the emulator of a device, not started yet.

    port: where it is to be; "" for a place of its own.
    """
    module, _, function = KNOWN[name].partition(":")
    make: Callable[[str], Any] = getattr(import_module(module), function)
    made: Emulated = make(port)
    return made


def path_for(name: str, port: str) -> Path:
    """Where the terminal of a serial device is, unless it is said."""
    return Path(port) if port else Path(tempfile.gettempdir()) / f"rems-{name}"
