"""Ids: a Zenoh id belongs to the user, or the addresses, that have used it.

Zenoh refuses a second session with an id. Without owners anybody could take the id of a
robot that has lost its Wi-Fi, and keep the robot out as long as they stay. A laptop
without a user's name can come back with another address. So on an open router an
address may use any id whose session has ended, and an address that used the id earlier
takes it back, even from a living session.
"""

from collections import OrderedDict

#: Ids of one owner without those of live sessions, which the gate bounds itself.
OF_OWNER = 128
#: Owners whose ids are stored at a time.
OWNERS = 4096


class Ids:
    """Owners of the ids. named: owners are users, and an id is one user's for ever."""

    def __init__(self, *, named: bool):
        self._named = named
        #: by id, its owners; the earliest first
        self._owners: dict[bytes, list[str]] = {}
        #: by owner, the latest last: each id, and whether its session lives
        self._ids: OrderedDict[str, OrderedDict[bytes, bool]] = OrderedDict()

    def holder(self, zid: bytes, owner: str) -> str:
        """Return the owner who keeps the id from this one; "" if none does."""
        for of in self._owners.get(zid, ()):
            if of == owner:
                return ""
            if self._named or self._ids[of][zid]:
                return of
        return ""

    def bind(self, zid: bytes, owner: str) -> None:
        """Give the id to this owner, whom the router has let in with it."""
        owners = self._owners.setdefault(zid, [])
        if owner not in owners:
            owners.append(owner)
        own = self._ids.setdefault(owner, OrderedDict())
        self._ids.move_to_end(owner)
        own[zid] = True
        own.move_to_end(zid)
        if len(own) > OF_OWNER and (ended := _first_ended(own)):
            self._forget(ended, owner)
        if len(self._ids) > OWNERS:
            of, old = next(iter(self._ids.items()))
            for one in list(old):
                self._forget(one, of)

    def end(self, zid: bytes, owner: str) -> None:
        """Note that the session of this owner with this id has ended."""
        if zid in self._ids.get(owner, ()):
            self._ids[owner][zid] = False

    def _forget(self, zid: bytes, owner: str) -> None:
        self._owners[zid].remove(owner)
        if not self._owners[zid]:
            del self._owners[zid]
        del self._ids[owner][zid]
        if not self._ids[owner]:
            del self._ids[owner]


def _first_ended(ids: OrderedDict[bytes, bool]) -> bytes:
    """Return the oldest id whose session has ended; b"" if all sessions live."""
    return next((zid for zid, lives in ids.items() if not lives), b"")
