"""Inlets and outlets: how a host fills an agent's Ins and publishes its Outs."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from rems_net.agents.agent import PHASES, Agent
from rems_net.agents.roster import Entry, Roster, Source, resolve
from rems_net.agents.tick import AHEAD, Tick
from rems_net.defdict import Converter, DefDict, Schema
from rems_net.errors import RemsError
from rems_net.router.session import Mail, Publisher, pack_stamp

if TYPE_CHECKING:
    from rems_net.agents.host import Host


class Outlet:
    """One port of one agent, on its way out. Unwanted values cost no encoding."""

    __slots__ = ("agent", "digest", "key", "n", "port", "publisher", "recent", "wanted")

    def __init__(self, agent: Agent, port: str, key: str, publisher: Publisher):
        self.agent, self.port, self.key = agent, port, key
        self.publisher = publisher
        self.digest = agent.__dict__[port].schema.digest
        #: whether the roster names a reader in another host
        self.wanted = False
        self.n = 0
        #: the last payloads: a reader may be that much behind, and need the one before
        self.recent: deque[tuple[int, bytes, bytes]] = deque(maxlen=AHEAD + 2)

    def publish(self, n: int, stamp: bytes) -> None:
        self.n = n
        if self.wanted or self.publisher.watched:
            payload = self.agent.__dict__[self.port].encode()
            self.recent.append((n, payload, stamp))
            self.publisher.put_raw(payload, attachment=stamp)

    def want(self, wanted: bool) -> None:
        """Take in whether another host reads it, from the next tick on.

        Who begins to read may need the value of the tick before: it is kept now.
        """
        if wanted and not self.wanted and self.n:
            stamp = pack_stamp(self.n, self.agent.tick.t)
            self.recent.append((self.n, self.value.encode(), stamp))
        self.wanted = wanted

    @property
    def value(self) -> DefDict:
        return self.agent.__dict__[self.port]  # type: ignore[no-any-return]


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
    """One In of one agent."""

    def __init__(self, host: Host, agent: Agent, port: str, source: str | None):
        self.host, self.agent, self.port, self.source = host, agent, port, source
        self.phase = PHASES.index(agent.kind)
        live = agent.__dict__.get(port)
        #: None for an In that takes its sources' schemas: its value is a plain dict
        self.schema: Schema | None = None if live is None else live.schema
        self.feeds: list[Feed] = []
        self.key = host.session.key(agent.key, port)
        self.dropped = 0
        #: whether nobody is to be told that its glob matches nothing: it was, or the
        #: glob is the class's own, for whoever may be there
        self._lonely = source == agent.ins()[port].source
        #: a robot's command that is connected: another program commands in vain
        self._deaf = source is not None and agent.kind == "robot"
        if self.schema is None:
            agent.__dict__[port] = {}

    def watched(self) -> set[str]:
        """The keys that have to be watched for it."""
        if self.source is None:
            return {self.key}
        port = "" if self.source.count("/") == 2 else "/*"
        written = self.host.session.key(self.source) + port
        return {written, self.key} if self._deaf else {written}

    def connect(self, roster: Roster) -> None:
        """Find the sources anew; raises ExperimentError or ConversionError."""
        if self.source is None:
            return
        old = {feed.source.key: feed for feed in self.feeds}
        self.feeds = []
        for source in self._resolve(roster):
            if source.key in old and old[source.key].entry == source.entry:
                self.feeds.append(old[source.key])
                continue
            written = self.host.schema(roster, source.digest)
            wanted = self.schema or written
            converter = written.converter(
                wanted,
                source_label=source.key,
                target_label=f"{self.agent.key}/{self.port}",
            )
            local = self.host.agents.get(source.entry.key)
            key = self.host.session.key(source.key)
            self.feeds.append(Feed(source, key, converter, local))
            if self.schema is None:
                self.agent.__dict__[self.port][source.key] = wanted()
        if not self.feeds and "*" in self.source and not self._lonely:
            self._lonely = True
            self.host.warn(
                f"{self.agent.key}/{self.port} reads {self.source!r}, which matches "
                "nothing yet."
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
        return [
            s
            for s in resolve(
                self.source, roster.agents, f"{self.agent.key}.{self.port}"
            )
            if s.entry.key != self.agent.key
        ]

    def fill(self, tick: Tick) -> None:
        """Bring the In up to what the roster says it must have at this tick."""
        if self.source is None:
            self._fill_from_outside(tick)
            return
        if self._deaf and self.host.letters.latest.pop(self.key, None) is not None:
            error = RemsError(f"it is told by {self.source}, and by nobody else.")
            self._drop("a program outside the experiment", error, tick)
        for feed in self.feeds:
            entry = feed.entry
            if not entry.lockstep or not self.agent.lockstep:
                self._fill_free(feed, tick)
                continue
            need = entry.due(tick.n if entry.phase < self.phase else tick.n - 1)
            if need == feed.have:
                continue
            try:
                if feed.local is not None:
                    value = feed.converter(feed.local.__dict__[feed.source.port])
                else:
                    payload = self.host.letters.value(feed.key, need, entry)
                    if payload is None:  # its writer has left, at this very tick
                        self._forget(feed)
                        continue
                    value = feed.converter.decode(payload)
            except RemsError as error:
                feed.have = need
                self._drop(feed.source.key, error, tick)
                continue
            feed.have = need
            self._store(feed.source.key, value, tick.t - (tick.n - need) * tick.dt)

    def _fill_free(self, feed: Feed, tick: Tick) -> None:
        """Between agents of which one is free-running: what came last, if new."""
        mail = self.host.letters.latest.get(feed.key)
        if feed.local is None and (mail is None or mail is feed.mail):
            return
        feed.mail = mail
        try:
            if feed.local is not None:
                value = feed.converter(feed.local.__dict__[feed.source.port])
            elif mail is not None:
                value = feed.converter.decode(mail.payload)
        except RemsError as error:
            self._drop(feed.source.key, error, tick)
            return
        self._store(feed.source.key, value, tick.t - tick.dt)

    def _fill_from_outside(self, tick: Tick) -> None:
        """A port nobody in the experiment writes takes what is put at its own key."""
        mail = self.host.letters.latest.pop(self.key, None)
        if mail is None or self.schema is None:
            return
        try:
            value = self._decode_foreign(mail)
        except RemsError as error:
            self._drop("a program outside the experiment", error, tick)
            return
        self._store("", value, tick.t - tick.dt)

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

    def _store(self, source: str, value: DefDict, time: float) -> None:
        if self.schema is None:
            self.agent.__dict__[self.port][source] = value
        else:
            self.agent.__dict__[self.port] = value
        self.agent.heard[self.port] = time

    def _drop(self, source: str, error: RemsError, tick: Tick) -> None:
        """A value that does not fit never kills an agent; nor is it hidden."""
        self.dropped += 1
        if self.dropped == 1 or self.dropped % 1000 == 0:
            self.host.warn(
                f"{self.agent.key}/{self.port} dropped a value from {source} "
                f"({self.dropped} so far, now at {tick.t:g} s): {error}"
            )
