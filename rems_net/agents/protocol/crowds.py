"""The values of one port of many agents of a host in one message, `{name: values}`."""

from collections.abc import Mapping, Sequence
from struct import Struct
from typing import NamedTuple

from rems_net.agents.protocol.shapes import wrong
from rems_net.errors import WireError
from rems_net.packing import UNPACK_ERRORS, map_header, spans


def pack_crowd(rows: Sequence[bytes]) -> bytes:
    """Return the message. rows: each a name and its values, packed."""
    return map_header(len(rows)) + b"".join(rows)


class CrowdValues(NamedTuple):
    """A message that came: payloads of agents, by the place of each.

    where: the place of each name; the same object while the names are the same.
    """

    where: Mapping[str, int]
    payloads: Sequence[bytes]
    message: bytes

    def get(self, name: str) -> bytes | None:
        """Return the payload of an agent; None if it is not there."""
        place = self.where.get(name)
        return None if place is None else self.payloads[place]


class Layout:
    """Places of names and values in a message, which are the same at most ticks."""

    def __init__(self, message: bytes) -> None:
        """Find them. Raises WireError for what is no map of names to values."""
        self.where: dict[str, int] = {}
        sizes, fixed, last = [], [], 0
        try:
            for name, begin, end in spans(message):
                if type(name) is not str or name in self.where:
                    raise wrong("a name", name, "text, each name once")
                self.where[name] = len(self.where)
                fixed.append(message[last:begin])
                sizes += [begin - last, end - begin]
                last = end
        except UNPACK_ERRORS as error:
            raise WireError(
                f"These {len(message)} bytes are no values by name: "
                f"{error or 'no msgpack'}. (R0621)"
            ) from None
        if not fixed:
            raise wrong("a message of a crowd", {}, "the values of one or more agents")
        self._fixed = tuple(fixed)
        self._parts = Struct("".join(f"{size}s" for size in sizes))

    def take(self, message: bytes) -> CrowdValues | None:
        """Return its values; None if it has another layout."""
        if len(message) != self._parts.size:
            return None
        parts = self._parts.unpack(message)
        if parts[::2] != self._fixed:
            return None
        return CrowdValues(self.where, parts[1::2], message)


def read_crowd(
    message: bytes, layout: Layout | None = None
) -> tuple[CrowdValues, Layout]:
    """Read a message, and return its layout for the next one. Raises WireError."""
    values = None if layout is None else layout.take(message)
    if layout is None or values is None:
        layout = Layout(message)
        values = layout.take(message)
    assert values is not None  # it is its own layout
    return values, layout
