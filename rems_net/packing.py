"""msgpack, with types: the one place that imports it.

Timestamps and other extensions are refused; nothing is ever unpickled.
"""

import importlib
from collections.abc import Callable
from functools import partial
from typing import Any

_msgpack: Any = importlib.import_module("msgpack")

_unpackb: Callable[..., Any] = _msgpack.unpackb
pack: Callable[[Any], bytes] = _msgpack.Packer().pack

# Whatever unpack raises on bytes that are not msgpack, or not within bounds.
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


def unpacker(longest_list: int, largest_map: int, **more: Any) -> Callable[..., Any]:
    """Return what decodes one object; a list or map over its bound is refused unread.

    Of a key that comes twice it keeps the last.
    """
    bounds = {"max_array_len": longest_list, "max_map_len": largest_map}
    return partial(_unpackb, **bounds, max_ext_len=0, **more)


def unpack(payload: bytes, *, longest_list: int, largest_map: int) -> Any:
    """Decode one object within bounds; a key that comes twice is refused, too."""
    return unpacker(longest_list, largest_map, object_pairs_hook=_pairs)(payload)


def unpack_short(payload: bytes) -> Any:
    """Decode one short object: no longer than its payload, so bounded by it."""
    return _unpackb(payload)


def _pairs(pairs: list[tuple[Any, Any]]) -> dict[Any, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        raise ValueError("a key comes twice")
    return found
