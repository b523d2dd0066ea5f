"""Accounts: the users of a class who have a page of their own at one server.

A page acts with the rights of its user, by a session of this user at the router. Thirty
sessions in one process cost 2 MB; one is open only while its user looks.
"""

import asyncio
from collections import Counter, defaultdict
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

from rems_net.client import Fabric
from rems_net.router.session import Session
from rems_net.router.settings import Link

if TYPE_CHECKING:
    from rems_net.dashboard.server import Server

#: s. A session stays open after its last page: a page that is loaded again comes back.
LINGER = 5.0


class Accounts:
    """Servers of users, one of each whose page is open. All belong to one thread.

    links: the router, the fabric and the password of each user.
    make: returns the server of a fabric.
    """

    def __init__(self, links: Mapping[str, Link], make: "Callable[[Fabric], Server]"):
        self._links, self._make = links, make
        self._open: dict[str, tuple[Server, asyncio.Task[None]]] = {}
        self._opening: defaultdict[str, asyncio.Lock] = defaultdict(asyncio.Lock)
        self._pages: Counter[str] = Counter()

    @property
    def pages(self) -> int:
        """How many pages of users are open."""
        return self._pages.total()

    @asynccontextmanager
    async def of(self, user: str) -> "AsyncIterator[Server]":
        """Yield the server of a user, for one page.

        Raises FabricError if the router does not answer or does not let the user in.
        """
        self._pages[user] += 1
        try:
            async with self._opening[user]:
                if user not in self._open:
                    session = Session(self._links[user])
                    await asyncio.to_thread(session.open)
                    server = self._make(Fabric(session))
                    self._open[user] = server, asyncio.create_task(server.run())
            yield self._open[user][0]
        finally:
            self._pages[user] -= 1
            if not self._pages[user]:
                asyncio.get_running_loop().call_later(LINGER, self._close, user)

    def _close(self, user: str) -> None:
        """Leave the fabric as this user, unless a page of theirs is open again."""
        if not self._pages[user] and user in self._open:
            self._open.pop(user)[1].cancel()

    def end(self) -> None:
        """Leave the fabric as every user."""
        for _, task in self._open.values():
            task.cancel()
        self._open.clear()
