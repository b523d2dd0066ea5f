"""Payloads of other processes, put aside until those of one schema make messages."""

from collections.abc import Callable, Iterable
from functools import cached_property

from rems_net.agents.ports import Messages
from rems_net.defdict import Rows, Schema, ToCdr, cdr, row_codec
from rems_net.errors import RemsError

#: Ports of one schema. From so many on, their messages are made as rows: more than the
#: robots of a run that has points of rays, which are made of single messages.
MANY = 50


class Later(ToCdr):
    """Payloads of one port, put aside until those of its schema make messages."""

    def __init__(self, schema: Schema, key: str, waiting: "Waiting") -> None:
        super().__init__(schema)
        self._key, self.waiting = key, waiting

    @cached_property
    def decode(self) -> Callable[[bytes], bytes]:
        """Put a payload aside. Returns b"": there is no message yet."""
        return self._wait

    def _wait(self, payload: bytes) -> bytes:
        self.waiting.keys.append(self._key)
        self.waiting.payloads.append(payload)
        return b""


class Waiting:
    """Payloads of one schema, from other processes."""

    def __init__(self, schema: Schema) -> None:
        self._codec, self._rows = cdr(schema), row_codec(schema)
        self.keys: list[str] = []
        self.payloads: list[bytes] = []

    def add(self, keys: Iterable[str], payloads: Iterable[bytes]) -> None:
        """Put payloads of these keys aside."""
        self.keys += keys
        self.payloads += payloads

    def take(self, messages: Messages, drop: Callable[[str, RemsError], None]) -> None:
        """Add their messages. drop: called with a key whose payload does not fit."""
        keys, payloads, rows = self.keys, self.payloads, None
        if self._rows is not None and len(keys) >= MANY:
            rows = self._rows.of_payloads(payloads)
        if rows is not None:
            messages.rows.append(Rows(tuple(keys), rows))
        else:
            for key, payload in zip(keys, payloads, strict=True):
                try:
                    messages[key] = self._codec.transcode(payload)
                except RemsError as error:
                    drop(key, error)
        self.keys, self.payloads = [], []
