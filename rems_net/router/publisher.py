"""Declarations of a session: publishers, callbacks, handles of subscriptions."""

import ctypes
from collections.abc import Callable
from threading import local
from typing import Any, TypeAlias

import zenoh

_here = local()


def _keep_state() -> None:
    """Keep the Python state of this thread, which Zenoh started, until the end.

    Python makes a new state for every call from such a thread, and frees it afterwards.
    The first Python function in a new state also maps memory, and gives it back at the
    end, for which the system interrupts the other processors. If the states are kept,
    ten hosts in lock-step make a third more ticks.
    """
    if not hasattr(_here, "kept"):
        _here.kept = True
        # Python counts the calls of a thread; this one is never counted back.
        ctypes.pythonapi.PyGILState_Ensure()


def direct(
    function: Callable[[Any], None], drop: Callable[[], None] | None = None
) -> Any:
    """Return a handler that calls `function` in Zenoh's thread; `drop` at the end."""

    def call(came: Any) -> None:
        _keep_state()
        function(came)

    return zenoh.handlers.Callback(call, drop=drop, indirect=False)


class Publisher:
    """Publisher of one key. `watched` is whether there is a subscriber."""

    __slots__ = ("_listener", "_publisher", "put_raw", "watched")

    def __init__(self, publisher: zenoh.Publisher):
        self._publisher: Any = publisher  # zenoh's stub leaves some of it untyped
        self.watched = False
        self._listener = publisher.declare_matching_listener(direct(self._matched))
        self.put_raw = publisher.put

    def look(self) -> None:
        """Update `watched` now: the listener may lag behind."""
        # The stub declares a bool; it is a MatchingStatus, which is always true.
        self._matched(self._publisher.matching_status)

    def _matched(self, status: zenoh.MatchingStatus) -> None:
        self.watched = status.matching

    def put(self, payload: bytes, stamp: bytes | None = None) -> None:
        """Send `payload`; `stamp` is `pack_stamp(tick, time)`."""
        self.put_raw(payload, attachment=stamp)

    def close(self) -> None:
        self._publisher.undeclare()


class Member:
    """Publisher of one of the many keys for which a crowd's publisher is declared.

    Zenoh compares each declaration with all others, so ten thousand robots would need a
    minute to declare their publishers. A crowd declares one, with a glob. `watched` is
    of the crowd. If it is true, each member declares its own key at the first put;
    without that Zenoh would compare every put anew. Keys without subscribers cause no
    traffic.
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
    """Publisher of nothing: a crowd's robots all receive their mail by one glob."""

    watched = False

    def look(self) -> None:
        """Do nothing: there are no subscribers."""

    def put_raw(self, payload: bytes, attachment: bytes) -> None:
        """Drop the value."""


#: the publishers of values at one key
Puts: TypeAlias = Publisher | Member | Unseen


class Watch:
    """Handle of a declaration, which lives until it or its session is closed."""

    def __init__(self, declared: Any, keep: list[object]):
        self._declared = declared
        keep.append(declared)

    def close(self) -> None:
        self._declared.undeclare()
