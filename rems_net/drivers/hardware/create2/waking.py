"""Waking: what is said to a Create 2 before it can be driven, and heard of it first."""

from threading import Event

from rems_net.agents.wall import wall
from rems_net.drivers.hardware.create2 import packets
from rems_net.drivers.hardware.create2.commands import BAUDS, FLUSH, Op
from rems_net.drivers.hardware.create2.packets import MODES
from rems_net.drivers.hardware.create2.stream import Stream
from rems_net.drivers.hardware.driven import NoDeviceError
from rems_net.drivers.hardware.ports import Line

#: seconds between two commands that change the mode, as the specification asks
SETTLE = 0.02
#: seconds in which two bytes at 300 bits per second are heard and obeyed
CALL = 0.1
#: seconds until the first frame of a stream
FIRST = 0.2
#: bits per second; the slower, where Clean was held while it was switched on
USUAL = (115_200, 19_200)
#: the group of all packets
ALL = 100
#: of what a Create 2 says, what can be: mV of its battery, mAh of a full one
VOLTAGE, CAPACITY = range(5_000, 25_000), range(500, 10_000)


def is_awake(line: Line) -> bool:
    """Whether it answers before it is started: it has kept its power, then."""
    line.write(FLUSH + bytes([Op.PAUSE, 0]))
    Event().wait(SETTLE)
    line.read(line.in_waiting)
    line.write(bytes([Op.SENSORS, 35]))
    Event().wait(2 * SETTLE)
    mode = int.from_bytes(line.read(line.in_waiting)[:1])
    return 1 <= mode < len(MODES)


def all_sensors(line: Line) -> dict[str, int]:
    """Its packets; none of them where they can't be a Create 2's."""
    line.write(bytes([Op.SENSORS, ALL]))
    size = packets.form(ALL).size
    reply = line.read(size)
    reply += line.read(size - len(reply))  # at 19,200 it takes longer than one read may
    values = packets.unpack(ALL, reply) if len(reply) == size else {}
    fits = values and (
        0 < values["mode"] < len(MODES)
        and values["voltage"] in VOLTAGE
        and values["capacity"] in CAPACITY
        and values["bumps_and_wheel_drops"] < 16
    )
    return values if fits else {}


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


def hear_first(line: Line, stream: Stream, port: str, closely: bool) -> None:
    """Wait for its first frame. Raises NoDeviceError saying what came instead.

    closely: take a few tenths of a second to find out what is wrong.
    """
    heard, until = b"", wall() + FIRST
    while wall() < until:
        portion = line.read(max(line.in_waiting, stream.missing))
        if stream.feed(portion):
            stream.damaged = 0
            return
        heard += portion
    baud = line.baudrate
    if closely and (other := _elsewhere(line)):
        raise NoDeviceError(
            f"no Create 2 answers at {port} at {baud} bits per second, but one does at "
            f"{other}. Say options = {{ baud = {other} }}."
        )
    if heard:
        raise NoDeviceError(
            f"what answers at {port} is no Create 2 at {baud} bits per second: "
            f"{heard[:24]!r}. Check, in this order: 1. is it another device? Type: "
            f"rems board ports {port}; 2. is the line disturbed? A long cable, a bad "
            "plug."
        )
    raise NoDeviceError(
        f"nothing answers at {port}. Check, in this order: 1. is the robot charged, "
        "and on (press Clean once: its light)? 2. Is the plug right in its socket, "
        "under the lid? 3. Is it that port, and a Create 2 there? Type: rems board "
        f"ports {port}"
    )


def _elsewhere(line: Line) -> int | None:
    """At which other speed a Create 2 answers; that is kept."""
    own = line.baudrate
    for baud in USUAL:
        if baud != own:
            line.baudrate = baud
            line.write(FLUSH + bytes([Op.START]))
            Event().wait(SETTLE)
            if all_sensors(line):
                return baud
    line.baudrate = own
    return None
