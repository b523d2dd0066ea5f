"""Stream: what all pages of a fabric receive: values, and the state of the run."""

import asyncio
import time
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from typing import Any, TypeVar

from rems_net.client import Fabric
from rems_net.dashboard.controls import CHECK, REST, Controls
from rems_net.dashboard.feed import Channel, Feed
from rems_net.dashboard.pages import NOTHING, Page, ready, text_of
from rems_net.dashboard.protocol import Value, pack_frame
from rems_net.dashboard.requests import Requests
from rems_net.errors import RemsError
from rems_net.events import warn

T = TypeVar("T")

#: s. Between two looks at the state of the run.
LOOK = 0.5
#: looks without a clock, after which another run is searched
ALONE = 3
#: s. Pause after an error of the server itself.
PAUSE = 0.1


class Stream:
    """The values and the state of one fabric, for the pages that look.

    send: sends a message to some connections, without waiting.
    rate: frames per second.
    again: joins the fabric once more, for a run that has begun elsewhere.
    """

    def __init__(
        self,
        fabric: Fabric,
        send: Callable[[list[Any], str | bytes], None],
        rate: float,
        again: Callable[[], Fabric] | None = None,
    ):
        self.fabric, self.rate = fabric, rate
        self._send, self._again = send, again
        self.requests = Requests(fabric)
        self.feed = Feed(fabric.session, self._learn)
        self.pages: set[Page] = set()
        #: digest -> fields, or None for an unknown schema, in the order of learning
        self._schemas: dict[str, Any] = {}
        self._asked: set[str] = set()
        self._status = self._scenes = NOTHING
        #: agents that were asked for their places and outlines
        self._drawn: set[str] = set()
        #: count of the runs so far; a run's own number is random
        self._runs = 1
        #: threads for what may wait
        self.workers = ThreadPoolExecutor(4, "requests")
        #: threads that look up schemas, which may take long: any program can be silent
        self.lookups = ThreadPoolExecutor(4, "schemas")
        self._looked = asyncio.Event()
        #: errors of the server itself that were reported
        self._failures: set[str] = set()

    def add(self, page: Page) -> None:
        """Send a page what is there, from now on."""
        self.pages.add(page)
        self.feed.open()
        self.look_again()

    def remove(self, page: Page) -> None:
        """Send it nothing more. Without pages nothing is subscribed to."""
        self.pages.discard(page)
        self.want()
        if not self.pages:
            self._rest()

    def want(self) -> None:
        """Subscribe to every port of the agents at which some page looks."""
        self.feed.want(set().union(*(page.looks for page in self.pages)))

    def look_again(self) -> None:
        """Look at the state of the run now."""
        self._looked.set()

    def in_thread(self, ask: Callable[[], T]) -> asyncio.Future[T]:
        """Call a function that may wait, in another thread."""
        return asyncio.get_running_loop().run_in_executor(self.workers, ask)

    def _rest(self) -> None:
        """Subscribe to nothing: no page looks."""
        self.feed.close()
        self._begin_anew()
        self._status = self._scenes = NOTHING

    async def run(self) -> None:
        """Send frames and the state of the run, until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._always(self._frames))
            tasks.create_task(self._always(self._look))
            tasks.create_task(self._always(self._look_at_hands))
            tasks.create_task(self._always(self._look_at_scenes))

    def on(self, fabric: Fabric) -> "Stream":
        """Return a stream of another fabric, over the same session."""
        return Stream(fabric, self._send, self.rate)

    def end(self) -> None:
        """Do nothing more in other threads."""
        for threads in (self.workers, self.lookups):
            threads.shutdown(wait=False, cancel_futures=True)

    async def _always(self, work: Callable[[], Awaitable[None]]) -> None:
        """Do this without end. Any program can send anything: no error ends it."""
        while True:
            try:
                await work()
            except Exception as error:
                text = f"the page's server failed: {type(error).__name__}: {error}"
                if text not in self._failures and len(self._failures) < 100:
                    self._failures.add(text)
                    warn("page", text)
                await asyncio.sleep(PAUSE)

    async def _frames(self) -> None:
        """Send the newest values, one frame for each 1 / rate seconds."""
        due = time.monotonic()
        while True:
            due = max(due + 1.0 / self.rate, time.monotonic())
            await asyncio.sleep(due - time.monotonic())
            if self.feed.is_open:
                self._send_frame()

    def _send_frame(self) -> None:
        feed = self.feed
        before = feed.run
        changed = feed.drain()
        if before and feed.run != before:  # another run has come
            run = feed.run
            feed.forget()
            feed.run = run
            self._begin_anew()
            for agent in sorted(feed.agents):
                feed.ask(agent)
            return
        pages = ready(self.pages)
        for page in pages:
            self._tell(page)
        self._send_values([p for p in pages if not p.behind], changed)
        late = [p for p in pages if p.behind]
        self._send_values(late, feed.latest)
        for page in late:
            page.behind = False

    def _begin_anew(self) -> None:
        """Forget what belongs to a run that is over."""
        self._runs += 1
        self._schemas.clear()
        self._asked.clear()
        self._drawn.clear()

    def _send_values(self, pages: list[Page], values: dict[int, Value]) -> None:
        if pages and values:
            self._send([page.link for page in pages], pack_frame(values.items()))

    def _tell(self, page: Page) -> None:
        """Send a page the schemas, channels and state that it does not have yet."""
        news: dict[str, Any] = {}
        if page.run != self._runs:
            page.run, page.channels, page.schemas = self._runs, 0, 0
            page.behind = True
            news["forget"] = True
        if page.schemas < len(self._schemas):
            news["schemas"] = dict(list(self._schemas.items())[page.schemas :])
            page.schemas = len(self._schemas)
        if page.channels < len(self.feed.channels):
            news["channels"] = [
                channel._asdict() for channel in self.feed.channels[page.channels :]
            ]
            page.channels = len(self.feed.channels)
        if page.status is not self._status:
            page.status = news["status"] = self._status
        if page.events < self.feed.told:
            new = min(self.feed.told - page.events, len(self.feed.events))
            news["events"] = list(self.feed.events)[len(self.feed.events) - new :]
            page.events = self.feed.told
        if page.scenes is not self._scenes:
            page.scenes = news["scenes"] = self._scenes
        if beat := page.controls.beat(time.monotonic()):
            news["beat"] = beat
        if news:
            self._send([page.link], text_of(news))

    def _learn(self, channel: Channel, payload: bytes) -> None:
        """Look up the schema of a new channel, in another thread."""
        name = channel.schema or channel.key
        if name in self._asked or channel.schema == "large":
            return
        self._asked.add(name)
        loop = asyncio.get_running_loop()
        asked = loop.run_in_executor(
            self.lookups, self.requests.schema, channel, payload
        )
        run = self._runs

        def learnt(done: asyncio.Future[Any]) -> None:
            if run == self._runs and not done.cancelled() and not done.exception():
                self._schemas[name] = done.result()

        asked.add_done_callback(learnt)

    # -- the state of the run ---------------------------------------------------------

    async def _look(self) -> None:
        """Keep the status up to date, while a page looks."""
        alone = 0
        while True:
            with suppress(TimeoutError):
                async with asyncio.timeout(LOOK):
                    await self._looked.wait()
            self._looked.clear()
            if self.feed.is_open:
                with suppress(RemsError):
                    found = await self.in_thread(self.requests.status)
                    if found != self._status:
                        self._status = found
                    alone = 0 if found["clock"] else alone + 1
                    if alone > ALONE and self._again is not None:
                        alone = 0
                        await self._move(await self.in_thread(self._again))

    async def _move(self, fabric: Fabric) -> None:
        """Show this fabric from now on, if it is at another router than before."""
        old = self.fabric
        if set(fabric.session.routers()) <= set(old.session.routers()):
            fabric, old = old, fabric
        if fabric is not self.fabric:
            self.feed.close()
            self.fabric, self.requests = fabric, Requests(fabric)
            self.feed = Feed(fabric.session, self._learn)
            self._begin_anew()
            for page in self.pages:
                page.controls.let_go()
                page.controls = Controls(fabric, self.workers)
            if self.pages:
                self.feed.open()
                self.want()
        await self.in_thread(old.session.close)

    async def _look_at_hands(self) -> None:
        """Let go for pages that are silent."""
        while True:
            driven = any(page.controls for page in self.pages)
            await asyncio.sleep(CHECK if driven else REST)
            for page in self.pages:
                page.controls.look(time.monotonic())

    async def _look_at_scenes(self) -> None:
        """Ask for places and outlines when agents have come or gone."""
        while True:
            await asyncio.sleep(LOOK)
            if self.feed.is_open and self._drawn != self.feed.agents:
                self._drawn = set(self.feed.agents)
                with suppress(RemsError):
                    ask = partial(self.requests.scenes, self._drawn)
                    self._scenes = await self.in_thread(ask)
