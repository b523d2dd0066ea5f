"""Pages: the browsers that look now, and what each has received."""

import json
import time
from collections.abc import AsyncIterator, Iterable
from typing import Any

from rems_net.dashboard.controls import Controls
from rems_net.dashboard.protocol import RATE

#: bytes that wait for a page. A page with more gets nothing until they are gone.
FULL = 256 * 1024
#: what a page has first
NOTHING: dict[str, Any] = {}
#: close code of WebSocket: too many messages
NOISY = 4429


class Visitor:
    """One browser, or another program, behind a WebSocket.

    rate: messages that it may send, a second.
    """

    def __init__(self, link: Any, rate: float = RATE):
        self.link, self._rate = link, rate
        #: messages that it may still send
        self._left, self._since = rate, time.monotonic()

    @property
    def is_full(self) -> bool:
        """Whether so much waits for it that it gets no frame."""
        waiting: int = self.link.transport.get_write_buffer_size()
        return waiting > FULL

    def cut(self) -> None:
        """End the connection at once if it does not take what waits for it."""
        if self.link.transport.get_write_buffer_size():
            self.link.transport.abort()

    async def messages(self) -> AsyncIterator[str | bytes]:
        """Yield its messages until it goes, or sends too many."""
        async for message in self.link:
            now = time.monotonic()
            more = (now - self._since) * self._rate
            self._left, self._since = min(self._rate, self._left + more) - 1.0, now
            if self._left < 0.0:
                await self.link.close(NOISY, "too many messages")
                return
            yield message

    async def write(self, plain: dict[str, Any]) -> None:
        """Send a JSON text."""
        await self.link.send(text_of(plain))


class Page(Visitor):
    """A browser that shows a fabric."""

    def __init__(self, link: Any, controls: Controls):
        super().__init__(link)
        #: agents of which it shows every port
        self.looks: set[str] = set()
        #: the robots that it drives
        self.controls = controls
        #: number of channels and of schemas that it knows
        self.channels = 0
        self.schemas = 0
        #: the newest status and scenes that it has, and how many events
        self.status = self.scenes = NOTHING
        self.events = 0
        #: number of the run whose values it shows
        self.run = 0
        #: whether it has missed a frame, and so needs all values
        self.behind = True


def text_of(plain: dict[str, Any]) -> str:
    """Return a message as JSON; infinities, which JSON lacks, are null."""
    try:
        return json.dumps(plain, separators=(",", ":"), allow_nan=False)
    except ValueError:
        return json.dumps(_finite(plain), separators=(",", ":"))


def _finite(plain: Any) -> Any:
    if isinstance(plain, dict):
        return {k: _finite(v) for k, v in plain.items()}
    if isinstance(plain, list | tuple):
        return [_finite(v) for v in plain]
    if isinstance(plain, float) and not abs(plain) < float("inf"):
        return None
    return plain


def ready(pages: Iterable[Page]) -> list[Page]:
    """Return the pages that can take a frame; the others are behind from now on."""
    found = []
    for page in pages:
        if page.is_full:
            page.behind = True
        else:
            found.append(page)
    return found
