"""MessageInlet: an In that takes messages in CDR, for an output that records.

What is written in this process becomes messages all at once: recording a crowd must
cost little beside what the crowd does.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

from rems_net.agents.ports import Messages
from rems_net.agents.tick import Tick
from rems_net.agents.verbs import CALLS
from rems_net.defdict import Schema, ToCdr, cdr
from rems_net.engine.inlet import Inlet, Network
from rems_net.engine.source import Conversion, Local, Value
from rems_net.engine.wiring import Entry


class Block:
    """Ports of one schema in this engine, which are due at the same ticks."""

    def __init__(self, sources: list[Local]):
        self._sources, self._first = sources, sources[0]
        self._encode = cdr(self._first.own[self._first.port].schema).encode
        self._keys = [one.key for one in sources]
        self._where = [(one.own, one.port) for one in sources]

    def take(self, tick: Tick, messages: Messages) -> None:
        """Add what they have written since the last call."""
        if self._first.is_due(tick):
            values = [own[port] for own, port in self._where]
            messages.update(zip(self._keys, map(self._encode, values), strict=True))

    def parted(self) -> list[Local]:
        """Return its sources, which know what was taken."""
        for one in self._sources:
            one.have = self._first.have
        return self._sources


class MessageInlet(Inlet):
    """One In whose value is `Messages`: only of ports that have written since."""

    _blocks: tuple[Block, ...] = ()

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
        self._blocks = tuple(map(Block, alike.values()))
        known = (source.entry for source in self.sources)
        messages.agents = {e.key: e.badge for e in known if e is not None}
        calls = [k for k, s in messages.schemas.items() if s.digest == CALLS.digest]
        messages.callers = sorted(calls)
        self.sources = [s for s in self.sources if not isinstance(s, Local)]

    def _conversion(self, key: str, theirs: Schema) -> Conversion:
        self.messages.schemas[key] = theirs
        return ToCdr(theirs)

    def fill(self, tick: Tick) -> None:
        """Add a message of each port that was written."""
        for block in self._blocks:
            block.take(tick, self.messages)
        self._take(tick)

    def _store(self, key: str, came: Value) -> None:
        self.messages[key] = came[0]
