"""Mail: what Zenoh's threads have filed for whoever reads it in a thread of its own."""

from collections.abc import Callable
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

#: A value above this size is not decoded, bytes.
MAX_PAYLOAD = 16 * 1024 * 1024
#: A question above this size is not read, bytes: a call of a verb, a host that joins.
MAX_QUESTION = 32 * 1024 * 1024
#: Letters that wait in a mailbox. What does not fit is dropped, which costs time only:
#: whatever matters is said again, or asked for.
MAX_LETTERS = 50_000
#: seconds between two looks at how many there are
BETWEEN = 0.5

_ENCODING = "application/msgpack"


def encoding(schema: str) -> str:
    """`application/msgpack` of a schema, named `<schema name>@<digest>`."""
    return f"{_ENCODING};{schema}" if schema else _ENCODING


class Mail:
    """A value that came. What is not asked for is not decoded."""

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
        """What was sent. Raises WireError above MAX_PAYLOAD, before it is copied."""
        size = len(self._sample.payload)
        if size > MAX_PAYLOAD:
            raise WireError(
                f"{self.key}: {size} bytes came; expected at most {MAX_PAYLOAD}."
            )
        return self._sample.payload.to_bytes()

    @property
    def schema(self) -> str:
        """`<schema name>@<digest>`, or nothing where the sender named none."""
        return str(self._sample.encoding).partition(";")[2]

    @property
    def attachment(self) -> bytes:
        """Its stamp as it came; nothing where there is none."""
        attachment = self._sample.attachment
        return b"" if attachment is None else attachment.to_bytes()

    def stamp(self) -> Stamp:
        """When it was written, and by whom; UNSTAMPED where nobody says.

        Raises WireError for an attachment that is no stamp.
        """
        attachment = self._sample.attachment
        return UNSTAMPED if attachment is None else read_stamp(attachment.to_bytes())

    def __repr__(self) -> str:
        return f"<Mail {self.key} {len(self._sample.payload)} bytes>"


class Presence(NamedTuple):
    """An agent that came or went."""

    key: str
    alive: bool


class Question:
    """Somebody asks for a key; answer once or more, then it is done by `with`."""

    __slots__ = ("_query", "key", "parameters", "topic")

    def __init__(self, query: zenoh.Query, topic: str = ""):
        self._query: Any = query  # zenoh's stub leaves `drop` without types
        #: which of several answerers it came to: a glob comes to each
        self.topic = topic
        self.key = str(query.key_expr)
        given = (p.partition("=") for p in str(query.parameters).split(";") if p)
        self.parameters = {key: value for key, _, value in given}

    @property
    def size(self) -> int:
        """Bytes of what came with it."""
        payload = self._query.payload
        return 0 if payload is None else len(payload)

    @property
    def payload(self) -> bytes:
        """What came with it. Raises WireError above MAX_QUESTION, uncopied."""
        payload = self._query.payload
        if payload is None:
            return b""
        if len(payload) > MAX_QUESTION:
            raise WireError(
                f"{len(payload)} bytes came with a question for {self.key}; expected "
                f"at most {MAX_QUESTION}."
            )
        return bytes(payload.to_bytes())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        # A query that is kept makes the asker wait for its whole timeout.
        self._query.drop()

    def covers(self, key: str) -> bool:
        """Whether an answer for `key` is one the asker wants."""
        return bool(self._query.key_expr.intersects(zenoh.KeyExpr(key)))

    def answer(
        self, key: str, payload: bytes, schema: str = "", stamp: bytes | None = None
    ) -> None:
        """Answer for `key`; refuse if a shared router would not let that through."""
        if why := fault(key):
            self.refuse(f"{key!r} {why}; expected a shorter name")
            return
        self._query.reply(key, payload, encoding=encoding(schema), attachment=stamp)

    def refuse(self, sentence: str) -> None:
        self._query.reply_err(sentence.encode())


Letter = Mail | Presence | Question | object


class Mailbox:
    """Where a session's callbacks put what came, in the order in which it came."""

    def __init__(self) -> None:
        self._queue: SimpleQueue[Any] = SimpleQueue()
        #: Files anything for the owner's thread: also used to wake it up. Not a method
        #: of our own: Zenoh's thread would hold the GIL for longer, which costs a third
        #: of all ticks. So what is too much is thrown out later, by `bound`.
        self.put: Callable[[Any], None] = self._queue.put
        #: letters that were thrown out
        self.dropped = 0
        _bounded.add(self)
        _start_warden()

    def bound(self) -> None:
        """Throw out the oldest letters that are too many."""
        with suppress(Empty):
            while self._queue.qsize() > MAX_LETTERS:
                item = self._queue.get_nowait()
                self.dropped += 1
                if type(item) is Question:  # else who asks waits for his whole timeout
                    with item:
                        item.refuse("too much is waiting here; ask again later")

    def get(self, timeout: float | None = None) -> Letter | None:
        """The oldest letter; None when nothing came for `timeout` seconds."""
        try:
            item: Letter = self._queue.get(timeout=timeout)
        except Empty:
            return None
        # Samples are filed raw: the callback holds Zenoh's thread and the GIL.
        if type(item) is zenoh.Sample:
            return Mail(item)
        return item

    def empty(self) -> bool:
        return self._queue.empty()


#: mailboxes whose owners may be busy while they fill
_bounded: WeakSet[Mailbox] = WeakSet()


@cache
def _start_warden() -> None:
    """Once in a process: look after all its mailboxes, whatever their owners do."""
    Thread(target=_guard_mailboxes, name="mailboxes", daemon=True).start()


def _guard_mailboxes() -> None:
    pause = Event()
    while not pause.wait(BETWEEN):
        for box in list(_bounded):
            box.bound()
