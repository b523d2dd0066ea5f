"""Pages: the browsers that look now, and what each has received."""

import json
import time
from collections.abc import Iterable
from typing import Any

from rems_net.dashboard.controls import Controls
from rems_net.dashboard.protocol import RATE

#: bytes that wait for a page. A page with more gets nothing until they are gone.
FULL = 256 * 1024


class Visitor:
    """One browser, behind a WebSocket."""

    def __init__(self, link: Any):
        self._link = link
        #: agents of which it shows every port
        self.looks: set[str] = set()
        #: messages that it may still send
        self._left, self._since = RATE, time.monotonic()

    @property
    def is_full(self) -> bool:
        """Whether so much waits for it that it gets no frame."""
        waiting: int = self._link.transport.get_write_buffer_size()
        return waiting > FULL

    def cut(self) -> None:
        """End the connection at once if it does not take what waits for it."""
        if self._link.transport.get_write_buffer_size():
            self._link.transport.abort()

    def may_speak(self) -> bool:
        """Return whether another message keeps it below RATE."""
        now = time.monotonic()
        self._left = min(RATE, self._left + (now - self._since) * RATE)
        self._since = now
        self._left -= 1.0
        return self._left >= 0.0

    async def send(self, plain: dict[str, Any]) -> None:
        """Send a JSON text."""
        await self._link.send(text_of(plain))

    @property
    def link(self) -> Any:
        """Its connection."""
        return self._link


class Page(Visitor):
    """A browser that shows a fabric."""

    def __init__(self, link: Any, controls: Controls):
        super().__init__(link)
        #: the robots that it drives
        self.controls = controls
        #: number of channels and of schemas that it knows
        self.channels = 0
        self.schemas = 0
        #: number of the newest status, scenes and events that it has
        self.status = 0
        self.scenes = 0
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
