"""Inlet: how a host fills one of an agent's Ins."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rems_net.agents.agent import PHASES, Agent
from rems_net.agents.host.inbox import Inbox
from rems_net.agents.protocol.complaints import KINDS, kind_of
from rems_net.agents.protocol.roster import Entry, Roster, Source, resolve
from rems_net.agents.tick import Tick, time_of
from rems_net.defdict import Converter, DefDict, Schema
from rems_net.errors import RemsError
from rems_net.router.keys import STEP
from rems_net.router.mail import Mail


class Feed:
    """One source of one In: where it comes from and how it becomes a value."""

    __slots__ = ("converter", "entry", "have", "key", "local", "mail", "source")

    def __init__(
        self, source: Source, key: str, converter: Converter, local: Agent | None
    ):
        self.source, self.key, self.converter, self.local = (
            source,
            key,
            converter,
            local,
        )
        self.entry: Entry = source.entry
        #: the tick of the value it has, in lock-step
        self.have = 0
        #: the newest that came from a free-running agent
        self.mail: Mail | None = None


class Inlet:
    """One In of one agent.

    source: what it is connected to; None where it is told from outside.
    key: makes a full key of chunks.  warn: called with a sentence.
    """

    def __init__(
        self,
        agent: Agent,
        port: str,
        source: str | None,
        key: Callable[..., str],
        warn: Callable[[str], None],
    ):
        self.agent, self.port, self.source = agent, port, source
        self._full, self._warn = key, warn
        self.phase = PHASES.index(agent.kind)
        live = agent.__dict__.get(port)
        #: None for an In that takes what a glob matches: its value is a plain dict
        self.schema: Schema | None = None if live is None else live.schema
        self.feeds: list[Feed] = []
        self.key = key(agent.key, port)
        self.dropped = 0
        #: of what was dropped, by kind of reason: how often, and what was said of one
        self._reasons: dict[str, list[Any]] = {}
        self._many = source is not None and "*" in source
        #: whether nobody is to be told that its glob matches nothing: it was, or the
        #: glob is the class's own, for whoever may be there
        self._lonely = source == agent.ins()[port].source
        #: whether it was told that several write what it reads
        self._mixed = False
        #: a robot's command that is connected: another program commands in vain
        self._deaf = source is not None and agent.kind == "robot"
        if self.schema is None:
            agent.__dict__[port] = {}

    @property
    def is_told(self) -> bool:
        """Whether it listens at its own key, where any program may put something."""
        return self.source is None or self._deaf

    def watched(self) -> set[str]:
        """The keys that have to be watched for it."""
        if self.source is None:
            return {self.key}
        kind, name, *port = self.source.split("/")
        written = [kind, name, *(port or "*")]
        if self.agent.in_step:  # a reader that nobody waits for takes what it gets
            written.insert(2, STEP)
        keys = {self._full(*written)}
        return keys | {self.key} if self._deaf else keys

    def connect(
        self,
        roster: Roster,
        agents: Mapping[str, Agent],
        schema: Callable[[Roster, str], Schema],
    ) -> None:
        """Find the sources anew; raises ExperimentError or ConversionError.

        agents: those of this host.  schema: the one of a digest in the roster.
        """
        if self.source is None:
            return
        old = {feed.source.key: feed for feed in self.feeds}
        self.feeds = []
        for source in self._resolve(roster):
            if source.key in old and old[source.key].entry == source.entry:
                self.feeds.append(old[source.key])
                continue
            written = schema(roster, source.digest)
            if self.schema is None and not self._many:
                # On an open fabric its one source comes when it comes.
                self.agent.settle(self.port, written)
                self.schema = written
            wanted = self.schema or written
            converter = written.converter(
                wanted,
                source_label=source.key,
                target_label=f"{self.agent.key}/{self.port}",
            )
            local = agents.get(source.entry.key)
            key = self._full(source.key)
            self.feeds.append(Feed(source, key, converter, local))
            if self.schema is None:
                self.agent.__dict__[self.port][source.key] = wanted()
        if self.agent.kind == "process" and any(
            roster.hears_itself(self.agent.key, feed.entry.key) for feed in self.feeds
        ):
            self.agent.feedback.add(self.port)
        if not self.feeds and "*" in self.source and not self._lonely:
            self._lonely = True
            self._warn(
                f"{self.agent.key}/{self.port} reads {self.source!r}, which matches "
                "nothing yet."
            )
        if self.schema is not None and len(self.feeds) > 1 and not self._mixed:
            self._mixed = True  # before a run this is refused; here they come and go
            a, b, *more = (feed.source.key for feed in self.feeds)
            self._warn(
                f"{self.agent.key}/{self.port} has a schema, so it reads one port, and "
                f"{self.source!r} matches {2 + len(more)}, {a} and {b} among them: it "
                "takes what comes last. Name one."
            )
        if self.schema is None:
            live = self.agent.__dict__[self.port]
            for key in [k for k in live if k not in {f.source.key for f in self.feeds}]:
                del live[key]

    def _resolve(self, roster: Roster) -> list[Source]:
        assert self.source is not None
        writer = "/".join(self.source.split("/")[:2])
        if "*" not in self.source and writer not in roster.agents:
            return []  # its writer has left: the last value stays, and ages
        reader = f"{self.agent.key}.{self.port}"
        return resolve(self.source, roster.agents, reader, self.agent.key)

    def fill(self, tick: Tick, inbox: Inbox) -> None:
        """Bring the In up to what the roster says it must have at this tick."""
        if self.source is None:
            self._fill_from_outside(tick, inbox)
            return
        if self._deaf and inbox.seat.latest.pop(self.key, None) is not None:
            error = RemsError(f"it is told by {self.source}, and by nobody else.")
            self._drop("a program outside the experiment", error, tick)
        for feed in self.feeds:
            entry = feed.entry
            if not entry.lockstep or not self.agent.in_step:
                self._fill_free(feed, tick, inbox)
                continue
            need = entry.due(tick.n if entry.phase < self.phase else tick.n - 1)
            if need == feed.have:
                continue
            try:
                if feed.local is not None:
                    value = feed.converter(feed.local.__dict__[feed.source.port])
                    said = feed.local.origin
                else:
                    came = inbox.value(feed.key, need, entry)
                    if came is None:  # its writer has left, at this very tick
                        self._forget(feed)
                        continue
                    value, said = feed.converter.decode(came.payload), came.said
            except RemsError as error:
                feed.have = need
                self._drop(feed.source.key, error, tick)
                continue
            feed.have = need
            self._store(feed.source.key, value, said, tick)

    def _fill_free(self, feed: Feed, tick: Tick, inbox: Inbox) -> None:
        """Between agents of which one is free-running: what came last, if new."""
        newest = inbox.seat.latest.get(feed.key)
        if feed.local is None and (newest is None or newest[0] is feed.mail):
            return
        said = tick.n - 1
        try:
            if feed.local is not None:
                value = feed.converter(feed.local.__dict__[feed.source.port])
                said = feed.local.origin
            elif newest is not None:
                feed.mail, stamp = newest
                value = feed.converter.decode(feed.mail.payload)
                said = min(stamp.said, said)
        except RemsError as error:
            self._drop(feed.source.key, error, tick)
            return
        self._store(feed.source.key, value, said, tick)

    def _fill_from_outside(self, tick: Tick, inbox: Inbox) -> None:
        """A port nobody in the experiment writes takes what is put at its own key."""
        came = inbox.seat.latest.pop(self.key, None)
        if came is None or self.schema is None:
            return
        mail, stamp = came
        try:
            value = self._decode_foreign(mail)
        except RemsError as error:
            self._drop("a program outside the experiment", error, tick)
            return
        # Who stamps it with the tick of the state he answers to says how old it is.
        said = tick.n - 1 if stamp.n < 0 else min(stamp.said, tick.n - 1)
        self._store("", value, said, tick)

    def _decode_foreign(self, mail: Mail) -> DefDict:
        assert self.schema is not None
        name, at, digest = mail.schema.rpartition("@")
        if at and digest != self.schema.digest:
            raise RemsError(
                f"it is encoded as {name!r} with digest {digest}, and {self.key} takes "
                f"{self.schema.name}@{self.schema.digest}; send its own units, and the "
                "encoding 'application/msgpack'."
            )
        return self.schema.decode(mail.payload)

    def _forget(self, feed: Feed) -> None:
        if self.schema is None:
            self.agent.__dict__[self.port].pop(feed.source.key, None)

    def _store(self, source: str, value: DefDict, said: int, tick: Tick) -> None:
        if self.schema is None:
            self.agent.__dict__[self.port][source] = value
        else:
            self.agent.__dict__[self.port] = value
        if self._many:  # of a crowd the newest counts: one that left holds up nobody
            said = max(said, self.agent.said.get(self.port, 0))
        self.agent.said[self.port] = said
        self.agent.heard[self.port] = time_of(said, tick.dt)

    def _drop(self, source: str, error: RemsError, tick: Tick) -> None:
        """A value that does not fit never kills an agent; nor is it hidden."""
        self.dropped += 1
        sentence = str(error)
        kind = kind_of(sentence)
        if kind not in self._reasons and len(self._reasons) >= KINDS:
            kind, sentence = "", "for other reasons"
        reason = self._reasons.setdefault(kind, [0, sentence])
        reason[0] += 1
        if reason[0] == 1 or self.dropped % 1000 == 0:
            self._warn(
                f"{self.agent.key}/{self.port} dropped a value from {source} "
                f"({self.dropped} so far, now at {tick.t:g} s): {error}"
            )

    def why(self) -> dict[str, Any]:
        """For people: when it heard what last, and what was dropped. For any thread."""
        return {
            "source": self.source or "",
            "heard": self.agent.heard.get(self.port),
            "dropped": self.dropped,
            "reasons": [[n, said] for n, said in list(self._reasons.values())],
        }

    def total(self) -> None:
        """At the end: how many values were dropped, and why."""
        if self.dropped:
            values = "1 value" if self.dropped == 1 else f"{self.dropped} values"
            why = " ".join(f"{n} x: {said}" for n, said in self._reasons.values())
            self._warn(f"{self.agent.key}/{self.port} dropped {values} in all. {why}")
