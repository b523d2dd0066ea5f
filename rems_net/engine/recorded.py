"""MessageInlet: an In that takes messages in CDR, for an output that records.

The values of this process become messages all at once: recording a crowd must
cost little beside what the crowd does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property

from rems_net.agents.ports import Messages
from rems_net.agents.tick import Tick
from rems_net.agents.verbs import CALLS
from rems_net.defdict import Rows, Schema, ToCdr, cdr, row_codec
from rems_net.engine.inlet import Inlet, Network
from rems_net.engine.source import Conversion, Local, Value
from rems_net.engine.wiring import Entry
from rems_net.errors import RemsError

#: Ports of one schema. From so many on, their messages are made as rows: more than the
#: robots of a run that has points of rays, which are made of single messages.
MANY = 50


class Block:
    """Ports of one schema in this engine, which are due at the same ticks."""

    def __init__(self, sources: list[Local]):
        self._sources, self._first = sources, sources[0]
        schema = self._first.own[self._first.port].schema
        self._encode = cdr(schema).encode
        self._rows = row_codec(schema) if len(sources) >= MANY else None
        self._keys = tuple(one.key for one in sources)
        self._where = [(one.own, one.port) for one in sources]

    def take(self, tick: Tick, messages: Messages) -> None:
        """Add what they have written since the last call."""
        if self._first.is_due(tick):
            values = [own[port] for own, port in self._where]
            if self._rows is not None:
                rows = Rows(self._keys, self._rows.of_values(values))
                messages.rows.append(rows)
                return
            messages.update(zip(self._keys, map(self._encode, values), strict=True))

    def parted(self) -> list[Local]:
        """Return its sources, which know what was taken."""
        for one in self._sources:
            one.have = self._first.have
        return self._sources


class Later(ToCdr):
    """Payloads of one port, put aside until those of its schema make messages."""

    def __init__(self, schema: Schema, key: str, waiting: Waiting) -> None:
        super().__init__(schema)
        self._key, self._waiting = key, waiting

    @cached_property
    def decode(self) -> Callable[[bytes], bytes]:
        """Put a payload aside. Returns b"": there is no message yet."""
        return self._wait

    def _wait(self, payload: bytes) -> bytes:
        self._waiting.keys.append(self._key)
        self._waiting.payloads.append(payload)
        return b""


class Waiting:
    """Payloads of one schema, from other processes."""

    def __init__(self, schema: Schema) -> None:
        self._codec, self._rows = cdr(schema), row_codec(schema)
        self.keys: list[str] = []
        self.payloads: list[bytes] = []

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


class MessageInlet(Inlet):
    """One In whose value is `Messages`: only of ports that have written since."""

    _blocks: tuple[Block, ...] = ()

    @cached_property
    def _waiting(self) -> dict[str, Waiting]:
        """Payloads of other processes, by the digest of their schema."""
        return {}

    @cached_property
    def messages(self) -> Messages:
        """The value, one object for ever: calls may come before the first tick."""
        made = self._own[self.port] = Messages()
        return made

    def connect(self, entries: Mapping[str, Entry], network: Network | None) -> None:
        """Find the sources among all agents of the run, anew."""
        messages = self.messages
        self.sources += [one for block in self._blocks for one in block.parted()]
        super().connect(entries, network)
        alike: dict[object, list[Local]] = {}
        for source in self.sources:
            if isinstance(source, Local):
                alike.setdefault(source.alike(), []).append(source)
        self._blocks = tuple(
            Block(sorted(some, key=lambda one: one.key)) for some in alike.values()
        )
        known = (source.entry for source in self.sources)
        messages.agents = {e.key: e.badge for e in known if e is not None}
        calls = [k for k, s in messages.schemas.items() if s.digest == CALLS.digest]
        messages.callers = sorted(calls)
        self.sources = [s for s in self.sources if not isinstance(s, Local)]

    def _conversion(self, key: str, theirs: Schema) -> Conversion:
        self.messages.schemas[key] = theirs
        waiting = self._waiting.setdefault(theirs.digest, Waiting(theirs))
        return Later(theirs, key, waiting)

    def fill(self, tick: Tick) -> None:
        """Add a message of each port that was written."""
        for block in self._blocks:
            block.take(tick, self.messages)
        self._take(tick)

        def drop(key: str, error: RemsError) -> None:
            self._drop(key, error, tick)

        for waiting in self._waiting.values():
            waiting.take(self.messages, drop)

    def _store(self, key: str, came: Value) -> None:
        if came[0]:
            self.messages[key] = came[0]
