"""Emulated: the devices of robots that are really driven, beside the robot here."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from rems_net.emulators import known
from rems_net.testing.subject import Subject

#: driver -> the definition that its emulator moves by; each driver is its name, too
MOVES = {
    "create2": "create2",
    "woodbot-websocket": "woodbot",
    "dynabot": "dynabot",
    "scaler": "scaler",
}


def is_emulated(definition: str, driver: str) -> bool:
    """Whether there is an emulator of that robot, as this driver drives it."""
    return driver in known.KNOWN and MOVES.get(driver) == definition


@contextmanager
def emulated(subject: Subject, driver: str) -> Iterator[Subject]:
    """The robot, told where its emulated device is, for as long as the block."""
    serial = "port" in subject.driver.options.schema.paths
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "device") if serial else "0"
        with known.emulated(driver, path) as device:
            told = {"port" if serial else "url": device.where}
            yield replace(subject, options={**subject.options, **told})
