"""Zenoh's network messages, read for their keys: puts, questions and declarations.

They have no length in front, so each is read to its end. A key stands in them as the id
of a prefix and a suffix. Zenoh declares ids for keys without wildcards only, so a
suffix alone shows the shape of a key. zenoh-pico declares some ids for whole key
expressions: no suffix may follow these. Nothing else has to be remembered. A message
that the router drops cannot make us believe in another key than the router does: an id
that may stand for wildcards stays one.

For display only, a client's liveliness tokens and the fabrics on which it has put STOP
are stored, too.
"""

from collections.abc import Mapping
from functools import lru_cache

from rems_net.router.gate import shapes, wire
from rems_net.router.gate.wire import (
    EXTENDED,
    Content,
    GateError,
    block,
    extensions,
    number,
)

#: bits of a header with the kind of the message
KINDS = 0x1F
#: kinds of network messages
INTEREST, FINAL, RESPONSE, REQUEST, PUSH, DECLARE = range(0x19, 0x1F)
# Kinds of their payloads, and of declarations.
_PUT, _DEL, _QUERY, _REPLY, _ERR = range(1, 6)
_ID, _NO_ID = 0x00, 0x01
_WITH_KEY, _WITHOUT_KEY, _ALL_DECLARED = (0x02, 0x04, 0x06), (0x03, 0x05, 0x07), 0x1A
_TOKEN, _NO_TOKEN = 0x06, 0x07
#: flags in a header: its key has a suffix; its id was declared by the client
_NAMED, _OWN = 0x20, 0x40
#: ids of one client that stand for wildcards
WILD = 1000
#: tokens of one client that are stored, and ids of keys of tokens and of STOP
TOKENS, IDS = 200, 256
#: ends of these keys, and characters of the longest key: below three names
_OURS, LONGEST = ("/@alive", "/stop"), 200
#: in place of the part of a key for which an id of the router's stands
FOREIGN = "?"
#: the payload `true`, behind its length
_TRUE = b"\x01\xc3"


class Known:
    """Stored facts about one client.

    wild: the ids that it has ever declared for wildcards.  tokens: by id, the keys of
    its liveliness tokens.  stops: the fabrics on which it has put STOP; "" for one that
    it has named by an id of the router's, which only its side of the line knows.
    """

    def __init__(self) -> None:
        self.wild: set[int] = set()
        self.tokens: dict[int, str] = {}
        self.stops: set[str] = set()
        #: by id, keys of tokens and of STOP that it has declared
        self._ids: dict[int, str] = {}

    def declare(self, name: int, kind: int, key: str) -> None:
        """Store an id or a token, or delete it."""
        if kind == _NO_TOKEN:
            self.tokens.pop(name, None)
        elif kind == _NO_ID:
            self._ids.pop(name & 0xFFFF, None)
        elif kind == _TOKEN and len(self.tokens) < TOKENS:
            self.tokens[name] = key
        elif key.endswith(_OURS) and len(key) <= LONGEST and len(self._ids) < IDS:
            self._ids[name & 0xFFFF] = key

    def put(self, key: str) -> None:
        """Store the fabric on which `true` was put, if that was STOP."""
        fabric, _, rest = key.partition("/")
        if key.startswith(FOREIGN):
            if "/stop".endswith(key.removeprefix(FOREIGN)):
                self.stops.add("")
        elif rest == "stop":
            self.stops.add(fabric)

    def key(self, data: bytes, at: int, flags: int) -> str:
        """Return the key at `at`; behind `FOREIGN` if its id is the router's."""
        scope, at = number(data, at)
        start = self._ids.get(scope, "") if flags & _OWN else FOREIGN * (scope > 0)
        if not flags & _NAMED:
            return start
        length, at = number(data, at)
        return start + data[at : at + length].decode()


def message(data: bytes, at: int, known: Known) -> int:
    """Return the index of the end of the message at `at`. Raises GateError.

    known: the client's declarations so far.
    """
    header, begun, wild = data[at], at + 1, known.wild
    kind = header & KINDS
    if kind == PUSH:
        at = _key(data, begun, header, wild)
        at = _value(data, extensions(data, at, header, _OF_MESSAGE))
        if data[at - 2 : at] == _TRUE:
            known.put(known.key(data, begun, header))
        return at
    if kind == DECLARE:
        return _declaration(data, at, known)
    if kind == INTEREST:
        return _interest(data, at, wild)
    if kind == FINAL:
        _, at = number(data, begun)
        return extensions(data, at, header, _OF_MESSAGE)
    at = beginning(data, at, wild)
    if kind == REQUEST:
        return _question(data, extensions(data, at, header, _OF_MESSAGE))
    return _answer(data, extensions(data, at, header, _OF_RESPONSE))


def beginning(data: bytes, at: int, wild: set[int]) -> int:
    """Read a put, a question or an answer up to the end of its key."""
    header = data[at]
    kind = header & KINDS
    at += 1
    if kind in (REQUEST, RESPONSE):
        _, at = number(data, at)
        if kind == RESPONSE and data[at] == 0 and not header & _NAMED:
            return at + 1  # an error answers for no key
    elif kind != PUSH:
        raise GateError(f"sent a message 0x{header:02x} of an unknown kind")
    return _key(data, at, header, wild)


def _key(data: bytes, at: int, flags: int, wild: set[int]) -> int:
    scope, at = number(data, at)
    if not flags & _NAMED:
        if not scope:
            raise GateError("sent a message without a key")
        return at
    if wild and flags & _OWN and scope in wild:
        raise GateError("sent a key whose wildcards stand in two pieces")
    length, at = number(data, at)
    end = at + length
    if length > shapes.LONGEST + 1:
        raise GateError(f"sent a key of {length} bytes")
    if end > len(data):
        raise IndexError
    if why := _fault(data[at:end], scope != 0):
        raise GateError(why)
    return end


@lru_cache(maxsize=4096)
def _fault(suffix: bytes, below: bool) -> str | None:
    """Return what is wrong with a suffix; below: it follows an id."""
    key = text = suffix.decode()
    if below and text.startswith("/"):
        key = text[1:]
    elif below and text.startswith("*"):
        key = f"_{text}"
    why = shapes.fault(key)
    return f"sent the key expression {text!r}, which {why}" if why else None


def _declaration(data: bytes, at: int, known: Known) -> int:
    header, wild = data[at], known.wild
    at += 1
    if header & 0x20:
        _, at = number(data, at)
    at = extensions(data, at, header, _OF_MESSAGE)
    header = data[at]
    kind = header & KINDS
    at += 1
    if kind == _ALL_DECLARED and header < EXTENDED:
        return at
    name, at = number(data, at)
    begun = at
    if kind in _WITH_KEY:
        at = _key(data, at, header, wild)
    elif kind == _ID:
        if _is_wild(data, at, header):
            wild.add(name & 0xFFFF)
        if len(wild) > WILD:
            raise GateError(f"declared more than {WILD} ids for wildcards")
        at = _key(data, at, header, wild)
    elif kind != _NO_ID and kind not in _WITHOUT_KEY:
        raise GateError(f"sent a declaration 0x{header:02x} of an unknown kind")
    if kind in (_TOKEN, _ID):
        known.declare(name, kind, known.key(data, begun, header))
    elif kind in (_NO_TOKEN, _NO_ID):
        known.declare(name, kind, "")
    return extensions(data, at, header, _OF_DECLARED)


def _is_wild(data: bytes, at: int, flags: int) -> bool:
    """Return whether a declared id's key has wildcards. Raises GateError."""
    if data[at] or not flags & _NAMED:
        raise GateError("declared an id by the help of another one")
    length, start = number(data, at + 1)
    return b"*" in data[start : start + length]


def _interest(data: bytes, at: int, wild: set[int]) -> int:
    header = data[at]
    _, at = number(data, at + 1)
    if header & 0x60:
        options = data[at]
        at += 1
        if options & 0x10:
            at = _key(data, at, options, wild)
    return extensions(data, at, header, _OF_MESSAGE)


def _value(data: bytes, at: int) -> int:
    header = data[at]
    kind = header & KINDS
    at += 1
    if header & 0x20:
        at = wire.stamp(data, at)
    if kind == _DEL:
        return extensions(data, at, header, _OF_DEL)
    if kind != _PUT:
        raise GateError(f"sent a value 0x{header:02x} of an unknown kind")
    if header & 0x40:
        at = wire.encoding(data, at)
    return block(data, extensions(data, at, header, _OF_PUT))


def _question(data: bytes, at: int) -> int:
    header = data[at]
    at += 1
    if header & KINDS != _QUERY:
        raise GateError(f"sent a question 0x{header:02x} of an unknown kind")
    if header & 0x20:
        _, at = number(data, at)
    if header & 0x40:
        at = block(data, at)
    return extensions(data, at, header, _OF_QUERY)


def _answer(data: bytes, at: int) -> int:
    header = data[at]
    kind = header & KINDS
    at += 1
    if kind == _REPLY and header < EXTENDED:
        if header & 0x20:
            _, at = number(data, at)
        return _value(data, at)
    if kind != _ERR:
        raise GateError(f"sent an answer 0x{header:02x} of an unknown kind")
    if header & 0x40:
        at = wire.encoding(data, at)
    return block(data, extensions(data, at, header, _OF_ERR))


def _undeclared(data: bytes, at: int, end: int) -> int:
    """Read the key of a withdrawn declaration; its length is the extension's."""
    flags = data[at]
    scope, at = number(data, at + 1)
    if flags & 1 and end - at > shapes.LONGEST + 1:
        raise GateError(f"sent a key of {end - at} bytes")
    if flags & 1 and (why := _fault(data[at:end], scope != 0)):
        raise GateError(why)
    return end


# The extensions that each message may have, by name. Zenoh's shared memory is not among
# them: it writes values in another way.
_QOS, _STAMP, _NODE, _TARGET, _BUDGET, _WAIT = 0x21, 0x42, 0x33, 0x34, 0x25, 0x26
_SOURCE = 0x41
_OF_MESSAGE: Mapping[int, Content] = {
    **dict.fromkeys((_QOS, _NODE, _TARGET, _BUDGET, _WAIT)),
    _STAMP: wire.stamp,
}
_OF_RESPONSE: Mapping[int, Content] = {
    _QOS: None,
    _STAMP: wire.stamp,
    0x43: wire.responder,
}
_OF_DECLARED: Mapping[int, Content] = {0x21: None, 0x5F: _undeclared}
_OF_PUT: Mapping[int, Content] = {_SOURCE: wire.source, 0x43: None}
_OF_DEL: Mapping[int, Content] = {_SOURCE: wire.source, 0x42: None}
_OF_QUERY: Mapping[int, Content] = {_SOURCE: wire.source, 0x43: None, 0x45: None}
_OF_ERR: Mapping[int, Content] = {_SOURCE: wire.source}
