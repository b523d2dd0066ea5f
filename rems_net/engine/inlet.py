"""Inlet: one In of one agent, filled at each tick from its sources."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rems_net.agents.agent import PHASES, Agent
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick
from rems_net.defdict import Converter, Schema
from rems_net.engine.complaints import KINDS, kind_of
from rems_net.engine.source import Gone, Local, Source, Value
from rems_net.engine.wiring import Entry, Written, reads_itself, resolve
from rems_net.errors import RemsError
from rems_net.events import warn

#: makes a source that is no agent of this engine
Elsewhere = Callable[["Inlet", Written, Converter], Source]


class Inlet:
    """One In of one agent.

    source: what it is connected to; None if programs outside may put a value there.
    """

    def __init__(self, agent: Agent, port: str, source: str | None):
        self.agent, self.port, self.source = agent, port, source
        self.key = f"{agent.key}/{port}"
        self.phase = PHASES.index(agent.kind)
        self.run = runtime(agent)
        live = agent.__dict__.get(port)
        #: None for an In that takes all that a glob matches: its value is a plain dict
        self.schema: Schema | None = None if live is None else live.schema
        self.sources: list[Source] = []
        #: sources that are there whoever is in the run
        self.steady: list[Source] = []
        self.dropped = 0
        #: why values were dropped, by kind of reason: how often, and one sentence
        self._reasons: dict[str, list[Any]] = {}
        self._many = source is not None and "*" in source
        #: whether no warning is due that its glob matches nothing: it was given, or
        #: the class itself has the glob, for agents that may be there
        self._lonely = source == agent.ins()[port].source
        #: whether the warning was given that it reads more than one port
        self._mixed = False
        if self.schema is None:
            agent.__dict__[port] = {}

    def connect(
        self,
        entries: Mapping[str, Entry],
        agents: Mapping[str, Agent],
        schema: Callable[[str], Schema],
        elsewhere: Elsewhere,
    ) -> None:
        """Find the sources anew. Raises ExperimentError or ConversionError.

        entries: all agents of the run.  agents: those of this engine.  schema: of a
        digest.  elsewhere: makes the source of a port that another process writes.
        """
        if self.source is None:
            return
        old = {s.key: s for s in self.sources if s.entry is not None}
        self.sources = [*self.steady]
        read = self._resolve(entries)
        for written in read:
            known = old.get(written.key)
            if known is not None and known.entry == written.entry:
                self.sources.append(known)
                continue
            self.sources.append(self._made(written, agents, schema, elsewhere))
        if self.agent.kind == "process" and any(
            reads_itself(entries, self.agent.key, one.entry.key) for one in read
        ):
            self.run.feedback.add(self.port)
        self._check(read)
        if self.schema is None:
            live, keys = self.agent.__dict__[self.port], {one.key for one in read}
            for key in [k for k in live if k not in keys]:
                del live[key]

    def _made(
        self,
        written: Written,
        agents: Mapping[str, Agent],
        schema: Callable[[str], Schema],
        elsewhere: Elsewhere,
    ) -> Source:
        theirs = schema(written.digest)
        if self.schema is None and not self._many:
            # On an open fabric its one source may come later than the agent.
            self.agent.settle(self.port, theirs)
            self.schema = theirs
        wanted = self.schema or theirs
        converter = theirs.converter(
            wanted, source_label=written.key, target_label=self.key
        )
        if self.schema is None:
            self.agent.__dict__[self.port][written.key] = wanted()
        entry = written.entry
        local = agents.get(entry.key)
        if local is None or not entry.lockstep or not self.run.in_step:
            return elsewhere(self, written, converter)
        made = Local(entry, local, written.port, converter)
        made.earlier = entry.phase < self.phase
        return made

    def _check(self, read: list[Written]) -> None:
        """Warn, once each, of a glob that matches nothing or too much."""
        if not read and self._many and not self._lonely:
            self._lonely = True
            self._warn("glob", f"reads {self.source!r}, which matches nothing yet.")
        if self.schema is not None and len(read) > 1 and not self._mixed:
            self._mixed = True  # refused before a run; on an open fabric they come
            a, b, *more = (one.key for one in read)
            self._warn(
                "glob",
                f"has a schema, so it reads one port, and {self.source!r} "
                f"matches {2 + len(more)}, {a} and {b} among them: it takes what comes "
                "last. Name one.",
            )

    def _warn(self, kind: str, text: str, tick: int = 0) -> None:
        warn(kind, f"{self.key} {text}", self.agent.key, tick)

    def _resolve(self, entries: Mapping[str, Entry]) -> list[Written]:
        assert self.source is not None
        writer = "/".join(self.source.split("/")[:2])
        if "*" not in self.source and writer not in entries:
            return []  # its writer has left: the last value stays, and ages
        reader = f"{self.agent.key}.{self.port}"
        return resolve(self.source, entries, reader, self.agent.key)

    def fill(self, tick: Tick) -> None:
        """Bring the In up to what it must have at this tick."""
        for source in self.sources:
            try:
                came = source.take(tick)
            except RemsError as error:
                self._drop(source.label, error, tick)
            except Gone:
                if self.schema is None:
                    self.agent.__dict__[self.port].pop(source.key, None)
            else:
                if came is not None:
                    self._store(source.key, came, tick)

    def _store(self, key: str, came: Value, tick: Tick) -> None:
        value, source_tick = came
        if self.schema is None:
            self.agent.__dict__[self.port][key] = value
        else:
            self.agent.__dict__[self.port] = value
        if self._many:  # an agent that left makes nothing older
            source_tick = max(source_tick, self.run.source_ticks.get(self.port, 0))
        self.run.take(self.port, source_tick, tick.dt)

    def _drop(self, label: str, error: RemsError, tick: Tick) -> None:
        """Count a value that does not fit, and warn; it never ends an agent."""
        self.dropped += 1
        sentence = str(error)
        kind = kind_of(sentence)
        if kind not in self._reasons and len(self._reasons) >= KINDS:
            kind, sentence = "", "for other reasons"
        reason = self._reasons.setdefault(kind, [0, sentence])
        reason[0] += 1
        if reason[0] == 1 or self.dropped % 1000 == 0:
            self._warn(
                "rejected",
                f"dropped a value from {label} ({self.dropped} so far, "
                f"now at {tick.t:g} s): {error}",
                tick.n,
            )

    def why(self) -> dict[str, Any]:
        """Return when it last got a value, and what was dropped. For any thread."""
        return {
            "source": self.source or "",
            "heard": self.run.source_times.get(self.port),
            "dropped": self.dropped,
            "reasons": [[n, said] for n, said in list(self._reasons.values())],
        }

    def total(self) -> None:
        """Warn, at the end, how many values were dropped, and why."""
        if self.dropped:
            values = "1 value" if self.dropped == 1 else f"{self.dropped} values"
            why = " ".join(f"{n} x: {said}" for n, said in self._reasons.values())
            self._warn("rejected", f"dropped {values} in all. {why}")
