"""Inlet: one In of one agent, filled at each tick from its sources."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from rems_net.agents.about.mistakes import odd_glob, refusal
from rems_net.agents.about.reasons import Reasons
from rems_net.agents.about.wiring import Entry, Written, reads_itself, resolve
from rems_net.agents.agent import PHASES, Agent
from rems_net.agents.rules import connect
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick
from rems_net.defdict import Schema, lock
from rems_net.engine.source import Conversion, Gone, Local, Source, Value
from rems_net.errors import RemsError
from rems_net.events import warn


class Network(Protocol):
    """The other processes of a run, for an engine."""

    def schema(self, digest: str) -> Schema:
        """Return the schema of a port that another process writes."""

    def source(self, inlet: "Inlet", written: Written, converter: Conversion) -> Source:
        """Return the source of a port that no agent here writes in lock-step."""

    def together(self, sources: Sequence[Source]) -> list[Source]:
        """Return the sources; those whose payloads may come at once are one."""


class Inlet:
    """One In of one agent.

    source: its connection; None if programs outside may put a value there.
    here: the agents of this engine.
    """

    def __init__(
        self,
        agent: Agent,
        port: str,
        source: str | None,
        here: Mapping[str, Agent],
        schema: Schema | None = None,
    ):
        self.agent, self.port, self.source, self._here = agent, port, source, here
        self.key = f"{agent.key}/{port}"
        self.phase, self.every = PHASES.index(agent.kind), runtime(agent).every
        self.run, self._own = runtime(agent), agent.__dict__
        live = self._own.get(port)
        #: None for an In of a glob, whose value is a plain dict
        self.schema: Schema | None = schema if live is None else live.schema
        self.sources: list[Source] = []
        #: sources that do not depend on the members of the run
        self.steady: list[Source] = []
        #: why values were dropped
        self.reasons = Reasons()
        self._many = source is not None and "*" in source
        # A glob of the class itself is for agents that may be there.
        own = agent.ins().get(port)
        #: numbers of ports that it may read without a warning
        self._usual = {0, 1} if own is not None and source == own.source else {1}
        #: makes the error of an agent that sets its In
        self._refuse = refusal(port, agent.kind == "robot")
        if live is not None:
            lock(live, self._refuse)
        elif self.schema is None:
            self._own[port] = {}

    def connect(self, entries: Mapping[str, Entry], network: Network | None) -> None:
        """Find the sources among all agents of the run, again.

        Raises ExperimentError or ConversionError.
        """
        if self.source is None:
            return
        writer = "/".join(self.source.split("/")[:2])
        read: list[Written] = []  # without its writer the last value stays, and ages
        if self._many or writer in entries:
            reader = f"{self.agent.key}.{self.port}"
            read = resolve(self.source, entries, reader, self.agent.key)
        old = {s.key: s for s in self.sources if s.entry is not None}
        self.sources = [*self.steady]
        for written in read:
            known = old.get(written.key)
            if known is None or known.entry != written.entry:
                known = self._made(written, network)
            self.sources.append(known)
        if self.agent.kind == "process" and any(
            reads_itself(entries, self.agent.key, one.entry.key) for one in read
        ):
            self.run.feedback.add(self.port)
        self._check(read)
        if self.schema is None:
            live = self._own[self.port]
            for key in live.keys() - {one.key for one in read}:
                del live[key]

    def _made(self, written: Written, network: Network | None) -> Source:
        entry, local = written.entry, self._here.get(written.entry.key)
        if local is not None:
            theirs: Schema = local.__dict__[written.port].schema
        else:
            assert network is not None  # alone, an engine has all agents
            theirs = network.schema(written.digest)
        converter = self._conversion(written.key, theirs)
        if local is not None and entry.lockstep and self.run.in_step:
            earlier = entry.phase < self.phase
            return Local(entry, local, written.port, converter, earlier)
        assert network is not None
        return network.source(self, written, converter)

    def _conversion(self, key: str, theirs: Schema) -> Conversion:
        """Return what makes its values of those of a port, which are in `theirs`."""
        if self.schema is None and not self._many:
            # On an open fabric its one source may come later than the agent.
            self.agent.settle(self.port, theirs)
            lock(self.agent.__dict__[self.port], self._refuse)
            self.schema = theirs
        wanted = self._wanted(theirs)
        if self.schema is None:
            self.agent.__dict__[self.port][key] = lock(wanted(), self._refuse)
        return connect(theirs, wanted, self.run.rules, key, self.key)

    def _wanted(self, theirs: Schema) -> Schema:
        """Return the schema to which values of this writer are converted."""
        return self.schema or theirs

    def _check(self, read: list[Written]) -> None:
        """Warn, once each, of a glob that matches nothing or too much."""
        count = min(len(read), 2)
        if self._many and count not in self._usual:
            keys = [one.key for one in read]
            if said := odd_glob(str(self.source), keys, self.schema is not None):
                self._usual.add(count)
                self._warn("glob", said)

    def _warn(self, kind: str, text: str, tick: int = 0) -> None:
        warn(kind, f"{self.key} {text}", self.agent.key, tick)

    def put(self, values: Mapping[str, Any], n: int) -> None:
        """Set its value after tick n, for the engine's caller. Raises SchemaError."""
        assert self.schema is not None
        mine = getattr(values, "schema", None) is self.schema
        self._store("", (values if mine else self.schema(values), n))

    def fill(self, tick: Tick) -> None:
        """Set the In to its value at this tick.

        It gets a new object: a value that the agent has kept does not change.
        """
        if self.schema is None:
            self._own[self.port] = {**self._own[self.port]}
        self._take(tick)

    def _take(self, tick: Tick) -> None:
        for source in self.sources:
            try:
                came = source.take(tick)
            except RemsError as error:
                self._drop(source.label, error, tick)
            except Gone:
                if self.schema is None:
                    self._own[self.port].pop(source.key, None)
            else:
                if came is not None:
                    self._store(source.key, came)

    def _store(self, key: str, came: Value) -> None:
        value, source_tick = came
        lock(value, self._refuse)
        if self.schema is None:
            self._own[self.port][key] = value
        else:
            self._own[self.port] = value
        if self._many:  # an agent that left makes no value older
            source_tick = max(source_tick, self.run.source_ticks.get(self.port, 0))
        self.run.source_ticks[self.port] = source_tick

    def _drop(self, label: str, error: RemsError, tick: Tick) -> None:
        """Count a value that does not fit, and warn; it never ends an agent."""
        new = self.reasons.add(str(error))
        if new or self.reasons.count % 1000 == 0:
            self._warn(
                "rejected",
                f"dropped a value from {label} ({self.reasons.count} so far, now at "
                f"{tick.t:g} s): {error}",
                tick.n,
            )

    def total(self) -> None:
        """Warn, at the end, how many values were dropped, and why."""
        if said := self.reasons.total():
            self._warn("rejected", f"dropped {said}")
