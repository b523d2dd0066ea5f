"""Scouting: routers that answer on this network, if it lets multicast through."""

import time
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import Any

import zenoh

#: s. Time to listen.
LISTEN = 3.0
#: routers that are reported
MOST = 100


def scout(seconds: float = LISTEN) -> list[str]:
    """Return the endpoints of the routers that answer within `seconds`, sorted.

    It is optional: most campus networks filter multicast, and nothing else depends on
    it.
    """
    found: set[str] = set()
    came: SimpleQueue[zenoh.Hello] = SimpleQueue()
    until = time.monotonic() + seconds
    heard: Any = zenoh.handlers.Callback(came.put, indirect=False)
    with zenoh.scout(heard, what="router"), suppress(Empty):
        while len(found) < MOST:
            hello = came.get(timeout=max(0.0, until - time.monotonic()))
            found |= {str(locator).partition("?")[0] for locator in hello.locators}
    return sorted(one for one in found if one.startswith("tcp/") and one.isprintable())
