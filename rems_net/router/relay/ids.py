"""Ids: a Zenoh id belongs to the user, or the address, that used it first.

Zenoh refuses a second session with an id. Without owners anybody could take the id of a
robot that has lost its Wi-Fi, and keep the robot out as long as they stay.
"""

from collections import OrderedDict

#: s. Without users, an address keeps an id for this time after its session: a laptop
#: that changes access points is back sooner, and one with a new address is not locked
#: out for good.
KEPT = 60.0
#: Ids of one owner without those of live sessions, which the gate bounds itself.
OF_OWNER = 128
#: Owners whose ids are stored at a time.
OWNERS = 4096


class Ids:
    """Owners of the ids."""

    def __init__(self, kept: float | None):
        #: s. Time from a session's end until its id is free; None: never.
        self._kept = kept
        self._owners: dict[bytes, str] = {}
        #: by owner, the latest last: each id, and the end of its session or None
        self._ids: OrderedDict[str, OrderedDict[bytes, float | None]] = OrderedDict()

    def may(self, zid: bytes, owner: str, now: float) -> bool:
        """Return whether this owner may use the id."""
        of = self._owners.get(zid, owner)
        if of == owner:
            return True
        ended = self._ids[of][zid]
        if ended is None or self._kept is None or now - ended < self._kept:
            return False
        self._forget(zid)
        return True

    def owner(self, zid: bytes) -> str:
        """Return the owner of an id; "" if it has none."""
        return self._owners.get(zid, "")

    def bind(self, zid: bytes, owner: str) -> None:
        """Give the id to this owner, whom the router has let in with it."""
        if self._owners.get(zid, owner) != owner:
            self._forget(zid)
        own = self._ids.setdefault(owner, OrderedDict())
        self._ids.move_to_end(owner)
        self._owners[zid] = owner
        own[zid] = None
        own.move_to_end(zid)
        if len(own) > OF_OWNER and (ended := _first_ended(own)):
            self._forget(ended)
        if len(self._ids) > OWNERS:
            for old in list(next(iter(self._ids.values()))):
                self._forget(old)

    def end(self, zid: bytes, now: float) -> None:
        """Note that the session with this id has ended."""
        if (owner := self._owners.get(zid)) is not None:
            self._ids[owner][zid] = now

    def _forget(self, zid: bytes) -> None:
        owner = self._owners.pop(zid)
        del self._ids[owner][zid]
        if not self._ids[owner]:
            del self._ids[owner]


def _first_ended(ids: OrderedDict[bytes, float | None]) -> bytes:
    """Return the oldest id whose session has ended; b"" if all sessions live."""
    return next((zid for zid, when in ids.items() if when is not None), b"")
