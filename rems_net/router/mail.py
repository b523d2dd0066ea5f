"""Mail: what Zenoh's threads have filed for whoever reads it in a thread of its own."""

from __future__ import annotations

from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import Any, NamedTuple, Self

import zenoh

from rems_net.errors import WireError
from rems_net.router.message import pack, read

#: A payload above this size is not decoded.
MAX_PAYLOAD = 16 * 1024 * 1024

_ENCODING = "application/msgpack"


def encoding(schema: str) -> str:
    """`application/msgpack` of a schema, named `<schema name>@<digest>`."""
    return f"{_ENCODING};{schema}" if schema else _ENCODING


def pack_stamp(tick: int, time: float) -> bytes:
    """The attachment of a value: when, in fabric time."""
    return pack((tick, time))


class Mail:
    """A value that came. What is not asked for is not decoded."""

    __slots__ = ("_sample", "key")

    def __init__(self, sample: zenoh.Sample):
        self._sample = sample
        self.key = str(sample.key_expr)

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

    def stamp(self) -> tuple[int, float]:
        """The tick and fabric time [s] of the value; (-1, 0.0) where it has none."""
        attachment = self._sample.attachment
        if attachment is not None:
            try:
                tick, time = read(attachment.to_bytes())
                return int(tick), float(time)
            except (ValueError, TypeError):
                pass  # not one of ours: a value without a tick
        return -1, 0.0

    def __repr__(self) -> str:
        return f"<Mail {self.key} {self.stamp()} {len(self.payload)} bytes>"


class Presence(NamedTuple):
    """An agent that came or went."""

    key: str
    alive: bool


class Question:
    """Somebody asks for a key; answer once or more, then it is done by `with`."""

    __slots__ = ("_query", "key", "parameters", "payload", "topic")

    def __init__(self, query: zenoh.Query, topic: str = ""):
        self._query: Any = query  # zenoh's stub leaves `drop` without types
        #: which of several answerers it came to: a glob comes to each
        self.topic = topic
        self.key = str(query.key_expr)
        given = (p.partition("=") for p in str(query.parameters).split(";") if p)
        self.parameters = {key: value for key, _, value in given}
        self.payload = b"" if query.payload is None else query.payload.to_bytes()

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
        self._query.reply(key, payload, encoding=encoding(schema), attachment=stamp)

    def refuse(self, sentence: str) -> None:
        self._query.reply_err(sentence.encode())


Letter = Mail | Presence | Question | object


class Mailbox:
    """Where a session's callbacks put what came, in the order in which it came."""

    def __init__(self) -> None:
        self._queue: SimpleQueue[Any] = SimpleQueue()
        #: Files anything for the owner's thread: also used to wake it up.
        self.put: Callable[[Any], None] = self._queue.put

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
