"""Mail: what Zenoh's threads have filed, to be read later in another thread."""

from collections.abc import Callable, Container, Iterator
from contextlib import suppress
from functools import cache
from queue import Empty, SimpleQueue
from threading import Event, Thread
from typing import Any, NamedTuple, Self
from weakref import WeakSet

import zenoh

from rems_net.errors import WireError
from rems_net.router.gate.shapes import fault
from rems_net.router.message import UNSTAMPED, Stamp, read_stamp

#: bytes. A larger value is not decoded.
MAX_PAYLOAD = 16 * 1024 * 1024
#: bytes. A larger question is not read: a call of a verb, a host that joins.
MAX_QUESTION = 32 * 1024 * 1024
#: letters in one mailbox. More are dropped, which costs only time: important messages
#: are sent again, or asked for.
MAX_LETTERS = 50_000
#: s. Interval in which mailboxes are checked for too many letters.
BETWEEN = 0.5

_ENCODING = "application/msgpack"


def encoding(schema: str) -> str:
    """Return `application/msgpack` with a schema, named `<schema name>@<digest>`."""
    return f"{_ENCODING};{schema}" if schema else _ENCODING


class Mail:
    """A value that came. It is decoded only on request."""

    __slots__ = ("_sample", "key")

    def __init__(self, sample: zenoh.Sample):
        self._sample = sample
        self.key = str(sample.key_expr)

    @property
    def size(self) -> int:
        """Bytes of the payload."""
        return len(self._sample.payload)

    @property
    def payload(self) -> bytes:
        """The bytes that were sent. Raises WireError above MAX_PAYLOAD, uncopied."""
        payload = self._sample.payload  # Zenoh makes a new object at each access
        if len(payload) > MAX_PAYLOAD:
            raise WireError(
                f"{self.key}: {self.size} bytes came; expected at most {MAX_PAYLOAD}."
                " (R0621)"
            )
        return payload.to_bytes()

    @property
    def schema(self) -> str:
        """`<schema name>@<digest>`; "" if the sender named none."""
        return str(self._sample.encoding).partition(";")[2]

    @property
    def attachment(self) -> bytes:
        """The stamp as it came; b"" if there is none."""
        attachment = self._sample.attachment
        return b"" if attachment is None else attachment.to_bytes()

    def stamp(self) -> Stamp:
        """Return when it was written, and by which agent; UNSTAMPED without a stamp.

        Raises WireError for an attachment that is no stamp.
        """
        attachment = self._sample.attachment
        return UNSTAMPED if attachment is None else read_stamp(attachment.to_bytes())

    def __repr__(self) -> str:
        return f"<Mail {self.key} {len(self._sample.payload)} bytes>"


class Presence(NamedTuple):
    """Appearance or disappearance of an agent."""

    key: str
    alive: bool


class Question:
    """A question for a key: answer once or more; `with` ends it."""

    __slots__ = ("_query", "key", "parameters", "topic")

    def __init__(self, query: zenoh.Query, topic: str = ""):
        self._query: Any = query  # zenoh's stub leaves `drop` without types
        #: topic of the queryable that it reached: a glob reaches several
        self.topic = topic
        self.key = str(query.key_expr)
        given = (p.partition("=") for p in str(query.parameters).split(";") if p)
        self.parameters = {key: value for key, _, value in given}

    @property
    def size(self) -> int:
        """Bytes of the payload."""
        payload = self._query.payload
        return 0 if payload is None else len(payload)

    @property
    def payload(self) -> bytes:
        """The payload. Raises WireError above MAX_QUESTION, before a copy."""
        payload = self._query.payload
        if payload is None:
            return b""
        if len(payload) > MAX_QUESTION:
            raise WireError(
                f"{len(payload)} bytes came with a question for {self.key}; expected "
                f"at most {MAX_QUESTION}. (R0621)"
            )
        return bytes(payload.to_bytes())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        # A query that is kept makes the asker wait for its whole timeout.
        self._query.drop()

    def covers(self, key: str) -> bool:
        """Return whether the asker wants an answer for `key`."""
        return bool(self._query.key_expr.intersects(zenoh.KeyExpr(key)))

    def answer(
        self, key: str, payload: bytes, schema: str = "", stamp: bytes | None = None
    ) -> None:
        """Answer for `key`; refuse if a shared router would not let it through."""
        if why := fault(key):
            self.refuse(f"{key!r} {why}; expected a shorter name")
            return
        self._query.reply(key, payload, encoding=encoding(schema), attachment=stamp)

    def refuse(self, sentence: str) -> None:
        self._query.reply_err(sentence.encode())


Letter = Mail | Presence | Question | object


class Mailbox:
    """Queue of a session's callbacks, in the order in which messages came."""

    def __init__(self) -> None:
        self._queue: SimpleQueue[Any] = SimpleQueue()
        #: File anything for the owner's thread, also to wake it up. This is the queue's
        #: own C method: a Python method would hold the GIL in Zenoh's thread for
        #: longer, which costs up to 8 % of all ticks. So `bound` drops excess letters
        #: later.
        self.put: Callable[[Any], None] = self._queue.put
        #: a letter that was read, and is still to come
        self._held: Letter | None = None
        #: letters that were dropped
        self.dropped = 0
        _bounded.add(self)
        _start_warden()

    def bound(self) -> None:
        """Drop the oldest letters beyond MAX_LETTERS."""
        with suppress(Empty):
            while self._queue.qsize() > MAX_LETTERS:
                item = self._queue.get_nowait()
                self.dropped += 1
                # otherwise the asker waits for its whole timeout
                if type(item) is Question:
                    with item:
                        item.refuse("too much is waiting here; ask again later")

    def get(self, timeout: float | None = None) -> Letter | None:
        """Return the oldest letter; None if nothing came for `timeout` seconds."""
        if self._held is not None:
            held, self._held = self._held, None
            return held
        try:
            item: Letter = self._queue.get(timeout=timeout)
        except Empty:
            return None
        # Samples are filed raw: the callback holds Zenoh's thread and the GIL.
        if type(item) is zenoh.Sample:
            return Mail(item)
        return item

    def letters(self, most: int) -> Iterator[Letter]:
        """Yield the letters that are here, oldest first, at most so many."""
        if self._held is not None:
            held, self._held = self._held, None
            yield held
        get, sample = self._queue.get_nowait, zenoh.Sample
        try:
            for _ in range(min(most, self._queue.qsize())):
                letter = get()
                yield Mail(letter) if type(letter) is sample else letter
        except Empty:  # `bound` dropped some meanwhile
            return

    def run_of(self, keys: Container[str]) -> Iterator[Mail]:
        """Yield the letters that are mail with these keys, up to the first other."""
        if self._held is not None:
            return
        get, sample = self._queue.get_nowait, zenoh.Sample
        with suppress(Empty):
            while True:
                letter = get()
                mail = Mail(letter) if type(letter) is sample else None
                if mail is None or mail.key not in keys:
                    self._held = mail or letter
                    return
                yield mail

    def empty(self) -> bool:
        return self._held is None and self._queue.empty()


#: all mailboxes: each may fill while its owner is busy
_bounded: WeakSet[Mailbox] = WeakSet()


@cache
def _start_warden() -> None:
    """Start one thread per process that bounds all mailboxes."""
    Thread(target=_guard_mailboxes, name="mailboxes", daemon=True).start()


def _guard_mailboxes() -> None:
    pause = Event()
    while not pause.wait(BETWEEN):
        for box in list(_bounded):
            box.bound()
