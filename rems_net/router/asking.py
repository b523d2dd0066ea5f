"""Questions under way, whose answers are taken as they come.

Zenoh ends a question when every program that may answer has let go of it. Any program
may keep it open: a frozen laptop, or one that declares `rems/**` and never answers. So
the asker decides when it has enough answers, and cancels the rest.
"""

import math
import re
import time
from collections.abc import Callable, Iterator
from queue import Empty, SimpleQueue
from typing import Any, Self

import zenoh

from rems_net.errors import ExperimentError
from rems_net.router.gate.shapes import RULE, fault
from rems_net.router.mail import MAX_PAYLOAD, Mail
from rems_net.router.publisher import direct

#: count, bytes. Answers to one question that are kept: a swarm has this many fields.
MOST, MOST_BYTES = 200_000, 8 * MAX_PAYLOAD
#: characters of a refusal that are shown
LONGEST = 500

_STARS = re.compile(r"\*+")


class Refusal(str):
    """An answerer's own sentence why it does not answer; fit to be printed."""

    __slots__ = ()


class Asking:
    """A question and its answers. `with session.asking(selector) as asking:`.

    session: Zenoh's.  timeout: seconds after which Zenoh ends an open question.
    told: called in Zenoh's own thread when there is something to `come`.
    """

    def __init__(
        self,
        session: zenoh.Session,
        selector: str,
        payload: bytes | None = None,
        timeout: float = 2.0,
        told: "Callable[[Asking], None] | None" = None,
    ):
        self._came: SimpleQueue[Any] = SimpleQueue()
        self._told = told
        self._cancel: Any = zenoh.CancellationToken()  # zenoh's stub types no method
        self._kept = self._bytes = 0
        #: answers that were too large, or too many, to be kept
        self.dropped = 0
        #: whether the question has ended
        self.ended = False
        #: whether it ended by the timeout, so an answerer may still hold it
        self.timed_out = False
        key, _, parameters = selector.partition("?")
        session.get(
            zenoh.Selector(glob(key), parameters),
            direct(self._file, drop=self._end),
            payload=payload,
            timeout=timeout,
            # Without ALL, Zenoh asks only one queryable that declares itself
            # `complete`.
            target=zenoh.QueryTarget.ALL,
            # Otherwise Zenoh holds answers back until the last has come.
            consolidation=zenoh.ConsolidationMode.NONE,
            cancellation_token=self._cancel,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        # Later answers are not needed.
        self._cancel.cancel()

    def _file(self, reply: zenoh.Reply) -> None:
        result: Any = reply.result
        size = len(result.payload)
        fits = size <= MAX_PAYLOAD and self._bytes + size <= MOST_BYTES
        if fits and self._kept < MOST:
            self._kept += 1
            self._bytes += size
            self._came.put(result)
            if self._told is not None:
                self._told(self)
        else:
            self.dropped += 1

    def _end(self) -> None:
        self._came.put(None)
        if self._told is not None:
            self._told(self)

    def next(self, until: float = math.inf) -> Mail | Refusal | None:
        """Return the next answer; None at the time `until`, or if no more will come.

        until: in `time.monotonic()`; after it None is returned even if an answer has
        come.
        """
        while not self.ended and (left := until - time.monotonic()) > 0:
            try:
                came = self._came.get(timeout=None if left == math.inf else left)
            except Empty:
                return None
            if (answer := self._sort(came)) is not None:
                return answer
        return None

    def come(self) -> Iterator[Mail | Refusal]:
        """Yield the answers that have come by now."""
        for _ in range(self._came.qsize()):
            if (answer := self._sort(self._came.get())) is not None:
                yield answer

    def _sort(self, came: Any) -> Mail | Refusal | None:
        if came is None:
            self.ended = True
            return None
        if type(came) is zenoh.Sample:
            return Mail(came)
        sentence = printable(came.payload.to_bytes().decode(errors="replace"))
        if sentence != "Timeout":
            return Refusal(sentence)
        self.timed_out = True
        return None


def meets(one: str, other: str) -> bool:
    """Return whether some key matches both of two keys or globs."""
    return bool(glob(one).intersects(glob(other)))


def glob(key: str) -> zenoh.KeyExpr:
    """Return a key or glob, written by people, for Zenoh: `*` inside a chunk is `$*`.

    Raises ExperimentError for one that a shared router does not let through.
    """
    chunks = [_STARS.sub("$*", c) if c.strip("*") else c for c in key.split("/")]
    found = zenoh.KeyExpr.autocanonize("/".join(chunks))
    shaped(str(found))
    return found


def shaped(key: str) -> str:
    """Return `key` if a shared router lets it through; else raise ExperimentError."""
    if why := fault(key):
        raise ExperimentError(
            f"{key.replace('$', '')!r} {why}; expected {RULE}, such as 'robot/*/state' "
            "or 'robot/sim/**'. (R0610)"
        )
    return key


def printable(text: str) -> str:
    """Return `text` in one line, without characters that control a terminal."""
    return "".join(c if c.isprintable() else "?" for c in text[:LONGEST])
