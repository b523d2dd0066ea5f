"""What a session declares: what puts values at a key, and what hears or answers."""

from __future__ import annotations

from typing import Any

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


class Watch:
    """A declaration; lives until it or its session is closed."""

    def __init__(self, declared: Any, keep: list[object]):
        self._declared = declared
        keep.append(declared)

    def close(self) -> None:
        self._declared.undeclare()
