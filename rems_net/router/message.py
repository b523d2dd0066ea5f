"""Messages of the machinery: small msgpack values, bounded before decoding.

And the stamp of a value, its attachment: when it was written, and by which host.
"""

import socket
from functools import lru_cache
from math import isfinite
from typing import Any, NamedTuple

from rems_net.errors import WireError
from rems_net.packing import (
    UNPACK_ERRORS,
    pack as pack,  # exported, too
    unpack,
    unpack_short,
)

#: agents of the longest roster, which is the largest message
MOST = 100_000
#: bytes. A message up to this size cannot hold more than can be decoded safely.
SHORT = 256


def machine() -> str:
    """Return the name of this machine, as text that can be sent and printed."""
    return socket.gethostname().encode(errors="backslashreplace").decode()


def read(payload: bytes) -> Any:
    """Decode one message. Raises WireError for malformed bytes."""
    try:
        if len(payload) <= SHORT:  # every tick, done and stamp: the usual way
            return unpack_short(payload)
        return unpack(payload, longest_list=MOST, largest_map=MOST)
    except UNPACK_ERRORS as error:
        raise WireError(
            f"These {len(payload)} bytes are no message: {error or 'no msgpack'}."
            " (R0621)"
        ) from None


#: ticks. No run is longer (285 000 years at 1 kHz).
LAST_TICK = 2**53
#: badges are smaller than this
BADGES = 2**64


class Stamp(NamedTuple):
    """Time of writing of a value, in fabric time.

    n, t: the tick and its end [s]; -1 and 0.0 if the sender named none
    badge: of the host that wrote it; 0 for a program from outside
    said: the source tick, if it is an earlier one
    """

    n: int
    t: float
    badge: int = 0
    said: int = -1


UNSTAMPED = Stamp(-1, 0.0)


def pack_stamp(n: int, t: float, badge: int = 0, said: int | None = None) -> bytes:
    """Return `[n, t, badge]`; and the source tick if it differs from `n`."""
    if said is None or said == n:
        return pack((n, t, badge))
    return pack((n, t, badge, said))


@lru_cache(maxsize=256)  # all values of a crowd have one stamp
def read_stamp(payload: bytes) -> Stamp:
    """Read `[n, t]`, `[n, t, badge]` or `[n, t, badge, said]`. Raises WireError."""
    words = read(payload)
    if type(words) is not list or not 2 <= len(words) <= 4:
        raise WireError("its stamp is no [n, t, badge]. (R0621)")
    n, t = words[0], words[1]
    badge = words[2] if len(words) > 2 else 0
    said = words[3] if len(words) > 3 else n
    if not (
        type(n) is type(badge) is type(said) is int
        and type(t) is float
        and 0 <= said <= n <= LAST_TICK
        and 0 <= badge < BADGES
        and isfinite(t)
    ):
        raise WireError(
            f"its stamp is {words!r:.80}; expected [n, t, badge]: a tick, its time "
            "in s and who wrote it. (R0621)"
        )
    return Stamp(n, t, badge, said)
