"""Server of the page: its files by HTTP, and its values by WebSocket, on one port."""

import asyncio
import logging
import socket
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from http import HTTPStatus
from typing import Any

from websockets.asyncio.server import (
    Server as Listener,
    ServerConnection,
    broadcast,
    serve,
)
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

import rems_net
from rems_net.client import Fabric
from rems_net.dashboard.accounts import Accounts
from rems_net.dashboard.controls import Controls
from rems_net.dashboard.door import VIEWERS, Answer, Door, refusal
from rems_net.dashboard.pages import Page
from rems_net.dashboard.protocol import LONGEST, VERSION, read_look, read_message
from rems_net.dashboard.stream import Stream
from rems_net.dashboard.streams import Streams
from rems_net.dashboard.teams import Teams
from rems_net.dashboard.viewers.meeting import Viewers, chosen
from rems_net.errors import FabricError, RemsError, WireError
from rems_net.router.settings import Link

#: pages at once, and connections that have not sent their token yet
PAGES, STRANGERS = 64, 32
#: s. A connection must send its token within this time.
GREETING = 5.0
#: s. Pause after a wrong token.
WRONG = 0.5
#: s. A page that does not answer a ping for this long is closed.
PING = 20.0
#: close codes: a wrong token, a fabric of others, another version
DENIED, FOREIGN, OTHER_VERSION = 4401, 4403, 4426
#: close code of RFC 6455 and its registry: the page tries again by itself
LATER = 1013
QUIET = logging.getLogger("rems_net.dashboard.websockets")
QUIET.setLevel(logging.CRITICAL)


class PageServer:
    """The door of a page's server: who gets in by which token, and how fast it speaks.

    A server of pages has a method `meet` for each connection.
    """

    #: sends a message to some connections, without waiting
    send = staticmethod(broadcast)

    def __init__(self, door: Door):
        self.door = door
        self._strangers = 0

    async def meet(self, link: ServerConnection) -> None:
        """Serve one connection, from its token to its end."""
        raise NotImplementedError

    def count(self) -> int:
        """Return how many pages are open."""
        return 0

    def refuse_viewer(self, host: str | None, path: str) -> Answer | None:
        """Return why a viewer does not get in; None if it does."""
        return refusal(HTTPStatus.NOT_FOUND, "No viewers are served here.")

    async def listen(self, sock: socket.socket) -> Listener:
        """Listen at a bound socket, the door's."""
        return await serve(
            self._meet,
            sock=sock,
            process_request=self._let_in,
            select_subprotocol=chosen,
            compression=None,
            max_size=LONGEST,
            max_queue=8,
            open_timeout=GREETING,
            ping_interval=PING,
            ping_timeout=PING,
            close_timeout=1.0,
            server_header=None,
            logger=QUIET,
        )

    async def _meet(self, link: ServerConnection) -> None:
        with suppress(ConnectionClosed):
            await self.meet(link)

    def _let_in(self, link: ServerConnection, request: Request) -> Response | None:
        """Answer a request of a file; None lets a WebSocket open."""
        hosts = request.headers.get_all("Host")
        host = hosts[0] if len(hosts) == 1 else None
        if request.headers.get("Upgrade") is None:
            status, headers, body = self.door.answer(request.path, host)
        elif request.path.startswith(VIEWERS):
            refused = self.refuse_viewer(host, request.path)
            if refused is None:
                return None
            status, headers, body = refused
        elif not self.door.lets_in(host, request.headers.get("Origin")):
            status, headers, body = (
                HTTPStatus.FORBIDDEN,
                {},
                b"This is no page of it.\n",
            )
        elif self._strangers >= STRANGERS or self.count() >= PAGES:
            status, headers = HTTPStatus.SERVICE_UNAVAILABLE, {}
            body = f"{PAGES} pages are open already.\n".encode()
        else:
            return None
        all_headers = Headers(headers)
        all_headers["Content-Length"] = str(len(body))
        all_headers["Connection"] = "close"
        return Response(status.value, status.phrase, all_headers, body)

    async def _greeting(self, link: ServerConnection) -> dict[str, Any] | None:
        """Return the first message if it has the token; else close, and return None."""
        self._strangers += 1
        try:
            return await self._read_greeting(link)
        finally:
            self._strangers -= 1

    async def _read_greeting(self, link: ServerConnection) -> dict[str, Any] | None:
        try:
            async with asyncio.timeout(GREETING):
                hello = read_message(await link.recv())
        except (TimeoutError, WireError, ConnectionClosed):
            await link.close(DENIED, "no token")
            return None
        if self.door.user_of(hello.get("hello")) is None:
            await asyncio.sleep(WRONG)
            await link.close(DENIED, "another token: use the newest link")
            return None
        if hello.get("version") != VERSION:
            await link.close(OTHER_VERSION, "another version: load the page again")
            return None
        return hello


class Server(PageServer):
    """Server of the pages of one fabric. `run` serves until it is cancelled.

    rate: frames per second.
    again: joins the fabric once more, for a run that has begun elsewhere.
    accounts: users that the door has invited, and how each joins: their pages act with
        their rights.
    layout: plots and views with which a page begins.
    """

    def __init__(
        self,
        fabric: Fabric,
        door: Door,
        rate: float = 30.0,
        again: Callable[[], Fabric] | None = None,
        accounts: Mapping[str, Link] | None = None,
        layout: dict[str, Any] | None = None,
    ):
        super().__init__(door)
        self._layout = layout
        self.accounts = Accounts(
            accounts or {}, lambda theirs: Server(theirs, door, rate, layout=layout)
        )
        self.stream = Stream(fabric, broadcast, rate, again)
        self.streams = Streams(self.stream)
        self.teams = Teams(lambda: self.stream.fabric.session)
        self.viewers = Viewers(door, self.stream, broadcast)
        self._stopper = ThreadPoolExecutor(1, "stop")

    async def run(self) -> None:
        """Send values and the state of the run, until cancelled."""
        try:
            await self.stream.run()
        finally:
            for page in self.streams.all():  # a frozen browser would delay the end
                page.cut()
            self.accounts.end()
            self._stopper.shutdown(wait=False)
            self.streams.end()

    async def meet(self, link: ServerConnection) -> None:
        """Serve one connection, from its token to its end."""
        if link.request is not None and link.request.path.startswith(VIEWERS):
            await self.viewers.meet(link)
            return
        hello = await self._greeting(link)
        if hello is None:
            return
        user = self.door.user_of(hello["hello"])
        if not user:
            await self._serve(link, hello)
            return
        try:
            async with self.accounts.of(user) as theirs:
                await theirs._serve(link, hello)
        except FabricError:
            await link.close(LATER, "the router does not let this user in now")

    def count(self) -> int:
        """Return how many pages are open."""
        return self.streams.pages + self.accounts.pages

    def refuse_viewer(self, host: str | None, path: str) -> Answer | None:
        """Return why a viewer does not get in; None if it does."""
        return self.viewers.refuse(host, path)

    async def _serve(self, link: ServerConnection, hello: dict[str, Any]) -> None:
        """Serve one page that has sent its token."""
        stream = await self.streams.of(hello.get("fabric"))
        if stream is None:
            await link.close(FOREIGN, "a fabric of another team")
            return
        page = Page(link, Controls(stream.fabric, stream.workers))
        try:
            await page.write({"welcome": self._welcome(stream)})
            stream.add(page)
            await self._hear(page, stream)
        finally:
            page.controls.let_go()
            stream.remove(page)
            self.streams.leave(stream)

    def _welcome(self, stream: Stream) -> dict[str, Any]:
        link = stream.fabric.session.link
        return {
            "version": rems_net.__version__,
            "fabric": link.fabric,
            "at": link.endpoint,
            "user": link.user,
            "rate": stream.rate,
            "layout": self._layout,
            "may": [*stream.requests.deeds, *self.teams.deeds],
        }

    async def _hear(self, page: Page, stream: Stream) -> None:
        """Obey the messages of a page until it goes."""
        doing: set[asyncio.Task[None]] = set()
        async for text in page.messages():
            task = asyncio.create_task(self._obey(page, stream, text))
            doing.add(task)
            task.add_done_callback(doing.discard)

    async def _obey(self, page: Page, stream: Stream, text: str | bytes) -> None:
        """Do what a message asks for, and answer it."""
        answer: dict[str, Any] = {}
        try:
            request = read_message(text)
            answer["id"] = request.get("id") if type(request.get("id")) is int else 0
            if "look" in request:
                page.looks = read_look(request)
                stream.want()
                return
            if "hand" in request:
                page.controls.take(request, time.monotonic())
                return
            verb = str(request.get("do"))
            stops: dict[str, Callable[[], None]] = {
                "stop": stream.requests.put_stop,
                "stop_teams": partial(self.teams.put_stop, request),
            }
            if verb in stops:  # before any robot is asked
                loop = asyncio.get_running_loop()
                await loop.run_in_executor(self._stopper, stops[verb])
            do = page.controls.drive if verb == "drive" else stream.requests.do
            do = self.teams.deeds.get(verb, do)
            answer["result"] = await stream.in_thread(partial(do, request))
        except RemsError as error:
            answer["error"] = str(error)
        except Exception as error:  # any program can answer what the page asks
            answer["error"] = f"This failed: {type(error).__name__}: {error}"[:500]
        stream.look_again()
        with suppress(ConnectionClosed):
            await page.write({"answer": answer})
