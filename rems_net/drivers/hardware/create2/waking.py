"""Waking: what is said to a Create 2 before it can be driven, and heard of it first."""

from __future__ import annotations

from threading import Event
from typing import Protocol

from rems_net.agents.wall import wall
from rems_net.drivers.hardware.create2.commands import BAUDS, FLUSH, Op
from rems_net.drivers.hardware.create2.packets import MODES
from rems_net.drivers.hardware.create2.stream import Stream
from rems_net.drivers.hardware.driven import NoDeviceError

#: seconds between two commands that change the mode, as the specification asks
SETTLE = 0.02
#: seconds in which two bytes at 300 bits per second are heard and obeyed
CALL = 0.1
#: seconds until the first frame of a stream
FIRST = 0.2
#: bits per second, where Clean was held while it was switched on
AFTER_BUTTON = 19_200


class Line(Protocol):
    """What is used of a serial port."""

    baudrate: int

    @property
    def in_waiting(self) -> int: ...
    def read(self, size: int = 1, /) -> bytes: ...
    def write(self, portion: bytes, /) -> int | None: ...


def is_awake(line: Line) -> bool:
    """Whether it answers before it is started: it has kept its power, then."""
    line.write(FLUSH + bytes([Op.PAUSE, 0]))
    Event().wait(SETTLE)
    line.read(line.in_waiting)
    line.write(bytes([Op.SENSORS, 35]))
    Event().wait(2 * SETTLE)
    mode = int.from_bytes(line.read(line.in_waiting)[:1])
    return 1 <= mode < len(MODES)


def call_back(line: Line, deaf: int) -> None:
    """Tell one that listens at `deaf` bits per second to do so at the line's speed.

    A wrong bit makes of DRIVE_DIRECT what sets its speed: to 300 or 600, by the byte
    behind it. At any other speed this means nothing.
    """
    own = line.baudrate
    if own in BAUDS:
        line.baudrate = deaf
        line.write(bytes([Op.BAUD, BAUDS.index(own)]))
        Event().wait(CALL)
        line.baudrate = own


def hear_first(line: Line, stream: Stream, port: str) -> None:
    """Wait for its first frame. Raises NoDeviceError saying what came instead."""
    heard, until = b"", wall() + FIRST
    while wall() < until:
        portion = line.read(max(line.in_waiting, stream.missing))
        if stream.feed(portion):
            stream.damaged = 0
            return
        heard += portion
    baud = line.baudrate
    if heard:
        raise NoDeviceError(
            f"what answers at {port} is no Create 2 at {baud} bits per second: "
            f"{heard[:24]!r}. Check, in this order: is it another device? Type `rems "
            f"ports {port}`. Was the robot set to another speed, by its Clean button? "
            f"Say options baud = {AFTER_BUTTON}."
        )
    raise NoDeviceError(
        f"nothing answers at {port}. Check, in this order: is the robot charged, and "
        "on (press Clean once: its light)? Is the plug right in its socket, under the "
        f"lid? Is it that port? Type `rems ports`; {baud} bits per second is what it "
        "speaks unless it was told otherwise."
    )
