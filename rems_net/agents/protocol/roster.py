"""The roster: who is on the fabric, who writes which port. The clock's to say."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any

from rems_net.agents.agent import PHASES
from rems_net.agents.protocol import limits
from rems_net.agents.protocol.badge import RUNS
from rems_net.agents.protocol.shapes import (
    agent_key,
    digest,
    fields,
    flag,
    host_name,
    is_source,
    items,
    name,
    shown,
    source,
    table,
    whole,
)
from rems_net.errors import ExperimentError, WireError, nearest
from rems_net.router.message import BADGES, MOST, pack, read


@dataclass(frozen=True, slots=True)
class Entry:
    """One agent as the fabric sees it.

    key: `robot/sim`             host: name of the process it lives in
    outs: port to schema digest  reads: what its Ins are connected to
    lockstep: waited for         every: it steps at ticks n with n % every == 0
    since: its first tick   badge: of its host; the clock's to say
    """

    key: str
    host: str
    outs: Mapping[str, str]
    reads: Sequence[str] = ()
    every: int = 1
    lockstep: bool = True
    since: int = 1
    badge: int = 0

    @property
    def kind(self) -> str:
        return self.key.partition("/")[0]

    @property
    def phase(self) -> int:
        return PHASES.index(self.kind)

    def due(self, n: int) -> int:
        """The newest tick, at most `n`, at which this agent has written; 0 for none."""
        newest = n - n % self.every
        return newest if newest >= self.since else 0

    def to_plain(self) -> dict[str, Any]:
        return {
            "key": self.key,
            "host": self.host,
            "outs": dict(self.outs),
            "reads": list(self.reads),
            "every": self.every,
            "lockstep": self.lockstep,
            "since": self.since,
            "badge": self.badge,
        }

    @classmethod
    def from_plain(cls, plain: Any) -> Entry:
        """Read an entry. Raises WireError."""
        given = fields(plain, "an agent", *cls.__slots__)
        key = agent_key(given["key"], "an agent")
        outs = table(given["outs"], f"the outs of {key}", limits.PORTS)
        for port, schema in outs.items():
            name(port, f"a port of {key}")
            digest(schema, f"the digest of {key}/{port}")
        reads = items(given["reads"], f"the sources of {key}", limits.SOURCES)
        return cls(
            key,
            host_name(given["host"], f"the host of {key}"),
            outs,
            [source(one, f"a source of {key}", limits.SOURCE) for one in reads],
            whole(given["every"], f"every of {key}", 1),
            flag(given["lockstep"], f"lockstep of {key}"),
            whole(given["since"], f"since of {key}", 1),
            whole(given["badge"], f"the badge of {key}", 0, BADGES),
        )


@dataclass(frozen=True, slots=True)
class Roster:
    """A frozen list of agents that holds from tick `first` on.

    schemas: digest to canonical schema, for every port in `agents`
    run: whose roster it is
    gone: the hosts that the clock gave up, and why
    """

    epoch: int
    first: int
    agents: Mapping[str, Entry]
    schemas: Mapping[str, bytes] = field(repr=False)
    run: int = 0
    gone: Mapping[str, str] = field(default_factory=dict)

    def hosts(self) -> dict[str, list[Entry]]:
        found: dict[str, list[Entry]] = {}
        for entry in self.agents.values():
            found.setdefault(entry.host, []).append(entry)
        return found

    def writers(self, reader: Entry) -> set[str]:
        """The agents whose values of this very tick `reader` waits for."""
        return {
            key
            for source in reader.reads
            for key in self._written_by(source)
            if self.agents[key].lockstep and self.agents[key].phase < reader.phase
        }

    def _written_by(self, source: str) -> set[str]:
        if "*" in source:
            return {s.entry.key for s in resolve(source, self.agents, "a reader")}
        return {"/".join(source.split("/")[:2])} & self.agents.keys()

    def hears_itself(self, reader: str, source: str) -> bool:
        """Whether what `source` writes depends on what the process `reader` wrote.

        Robots end the search: a state is measured, whatever it was told.
        """
        seen, to_do = set[str](), [source]
        while to_do:
            key = to_do.pop()
            if key == reader:
                return True
            entry = self.agents.get(key)
            if key in seen or entry is None or entry.kind not in ("input", "process"):
                continue
            seen.add(key)
            to_do += [k for one in entry.reads for k in self._written_by(one)]
        return False

    def read_outside(self, host: str) -> set[str]:
        """The ports (`robot/sim/state`) of `host` that others wait for.

        Agents in lock-step, in other hosts.
        """
        others = [e for e in self.agents.values() if e.host != host and e.lockstep]
        sources = {source for entry in others for source in entry.reads}
        own = {k: e for k, e in self.agents.items() if e.host == host}
        found: set[str] = set()
        for one in sources:
            if "*" in one or "/".join(one.split("/")[:2]) in own:
                found.update(s.key for s in resolve(one, own, "a reader"))
        return found

    def to_wire(self) -> bytes:
        plain = {
            "run": self.run,
            "epoch": self.epoch,
            "first": self.first,
            "agents": [e.to_plain() for e in self.agents.values()],
            "schemas": dict(self.schemas),
            "gone": dict(self.gone),
        }
        return pack(plain)

    @classmethod
    def from_wire(cls, payload: bytes) -> Roster:
        """Read a roster. Raises WireError for anything that is none."""
        plain = fields(read(payload), "a roster", *cls.__slots__)
        entries = [
            Entry.from_plain(e) for e in items(plain["agents"], "its agents", MOST)
        ]
        schemas = table(plain["schemas"], "its schemas", MOST)
        for entry in entries:
            for port, schema in entry.outs.items():
                if type(schemas.get(schema)) is not bytes:
                    raise WireError(f"it has no schema for {entry.key}/{port}.")
        gone = table(plain["gone"], "gone", MOST)
        return cls(
            whole(plain["epoch"], "its epoch"),
            whole(plain["first"], "its first tick", 1),
            {entry.key: entry for entry in entries},
            schemas,
            whole(plain["run"], "its run", 0, RUNS),
            {
                h: shown(why, f"why {h} is gone", limits.CAUSE)
                for h, why in gone.items()
            },
        )


@dataclass(frozen=True, slots=True)
class Source:
    """One written port that an In reads."""

    entry: Entry
    port: str

    @property
    def key(self) -> str:
        return f"{self.entry.key}/{self.port}"

    @property
    def digest(self) -> str:
        return self.entry.outs[self.port]


def resolve(
    source: str, agents: Mapping[str, Entry], reader: str, me: str = ""
) -> list[Source]:
    """The ports that `source` names, in the order of their keys.

    source: `input/keys` (its only port), `robot/sim/state`, or a glob over both.
    reader: `robot/sim.command`, for the message.  me: the agent that reads, which hears
    itself where it is named, and not by a glob. Raises ExperimentError.
    """
    chunks = source.split("/")
    if not is_source(source):
        raise ExperimentError(
            f"{reader} is connected to {source!r}; expected <kind>/<name> or "
            "<kind>/<name>/<port>, such as 'input/keys' or 'robot/sim/state', or a "
            "glob such as 'robot/ca*/state', where * is any letters."
        )
    if any("*" in c for c in chunks):
        others = [e for e in agents.values() if e.key != me]
        return [s for s in _ports(others) if _glob(chunks, s.key.split("/"))]
    key = "/".join(chunks[:2])
    entry = agents.get(key)
    if entry is None:
        have = ", ".join(sorted(agents)) or "nothing"
        raise ExperimentError(
            f"{reader} is connected to {source!r}, and there is no {key!r}; "
            f"there is {have}.{nearest(key, agents)}"
        )
    if len(chunks) == 3:
        if chunks[2] not in entry.outs:
            raise ExperimentError(
                f"{reader} is connected to {source!r}, and {key} has no port "
                f"{chunks[2]!r}; it has {', '.join(entry.outs)}."
                f"{nearest(chunks[2], entry.outs)}"
            )
        return [Source(entry, chunks[2])]
    if len(entry.outs) != 1:
        raise ExperimentError(
            f"{reader} is connected to {source!r}, which has {len(entry.outs)} ports; "
            f"say which: {', '.join(f'{key}/{p}' for p in entry.outs)}."
        )
    return [Source(entry, *entry.outs)]


def _ports(entries: Iterable[Entry]) -> list[Source]:
    return [Source(e, p) for e in sorted(entries, key=lambda e: e.key) for p in e.outs]


def _glob(pattern: list[str], chunks: list[str]) -> bool:
    if len(pattern) == 2:
        pattern = [*pattern, "*"]
    return all(fnmatchcase(c, p) for c, p in zip(chunks, pattern, strict=True))
