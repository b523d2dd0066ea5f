"""The wire format of Zenoh 1.x, below its messages: numbers, bytes, and extensions.

Each function takes the bytes of a batch and the index of a part, and returns the index
of its end. Reading beyond the last byte raises IndexError.
"""

from collections.abc import Callable, Mapping

#: flag in a header: extensions follow
EXTENDED = 0x80
#: bits of an extension's header: its name, and the encoding in it
NAME, ENCODING, NUMBER, BYTES = 0x7F, 0x60, 0x20, 0x40

#: reader of an extension's content, if Zenoh reads it without the length in front of
#: it; None if Zenoh uses the length
Content = Callable[[bytes, int, int], int] | None


class GateError(Exception):
    """A message that is not let through; its text is the reason."""


def number(data: bytes, at: int) -> tuple[int, int]:
    """Return a number of 7 bits a byte, lowest first, and the index of its end."""
    byte = data[at]
    if byte < 0x80:
        return byte, at + 1
    value = byte & 0x7F
    for i in range(1, 8):
        byte = data[at + i]
        if byte < 0x80:
            return value | byte << 7 * i, at + i + 1
        value |= (byte & 0x7F) << 7 * i
    return value | data[at + 8] << 56, at + 9  # the ninth has eight bits


def block(data: bytes, at: int) -> int:
    """Skip bytes behind their count."""
    length, at = number(data, at)
    at += length
    if at > len(data):
        raise IndexError
    return at


def encoding(data: bytes, at: int) -> int:
    """Skip the encoding of a value: its id, and perhaps a schema."""
    value, at = number(data, at)
    return block(data, at) if value & 1 else at


def stamp(data: bytes, at: int, _: int = 0) -> int:
    """Skip a time and the id of its clock."""
    _, at = number(data, at)
    return block(data, at)


def source(data: bytes, at: int, _: int = 0) -> int:
    """Skip the id of a session, of something in it, and of a value."""
    _, at = number(data, responder(data, at))
    return at


def responder(data: bytes, at: int, _: int = 0) -> int:
    """Skip the id of a session, and of something in it."""
    _, at = number(data, at + 2 + (data[at] >> 4))
    return at


def extensions(data: bytes, at: int, header: int, known: Mapping[int, Content]) -> int:
    """Skip the extensions that the flag in a header announces.

    Raises GateError if one of them is not among those known. Zenoh reads the content of
    some extensions without regard to their length. So both must agree; otherwise this
    reader would continue at another index than the router.
    """
    while header & EXTENDED:
        header = data[at]
        name = header & NAME
        if name not in known:
            raise GateError(f"sent an extension 0x{name:02x} that is not known here")
        at += 1
        if name & ENCODING == NUMBER:
            _, at = number(data, at)
        elif name & ENCODING == BYTES:
            end = block(data, at)
            _, at = number(data, at)
            content = known[name]
            if content is not None and content(data, at, end) != end:
                raise GateError(f"sent an extension 0x{name:02x} of a wrong length")
            at = end
    return at
