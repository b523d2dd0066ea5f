"""MessageInlet: an In that takes messages in CDR, for an output that records.

What is written in this process becomes messages all at once: recording a crowd must
cost little beside what the crowd does.
"""

from __future__ import annotations

from collections.abc import Mapping

from rems_net.agents.ports import Messages
from rems_net.agents.tick import Tick
from rems_net.defdict import Schema, ToCdr, cdr
from rems_net.engine.inlet import Inlet, Network
from rems_net.engine.source import Conversion, Gone, Local, Source
from rems_net.engine.wiring import Entry
from rems_net.errors import RemsError


class Block:
    """Ports of one schema in this engine, which are due at the same ticks."""

    def __init__(self, sources: list[Local]):
        self._sources, self._first = sources, sources[0]
        self._encode = cdr(self._first.own[self._first.port].schema).encode
        self._where = [(one.key, one.own, one.port) for one in sources]

    def take(self, tick: Tick, messages: Messages) -> None:
        """Add what they have written since the last call."""
        if self._first.is_due(tick):
            encode = self._encode
            for key, own, port in self._where:
                messages[key] = encode(own[port])

    def part(self) -> None:
        """Let each source know what was taken."""
        for one in self._sources:
            one.have = self._first.have


class MessageInlet(Inlet):
    """One In whose value is `Messages`: only of ports that have written since."""

    _blocks: tuple[Block, ...] = ()
    _others: tuple[Source, ...] = ()

    def connect(self, entries: Mapping[str, Entry], network: Network | None) -> None:
        """Find the sources among all agents of the run, anew."""
        if not isinstance(self.agent.__dict__[self.port], Messages):
            self.agent.__dict__[self.port] = Messages()
        for block in self._blocks:
            block.part()
        super().connect(entries, network)
        alike: dict[object, list[Local]] = {}
        for source in self.sources:
            if isinstance(source, Local):
                alike.setdefault(source.alike(), []).append(source)
        self._blocks = tuple(map(Block, alike.values()))
        self._others = tuple(s for s in self.sources if not isinstance(s, Local))

    def _conversion(self, key: str, theirs: Schema) -> Conversion:
        self.agent.__dict__[self.port].schemas[key] = theirs
        return ToCdr(theirs)

    def fill(self, tick: Tick) -> None:
        """Add a message of each port that was written."""
        messages: Messages = self.agent.__dict__[self.port]
        for block in self._blocks:
            block.take(tick, messages)
        for source in self._others:
            try:
                came = source.take(tick)
            except RemsError as error:
                self._drop(source.label, error, tick)
            except Gone:
                messages.pop(source.key, None)
            else:
                if came is not None:
                    messages[source.key] = came.value
