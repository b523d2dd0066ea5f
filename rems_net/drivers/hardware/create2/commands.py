"""The commands of the Open Interface: opcodes, lengths, and those that we send.

Source: see `packets`. Speeds are whole mm/s, forward positive, at most 500.
"""

from collections.abc import Iterable, Sequence
from enum import IntEnum

#: mm/s. Highest speed of a wheel.
TOP_SPEED = 500
#: bits per second, by code of BAUD
BAUDS = (
    *(300, 600, 1200, 2400, 4800, 9600),
    *(14400, 19200, 28800, 38400, 57600, 115_200),
)
#: bytes that complete a command which lost some; no command begins with a zero
FLUSH = bytes(36)
#: of SONG and PLAY: slots, and units of time per second
SONGS, TEMPO = 5, 64


class Op(IntEnum):
    """Opcodes: the first byte of a command."""

    RESET = 7
    START = 128
    BAUD = 129
    CONTROL = 130
    SAFE = 131
    FULL = 132
    POWER = 133
    SPOT = 134
    CLEAN = 135
    MAX = 136
    DRIVE = 137
    MOTORS = 138
    LEDS = 139
    SONG = 140
    PLAY = 141
    SENSORS = 142
    DOCK = 143
    PWM_MOTORS = 144
    DRIVE_DIRECT = 145
    DRIVE_PWM = 146
    STREAM = 148
    QUERY = 149
    PAUSE = 150
    SCHEDULING_LEDS = 162
    DIGITS_RAW = 163
    DIGITS = 164
    BUTTONS = 165
    SCHEDULE = 167
    TIME = 168
    STOP = 173


#: bytes after the opcode; STREAM, QUERY and SONG contain their own lengths
LENGTHS = {
    **{Op.BAUD: 1, Op.DRIVE: 4, Op.MOTORS: 1, Op.LEDS: 3, Op.PLAY: 1, Op.SENSORS: 1},
    **{Op.PWM_MOTORS: 3, Op.DRIVE_DIRECT: 4, Op.DRIVE_PWM: 4, Op.PAUSE: 1},
    **{Op.SCHEDULING_LEDS: 2, Op.DIGITS_RAW: 4, Op.DIGITS: 4, Op.BUTTONS: 1},
    **{Op.SCHEDULE: 15, Op.TIME: 3},
}


def length(command: bytes) -> int:
    """Return the length of the command that begins with these bytes, as known so far.

    0 for an unknown opcode.
    """
    try:
        op = Op(command[0])
    except ValueError:
        return 0
    if op in (Op.STREAM, Op.QUERY):
        return 2 + (command[1] if len(command) > 1 else 0)
    if op is Op.SONG:
        return 3 + (2 * command[2] if len(command) > 2 else 0)
    return 1 + LENGTHS.get(op, 0)


def drive_direct(right: int, left: int) -> bytes:
    """Return the command for the wheels' speeds; the right one comes first."""
    speeds = (speed.to_bytes(2, "big", signed=True) for speed in (right, left))
    return bytes([Op.DRIVE_DIRECT]) + b"".join(speeds)


def stream(numbers: Sequence[int]) -> bytes:
    """Return the command to send these packets every 15 ms."""
    return bytes([Op.STREAM, len(numbers), *numbers])


def song(slot: int, notes: Iterable[tuple[int, int]]) -> bytes:
    """Return the command to store notes: MIDI numbers (31 to 127), and 1/64 s each."""
    each = list(notes)
    return bytes([Op.SONG, slot, len(each), *(one for note in each for one in note)])
