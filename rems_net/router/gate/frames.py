"""What a client sends to a shared router, read message by message.

The wire of Zenoh 1.x: a batch holds transport messages; a frame holds network messages,
which have no length in front, so that each is read to its end. A key stands on the wire
as the id of a beginning and a suffix. Ids stand for keys without wildcards only (Zenoh
and zenoh-pico declare no others), so that a suffix alone says what shape a key has, and
nothing has to be remembered from one batch to the next: no message that the router
drops unseen can make the reader believe in another key than the router.

What cannot be read is refused: it might hold a key.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache

from rems_net.router.gate import shapes

#: messages of a batch. A batch has 64 KB, and a state of a robot some 40 bytes.
MESSAGES = 8192
#: frames of a batch. Zenoh writes one, or two when priorities follow each other.
FRAMES = 64

# Transport messages, and the network messages that a frame holds.
_CLOSE, _KEEP_ALIVE, _FRAME, _FRAGMENT = 0x03, 0x04, 0x05, 0x06
_INTEREST, _FINAL, _RESPONSE, _REQUEST, _PUSH, _DECLARE = range(0x19, 0x1F)
_KINDS, _EXTENDED = 0x1F, 0x80
# What they carry, and what is declared.
_PUT, _DEL, _QUERY, _REPLY, _ERR = range(1, 6)
_ID, _NO_ID = 0x00, 0x01
_WITH_KEY, _WITHOUT_KEY, _ALL_DECLARED = (0x02, 0x04, 0x06), (0x03, 0x05, 0x07), 0x1A

#: an extension's content: where it ends, if it says so itself
_Content = Callable[[bytes, int, int], int] | None


class Refused(Exception):
    """A message that is not let through; its text says why."""


class Reader:
    """Reader of one client's batches."""

    def __init__(self, *, marks: bool = True):
        """Store whether the client marks the first fragment of a message.

        It says so by its patch, 1 or more, when it joins; Zenoh does since 1.1. Without
        marks the first fragment is not known for certain, and none is let through.
        """
        self._marks = marks

    def feed(self, batch: bytes | memoryview) -> str | None:
        """Return why the router must not get this batch, or None."""
        data = bytes(batch)
        try:
            self._read(data)
        except Refused as refused:
            return str(refused)
        except (IndexError, UnicodeDecodeError):
            return "a message that is cut off, or has a key that is no text"
        return None

    def _read(self, data: bytes) -> None:
        at, size, framed = 0, len(data), False
        frames = messages = 0
        while at < size:
            header = data[at]
            kind = header & _KINDS
            if kind >= _INTEREST:
                messages += 1
                if not framed or messages > MESSAGES:
                    raise Refused(f"more than {MESSAGES} messages in a batch")
                at = _message(data, at)
                continue
            frames += 1
            if frames > FRAMES:
                raise Refused(f"more than {FRAMES} frames in a batch")
            framed = kind == _FRAME
            if framed:
                _, at = _number(data, at + 1)
                if header & _EXTENDED:
                    at = _extensions(data, at, _OF_FRAME)
            elif kind == _FRAGMENT:
                return self._fragment(data, at)
            elif header == _KEEP_ALIVE:
                at += 1
            elif kind == _CLOSE and header < _EXTENDED:
                at += 2
            else:
                raise Refused(f"a transport message 0x{header:02x} of an unknown kind")
        if at > size:
            raise IndexError

    def _fragment(self, data: bytes, at: int) -> None:
        """Read the key at the beginning of a message in fragments."""
        header = data[at]
        _, at = _number(data, at + 1)
        start = at
        if header & _EXTENDED:
            at = _extensions(data, at, _OF_FRAGMENT)
        if not self._marks:
            raise Refused("a message in fragments, from a Zenoh older than 1.1")
        if header & _EXTENDED and _MARK in _names(data, start):
            _start(data, at)


def _message(data: bytes, at: int) -> int:
    """Return where the network message at `at` ends."""
    kind = data[at] & _KINDS
    if kind == _DECLARE:
        return _declaration(data, at)
    if kind == _INTEREST:
        return _interest(data, at)
    if kind == _FINAL:
        _, end = _number(data, at + 1)
        return _extensions(data, end, _OF_MESSAGE) if data[at] & _EXTENDED else end
    extended = data[at] & _EXTENDED
    at = _start(data, at)
    if extended:
        at = _extensions(data, at, _OF_RESPONSE if kind == _RESPONSE else _OF_MESSAGE)
    if kind == _PUSH:
        return _value(data, at)
    return _query(data, at) if kind == _REQUEST else _answer(data, at)


def _start(data: bytes, at: int) -> int:
    """Read a message of a put, a question or an answer up to the end of its key."""
    header = data[at]
    kind = header & _KINDS
    at += 1
    if kind in (_REQUEST, _RESPONSE):
        _, at = _number(data, at)
    elif kind != _PUSH:
        raise Refused(f"a message 0x{header:02x} of an unknown kind")
    return _key(data, at, header & 0x20)


def _key(data: bytes, at: int, named: int) -> int:
    scope, at = _number(data, at)
    if not named:
        return at
    length, at = _number(data, at)
    end = at + length
    if length > shapes.LONGEST + 1:
        raise Refused(f"a key of {length} bytes")
    if end > len(data):
        raise IndexError
    if why := _fault(data[at:end], scope != 0):
        raise Refused(why)
    return end


@lru_cache(maxsize=4096)
def _fault(suffix: bytes, below: bool) -> str | None:
    """Return what is wrong with a suffix; below: it follows what an id stands for."""
    text = suffix.decode()
    key = text
    if below and text.startswith("/"):
        key = text[1:]
    elif below and text.startswith("*"):
        return f"the key expression {text!r} has a chunk that begins with an id"
    why = shapes.fault(key)
    return f"the key expression {text!r} {why}" if why else None


def _declaration(data: bytes, at: int) -> int:
    header = data[at]
    at += 1
    if header & 0x20:
        _, at = _number(data, at)
    if header & _EXTENDED:
        at = _extensions(data, at, _OF_MESSAGE)
    header = data[at]
    kind = header & _KINDS
    at += 1
    if kind == _ALL_DECLARED and header < _EXTENDED:
        return at
    _, at = _number(data, at)
    if kind in _WITH_KEY:
        at = _key(data, at, header & 0x20)
    elif kind == _ID:
        at = _meaning(data, at, header & 0x20)
    elif kind not in (*_WITHOUT_KEY, _NO_ID):
        raise Refused(f"a declaration 0x{header:02x} of an unknown kind")
    return _extensions(data, at, _OF_DECLARED) if header & _EXTENDED else at


def _meaning(data: bytes, at: int, named: int) -> int:
    """Read what an id is to stand for: a key of its own, without wildcards."""
    start = at
    scope, at = _number(data, at)
    at = _key(data, start, named)
    if scope or b"*" in data[start:at] or b"$" in data[start:at]:
        raise Refused("an id for a key expression with wildcards, or for one of an id")
    return at


def _interest(data: bytes, at: int) -> int:
    header = data[at]
    _, at = _number(data, at + 1)
    if header & 0x60:
        options = data[at]
        at += 1
        if options & 0x10:
            at = _key(data, at, options & 0x20)
    return _extensions(data, at, _OF_MESSAGE) if header & _EXTENDED else at


def _value(data: bytes, at: int) -> int:
    header = data[at]
    kind = header & _KINDS
    at += 1
    if kind not in (_PUT, _DEL):
        raise Refused(f"a value 0x{header:02x} of an unknown kind")
    if header & 0x20:
        at = _stamp(data, at, 0)
    if kind == _DEL:
        return _extensions(data, at, _OF_DEL) if header & _EXTENDED else at
    if header & 0x40:
        at = _encoding(data, at)
    if header & _EXTENDED:
        at = _extensions(data, at, _OF_PUT)
    return _bytes(data, at)


def _query(data: bytes, at: int) -> int:
    header = data[at]
    at += 1
    if header & _KINDS != _QUERY:
        raise Refused(f"a question 0x{header:02x} of an unknown kind")
    if header & 0x20:
        _, at = _number(data, at)
    if header & 0x40:
        at = _bytes(data, at)
    return _extensions(data, at, _OF_QUERY) if header & _EXTENDED else at


def _answer(data: bytes, at: int) -> int:
    header = data[at]
    kind = header & _KINDS
    at += 1
    if kind == _REPLY and header < _EXTENDED:
        if header & 0x20:
            _, at = _number(data, at)
        return _value(data, at)
    if kind != _ERR:
        raise Refused(f"an answer 0x{header:02x} of an unknown kind")
    if header & 0x40:
        at = _encoding(data, at)
    if header & _EXTENDED:
        at = _extensions(data, at, _OF_ERR)
    return _bytes(data, at)


def _number(data: bytes, at: int) -> tuple[int, int]:
    """Return a number of 7 bits a byte, lowest first, and where it ends."""
    byte = data[at]
    if byte < 0x80:
        return byte, at + 1
    number = byte & 0x7F
    for i in range(1, 9):
        byte = data[at + i]
        if byte < 0x80 or i == 8:  # the ninth has eight bits
            return number | byte << 7 * i, at + i + 1
        number |= (byte & 0x7F) << 7 * i
    raise AssertionError  # not reached: the ninth byte is the last


def _bytes(data: bytes, at: int) -> int:
    length, at = _number(data, at)
    at += length
    if at > len(data):
        raise IndexError
    return at


def _encoding(data: bytes, at: int) -> int:
    number, at = _number(data, at)
    return _bytes(data, at) if number & 1 else at


def _stamp(data: bytes, at: int, _: int) -> int:
    _, at = _number(data, at)
    return _bytes(data, at)


def _member(data: bytes, at: int, numbers: int) -> int:
    """Read the id of a session and this many numbers."""
    at += 2 + (data[at] >> 4)
    for _ in range(numbers):
        _, at = _number(data, at)
    return at


def _source(data: bytes, at: int, _: int) -> int:
    return _member(data, at, 2)


def _responder(data: bytes, at: int, _: int) -> int:
    return _member(data, at, 1)


def _undeclared(data: bytes, at: int, end: int) -> int:
    """Read the key of what is declared no longer; its length is the extension's."""
    flags = data[at]
    scope, at = _number(data, at + 1)
    if flags & 1 and (why := _fault(data[at:end], scope != 0)):
        raise Refused(why)
    return end


# Extensions, by the message that may have them: id, 0x10 for "must be known", 0x20 for
# a number, 0x40 for bytes. The router reads the content of some without a look at its
# length, so that both have to agree. None of Zenoh's shared memory is among them.
_QOS, _STAMP, _NODE, _TARGET, _BUDGET, _WAIT = 0x21, 0x42, 0x33, 0x34, 0x25, 0x26
_MARK, _DROP = 0x02, 0x03
_OF_FRAME: Mapping[int, _Content] = {0x31: None}
_OF_FRAGMENT: Mapping[int, _Content] = {0x31: None, _MARK: None, _DROP: None}
_OF_MESSAGE: Mapping[int, _Content] = {
    **dict.fromkeys((_QOS, _NODE, _TARGET, _BUDGET, _WAIT)),
    _STAMP: _stamp,
}
_OF_RESPONSE: Mapping[int, _Content] = {_QOS: None, _STAMP: _stamp, 0x43: _responder}
_OF_DECLARED: Mapping[int, _Content] = {0x21: None, 0x5F: _undeclared}
_OF_PUT: Mapping[int, _Content] = {0x41: _source, 0x43: None}
_OF_DEL: Mapping[int, _Content] = {0x41: _source, 0x42: None}
_OF_QUERY: Mapping[int, _Content] = {0x41: _source, 0x43: None, 0x45: None}
_OF_ERR: Mapping[int, _Content] = {0x41: _source}


def _extensions(data: bytes, at: int, known: Mapping[int, _Content]) -> int:
    """Return where the extensions at `at` end."""
    while True:
        header = data[at]
        name = header & 0x7F
        if name not in known:
            raise Refused(f"an extension 0x{name:02x} that is not known here")
        at += 1
        if name & 0x60 == 0x20:
            _, at = _number(data, at)
        elif name & 0x60 == 0x40:
            length, at = _number(data, at)
            end = at + length
            content = known[name]
            if end > len(data) or content and content(data, at, end) != end:
                raise Refused(f"an extension 0x{name:02x} of another length")
            at = end
        if header < 0x80:
            return at


def _names(data: bytes, at: int) -> set[int]:
    """Return the names of a fragment's extensions."""
    names = set()
    while True:
        header = data[at]
        names.add(header & 0x7F)
        at += 1
        if header & 0x60 == 0x20:
            _, at = _number(data, at)
        if header < 0x80:
            return names
