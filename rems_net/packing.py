"""msgpack, with types: the one place that imports it.

Timestamps and other extensions are refused; nothing is ever unpickled.
"""

import importlib
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

_msgpack: Any = importlib.import_module("msgpack")

_unpackb: Callable[..., Any] = _msgpack.unpackb
pack: Callable[[Any], bytes] = _msgpack.Packer().pack

# Errors of unpack for bytes that are not msgpack, or beyond the bounds.
UNPACK_ERRORS: tuple[type[Exception], ...] = (
    ValueError,
    TypeError,
    OverflowError,
    RecursionError,
    _msgpack.UnpackException,
)


def map_header(count: int) -> bytes:
    """Return the bytes that begin a map of `count` entries."""
    header: bytes = _msgpack.Packer().pack_map_header(count)
    return header


def list_header(count: int) -> bytes:
    """Return the bytes that begin a list of `count` items."""
    header: bytes = _msgpack.Packer().pack_array_header(count)
    return header


def spans(payload: bytes) -> Iterator[tuple[Any, int, int]]:
    """Yield each key of a packed map, and where its value begins and ends.

    Raises one of UNPACK_ERRORS for other bytes.
    """
    reader = _msgpack.Unpacker(max_buffer_size=len(payload) or 1, max_ext_len=0)
    reader.feed(payload)
    count, end = reader.read_map_header(), reader.tell()
    for _ in range(count):
        key, begin = reader.unpack(), reader.tell()
        reader.skip()
        end = reader.tell()
        yield key, begin, end
    if end != len(payload):
        raise ValueError("there is something behind it")


def unpacker(longest_list: int, largest_map: int, **more: Any) -> Callable[..., Any]:
    """Return a decoder of one object; it refuses a list or map over its bound.

    If a key comes twice, the last value counts.
    """
    bounds = {"max_array_len": longest_list, "max_map_len": largest_map}
    return partial(_unpackb, **bounds, max_ext_len=0, **more)


def unpack(payload: bytes, *, longest_list: int, largest_map: int) -> Any:
    """Decode one object within bounds; a key that comes twice is refused, too."""
    return unpacker(longest_list, largest_map, object_pairs_hook=_pairs)(payload)


#: Decodes one short object: its size is bounded by its payload's.
unpack_short = _unpackb


def _pairs(pairs: list[tuple[Any, Any]]) -> dict[Any, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        raise ValueError("a key comes twice")
    return found
