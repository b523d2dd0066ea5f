"""What the machinery says to itself: small msgpack maps, bounded before decoding."""

from __future__ import annotations

from typing import Any

from rems_net.errors import WireError
from rems_net.packing import UNPACK_ERRORS, pack, unpack, unpack_short

__all__ = ["pack", "read"]

#: a roster of this many agents is the largest thing that is said
MOST = 100_000
#: bytes up to which what a message can hold is bounded by the message
SHORT = 256


def read(payload: bytes) -> Any:
    """Decode one message. Raises WireError for bytes that are none."""
    try:
        if len(payload) <= SHORT:  # every tick, done and stamp: the way of all time
            return unpack_short(payload)
        return unpack(payload, longest_list=MOST, largest_map=MOST)
    except UNPACK_ERRORS as error:
        raise WireError(
            f"These {len(payload)} bytes are no message: {error or 'no msgpack'}."
        ) from None
