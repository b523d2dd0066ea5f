"""What a session declares: what puts values at a key, and what hears or answers."""

from collections.abc import Callable
from typing import Any, TypeAlias

import zenoh


class Publisher:
    """Puts values at one key. `watched` says whether anybody would get them."""

    __slots__ = ("_listener", "_publisher", "put_raw", "watched")

    def __init__(self, publisher: zenoh.Publisher):
        self._publisher: Any = publisher  # zenoh's stub leaves some of it untyped
        self.watched = False
        self._listener = publisher.declare_matching_listener(
            zenoh.handlers.Callback(self._matched, indirect=False)
        )
        self.put_raw = publisher.put

    def look(self) -> None:
        """Find out whether anybody watches: what tells of changes may lag behind."""
        # The stub says bool; it is a MatchingStatus, and always truthy.
        self._matched(self._publisher.matching_status)

    def _matched(self, status: zenoh.MatchingStatus) -> None:
        self.watched = status.matching

    def put(self, payload: bytes, stamp: bytes | None = None) -> None:
        """Send `payload`; `stamp` is `pack_stamp(tick, time)`."""
        self.put_raw(payload, attachment=stamp)

    def close(self) -> None:
        self._publisher.undeclare()


class Member:
    """Puts values at one of the many keys that a crowd's publisher is declared for.

    Zenoh compares what is declared with all that is, so ten thousand robots would
    take a minute to say what they publish. A crowd says it once, with a glob.
    `watched` is of the crowd. Once it is, each member declares its own key, without
    which every put would be compared anew; what nobody subscribes to stays here.
    """

    __slots__ = ("_crowd", "_declare", "put_raw")

    def __init__(self, crowd: Publisher, declare: Callable[[], Callable[..., None]]):
        self._crowd, self._declare = crowd, declare
        self.put_raw: Callable[..., None] = self._first

    def _first(self, payload: bytes, attachment: bytes) -> None:
        self.put_raw = self._declare()
        self.put_raw(payload, attachment=attachment)

    @property
    def watched(self) -> bool:
        return self._crowd.watched

    def look(self) -> None:
        self._crowd.look()


class Unseen:
    """Puts nothing: what a crowd is told, which all crowds listen for with a glob."""

    watched = False

    def look(self) -> None:
        """Nobody watches."""

    def put_raw(self, payload: bytes, attachment: bytes) -> None:
        """Passed over."""


#: what puts values at one key
Puts: TypeAlias = Publisher | Member | Unseen


class Watch:
    """A declaration; lives until it or its session is closed."""

    def __init__(self, declared: Any, keep: list[object]):
        self._declared = declared
        keep.append(declared)

    def close(self) -> None:
        self._declared.undeclare()
