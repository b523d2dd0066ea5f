"""Streams: one of each fabric that some page shows. The first one runs always."""

import asyncio
from collections import Counter
from collections.abc import Iterator
from functools import partial
from typing import Any

from rems_net.client import Fabric
from rems_net.dashboard.pages import Page
from rems_net.dashboard.stream import Stream
from rems_net.dashboard.teams import may_see
from rems_net.router.keys import is_name


class Streams:
    """The streams of one session, by fabric. All methods belong to one thread.

    first: the stream of the fabric that was joined.
    """

    def __init__(self, first: Stream):
        self.first = first
        self._others: dict[str, tuple[Stream, asyncio.Task[None]]] = {}
        self._shown: Counter[str] = Counter()

    @property
    def pages(self) -> int:
        """How many pages are open."""
        return sum(1 for _ in self.all())

    def all(self) -> Iterator[Page]:
        """Yield the pages of all streams."""
        for stream in (self.first, *(stream for stream, _ in self._others.values())):
            yield from stream.pages

    async def of(self, fabric: Any) -> Stream | None:
        """Return the stream of a fabric; None if the session may not look there.

        fabric: its name; None or "" for the first one. Each call needs one of `leave`.
        """
        first = self.first
        session = first.fabric.session
        if fabric in (None, "", session.fabric):
            return first
        if not is_name(fabric):
            return None
        if not await first.in_thread(partial(may_see, session, fabric)):
            return None
        if fabric not in self._others:
            stream = first.on(Fabric(session.on(fabric)))
            self._others[fabric] = stream, asyncio.create_task(stream.run())
        self._shown[fabric] += 1
        return self._others[fabric][0]

    def leave(self, stream: Stream) -> None:
        """End a stream that no page shows any more."""
        fabric = stream.fabric.session.fabric
        if stream is self.first or fabric not in self._others:
            return
        self._shown[fabric] -= 1
        if self._shown[fabric] <= 0:
            _, task = self._others.pop(fabric)
            task.cancel()
            stream.end()

    def end(self) -> None:
        """End all streams, and leave the fabric."""
        for stream, task in self._others.values():
            task.cancel()
            stream.end()
        self._others.clear()
        self.first.end()
        self.first.fabric.session.close()
