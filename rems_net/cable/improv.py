"""Improv Serial: packets that set up Wi-Fi (https://www.improv-wifi.com/serial).

A packet: `IMPROV`, version 1, type, length, data, the sum of all that modulo 256.
"""

from collections.abc import Sequence
from enum import IntEnum

from rems_net.cable.splitter import HEAD, START
from rems_net.errors import WireError


class Kind(IntEnum):
    """Kinds of packets."""

    STATE = 1
    ERROR = 2
    RPC = 3
    RESULT = 4


class Command(IntEnum):
    """Commands for a robot."""

    WIFI = 1
    STATE = 2
    INFO = 3
    SCAN = 4
    NAME = 6


_ERRORS = {
    1: "the packet was damaged on its way",
    2: "this firmware does not know the command",
    3: "it could not join the network",
    5: "it does not take the name",
}


def error(number: int) -> str:
    """Return the meaning of an error code."""
    return _ERRORS.get(number, f"Improv's error {number}")


def packet(kind: Kind, data: bytes) -> bytes:
    """Return one packet, with a newline before and after it.

    Raises WireError for more than 255 bytes of data.
    """
    if len(data) > 255:
        raise WireError(f"a packet of Improv holds 255 bytes; got {len(data)} (R0621)")
    whole = START + bytes([kind, len(data)]) + data
    return b"\n" + whole + bytes([sum(whole) % 256]) + b"\n"


def command(which: Command, *texts: str) -> bytes:
    """Return the packet of a command; each text has its length before it."""
    coded = b"".join(bytes([len(t)]) + t for t in (x.encode() for x in texts))
    return packet(Kind.RPC, bytes([which, len(coded)]) + coded)


def read(whole: bytes) -> tuple[Kind, bytes]:
    """Return kind and data of a packet from a Splitter. Raises WireError."""
    if not whole.startswith(START) or len(whole) != HEAD + whole[HEAD - 1] + 1:
        raise WireError(f"expected a packet of Improv, got {whole!r} (R0621)")
    if sum(whole[:-1]) % 256 != whole[-1]:
        raise WireError("a packet of Improv has a wrong sum: it was damaged (R0621)")
    try:
        return Kind(whole[HEAD - 2]), whole[HEAD:-1]
    except ValueError:
        raise WireError(
            f"no packet of Improv is of type {whole[HEAD - 2]} (R0621)"
        ) from None


def texts(data: bytes) -> tuple[int, Sequence[str]]:
    """Return the command of a result, and its texts. Raises WireError."""
    if len(data) < 2 or data[1] != len(data) - 2:
        raise WireError("a result of Improv has a wrong length (R0621)")
    found, at = [], 2
    while at < len(data):
        end = at + 1 + data[at]
        if end > len(data):
            raise WireError("a text in a result of Improv goes past its end (R0621)")
        found.append(data[at + 1 : end].decode(errors="replace"))
        at = end
    return data[0], found
