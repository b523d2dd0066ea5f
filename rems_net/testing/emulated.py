"""Emulated: the devices of robots that are really driven, beside the robot here."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from rems_net.emulators import known
from rems_net.testing.subject import Subject


def is_emulated(definition: str, driver: str) -> bool:
    """Whether there is an emulator of that robot, as this driver drives it.

    Both are called as the robot is, with what tells several apart behind a `-`.
    """
    return driver in known.KNOWN and driver.partition("-")[0] == definition


@contextmanager
def emulated(subject: Subject, driver: str) -> Iterator[Subject]:
    """The robot, told where its emulated device is, for as long as the block."""
    serial = "port" in subject.driver.options.schema.paths
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "device") if serial else "0"
        with known.emulated(driver, path) as device:
            told = {"port" if serial else "url": device.where}
            yield replace(subject, options={**subject.options, **told})
