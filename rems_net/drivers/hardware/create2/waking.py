"""Waking: the first exchange with a Create 2, before it can be driven."""

from threading import Event

from rems_net.agents.wall import wall
from rems_net.drivers.hardware.create2 import packets
from rems_net.drivers.hardware.create2.commands import BAUDS, FLUSH, Op
from rems_net.drivers.hardware.create2.packets import CAPACITY, MODES, VOLTAGE
from rems_net.drivers.hardware.create2.stream import Stream
from rems_net.drivers.hardware.driven import NoDeviceError
from rems_net.drivers.hardware.ports import Line

#: s between two commands that change the mode, as the specification demands
SETTLE = 0.02
#: s. The robot receives and obeys two bytes at 300 bits per second within this.
CALL = 0.1
#: s. The first frame of a stream comes within this.
FIRST = 0.2
#: bits per second; the second, if Clean was held while the robot was switched on
USUAL = (115_200, 19_200)
#: the group of all packets
ALL = 100


def is_awake(line: Line) -> bool:
    """Return whether it answers before START: if so, it has not lost its power."""
    line.write(FLUSH + bytes([Op.PAUSE, 0]))
    Event().wait(SETTLE)
    return 1 <= reported_mode(line) <= len(MODES)


def reported_mode(line: Line) -> int:
    """Return the number of the mode that it reports; 0 if it does not answer."""
    line.read(line.in_waiting)
    line.write(bytes([Op.SENSORS, 35]))
    until, reply = wall() + FIRST, b""
    while not reply and wall() < until:
        reply = line.read(1)
    return int.from_bytes(reply)


def begin(line: Line, mode: str) -> int:
    """Start its interface in this mode, "safe" or "full".

    Returns by how much the modes that it reports are too high: 0, or 1 of some Roombas
    (libcreate, issue 67). START always leads to Passive; one may be lost, not two.
    """
    passive, too_high = MODES.index("passive"), 0
    for _ in range(2):
        line.write(bytes([Op.START]))
        Event().wait(SETTLE)
        too_high = int(reported_mode(line) == passive + 1)
        if not too_high:
            break
    line.write(bytes([Op[mode.upper()]]))
    Event().wait(SETTLE)
    return too_high


def all_sensors(line: Line) -> dict[str, int]:
    """Return all its packets' values; {} if they cannot be a Create 2's."""
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
    """Bring a robot that listens at `deaf` bits per second to the line's speed.

    A wrong bit can turn DRIVE_DIRECT into the command BAUD, with 300 or 600 bits per
    second by the next byte. At any other speed, these bytes mean nothing.
    """
    own = line.baudrate
    if own in BAUDS:
        line.baudrate = deaf
        line.write(bytes([Op.BAUD, BAUDS.index(own)]))
        Event().wait(CALL)
        line.baudrate = own


def hear_first(line: Line, stream: Stream, port: str, closely: bool) -> None:
    """Wait for its first frame. Raises NoDeviceError that describes what came instead.

    closely: take a few tenths of a second to find the cause.
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
            f"{other}. Set options = {{ baud = {other} }}."
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
    """Return another speed at which a Create 2 answers, and leave the line at that."""
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
