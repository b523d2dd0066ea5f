"""Server of the page on a recording: each page plays it for itself."""

import asyncio
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import rems_net
from rems_net.dashboard.door import Door
from rems_net.dashboard.pages import Visitor, text_of
from rems_net.dashboard.protocol import pack_frame, read_look, read_message
from rems_net.dashboard.recorded.player import Frame, Player, Wish, read_wish
from rems_net.dashboard.recorded.runs import RecordedRuns
from rems_net.dashboard.server import PageServer
from rems_net.errors import RemsError, WireError

#: s. A page that was hidden or slow goes on where it was, at most this far ahead.
LEAP = 0.2
NOTHING = Wish()


class RecordedPage(Visitor):
    """A browser that plays a recording."""

    def __init__(self, link: Any, recorded: RecordedRuns):
        super().__init__(link)
        #: agents of which it shows every port
        self.looks: set[str] = set()
        self.player = Player(recorded)
        #: the requests since its last frame
        self.wish = NOTHING

    def obey(self, message: dict[str, Any]) -> None:
        """Note a request. Raises WireError."""
        if "look" in message:
            self.looks = read_look(message)
        elif "play" in message:
            self.wish = self.wish.then(read_wish(message))
        else:
            raise WireError(
                "This is a recording: nothing can be commanded or asked here. (R1003)"
            )


class RecordedServer(PageServer):
    """Server of the pages of a recording. `run` serves until it is cancelled.

    rate: frames per second.
    """

    def __init__(self, recorded: RecordedRuns, door: Door, rate: float = 30.0):
        super().__init__(door)
        self._recorded, self._rate = recorded, rate
        self._pages: set[RecordedPage] = set()
        #: threads that read the file
        self._workers = ThreadPoolExecutor(4, "run")

    async def run(self) -> None:
        """Serve until cancelled."""
        try:
            await asyncio.Event().wait()
        finally:
            self._workers.shutdown(cancel_futures=True)
            self._recorded.close()

    def count(self) -> int:
        """Return how many pages are open."""
        return len(self._pages)

    async def meet(self, link: Any) -> None:
        """Serve one page, from its token to its end."""
        if await self._greeting(link) is None:
            return
        page = RecordedPage(link, self._recorded)
        await page.write({"welcome": self._welcome()})
        await page.write(self._recorded.described())
        self._pages.add(page)
        playing = asyncio.create_task(self._play(page))
        try:
            async for text in page.messages():
                self._obey(page, text)
        finally:
            playing.cancel()
            self._pages.discard(page)

    def _welcome(self) -> dict[str, Any]:
        return {
            "version": rems_net.__version__,
            "fabric": self._recorded.name,
            "at": "a recording",
            "user": "",
            "rate": self._rate,
            "may": [],
            "recording": self._recorded.recording(),
        }

    def _obey(self, page: RecordedPage, text: str | bytes) -> None:
        message: dict[str, Any] = {}
        try:
            message = read_message(text)
            page.obey(message)
        except RemsError as error:
            number = message["id"] if type(message.get("id")) is int else 0
            answer = {"id": number, "error": str(error)}
            self.send([page.link], text_of({"answer": answer}))

    async def _play(self, page: RecordedPage) -> None:
        """Send the page its frames, until cancelled."""
        loop = asyncio.get_running_loop()
        due = last = time.monotonic()
        while True:
            due = max(due + 1.0 / self._rate, time.monotonic())
            await asyncio.sleep(due - time.monotonic())
            passed, last = min(time.monotonic() - last, LEAP), time.monotonic()
            if page.is_full:
                continue
            wish, page.wish = page.wish, NOTHING
            ask = partial(page.player.frame, passed, wish, frozenset(page.looks))
            try:
                frame = await loop.run_in_executor(self._workers, ask)
            except RemsError as error:
                frame = _failed(page.player, error)
            if frame.text:
                self.send([page.link], text_of(frame.text))
            if frame.values:
                self.send([page.link], pack_frame(frame.values))


def _failed(player: Player, error: RemsError) -> Frame:
    """Return what a page receives for a part of the file that cannot be read."""
    event = {"level": "error", "tick": 0, "agent": "recording", "text": str(error)}
    player.playing = False
    still = {"playing": False, "pace": player.pace}
    return Frame({"events": [event], "playback": still}, [])
