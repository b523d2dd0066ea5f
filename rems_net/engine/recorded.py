"""MessageInlet: an In that takes messages in CDR, for an output that records.

The values of this process become messages all at once: recording a crowd must
cost little beside what the crowd does.
"""

from collections.abc import Mapping
from functools import cached_property, partial

from rems_net.agents.about.payloads import MANY, Later, Waiting
from rems_net.agents.about.wiring import Entry
from rems_net.agents.ports import Messages
from rems_net.agents.tick import Tick
from rems_net.agents.verbs import CALLS
from rems_net.defdict import Rows, Schema, cdr, row_codec
from rems_net.engine.inlet import Inlet, Network
from rems_net.engine.source import Conversion, Local, Source, Value


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
            if self._rows is None:
                messages.update(zip(self._keys, map(self._encode, values), strict=True))
            else:
                messages.rows.append(Rows(self._keys, self._rows.of_values(values)))

    def parted(self) -> list[Local]:
        """Return its sources, which know what was taken."""
        for one in self._sources:
            one.have = self._first.have
        return self._sources


class MessageInlet(Inlet):
    """One In whose value is `Messages`: only of ports that have written since."""

    _blocks: tuple[Block, ...] = ()
    _others: tuple[Source, ...] = ()

    @cached_property
    def messages(self) -> Messages:
        """The value, one object for ever: calls may come before the first tick."""
        #: payloads of other processes, by the digest of their schema
        self._waiting: dict[str, Waiting] = {}
        made = self._own[self.port] = Messages()
        return made

    def connect(self, entries: Mapping[str, Entry], network: Network | None) -> None:
        """Find the sources among all agents of the run, anew."""
        messages = self.messages
        parted = (one for block in self._blocks for one in block.parted())
        self.sources = [*self._others, *parted]
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
        self._others = tuple(s for s in self.sources if not isinstance(s, Local))
        self.sources = [] if network is None else network.together(self._others)

    def _conversion(self, key: str, theirs: Schema) -> Conversion:
        self.messages.schemas[key] = theirs
        waiting = self._waiting.setdefault(theirs.digest, Waiting(theirs))
        return Later(theirs, key, waiting)

    def fill(self, tick: Tick) -> None:
        """Add a message of each port that was written."""
        for block in self._blocks:
            block.take(tick, self.messages)
        self._take(tick)
        drop = partial(self._drop, tick=tick)
        for waiting in self._waiting.values():
            waiting.take(self.messages, drop)

    def _store(self, key: str, came: Value) -> None:
        if came[0]:
            self.messages[key] = came[0]
