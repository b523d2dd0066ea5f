"""Wiring: the writer of each port, and the Ins that read it."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from rems_net.agents.agent import PHASES, Agent
from rems_net.agents.runtime import runtime
from rems_net.agents.verbs import CALLS
from rems_net.errors import ExperimentError, nearest

#: One part of a source, at most 64 characters; `*` stands for any letters.
_CHUNK = re.compile(r"[A-Za-z0-9_.*-]{1,64}|\*\*")


@dataclass(frozen=True, slots=True)
class Entry:
    """One agent as its run knows it.

    key: `robot/sim`             host: name of the process it lives in
    outs: port to schema digest  reads: the sources of its Ins
    lockstep: the clock waits    every: it steps at ticks n with n % every == 0
    since: its first tick        badge: of its host, from the clock
    """

    key: str
    host: str
    outs: Mapping[str, str]
    reads: Sequence[str] = ()
    every: int = 1
    lockstep: bool = True
    since: int = 1
    badge: int = 0

    @classmethod
    def of(cls, agent: Agent, reads: Sequence[str] = (), since: int = 1) -> "Entry":
        """Return the entry of an agent that is prepared, in a host of its own."""
        outs = {port: schema.digest for port, schema in agent.published().items()}
        return cls(agent.key, agent.key, outs, reads, runtime(agent).every, since=since)

    @property
    def kind(self) -> str:
        return self.key.partition("/")[0]

    @property
    def phase(self) -> int:
        return PHASES.index(self.kind)

    def due(self, n: int) -> int:
        """Return the newest tick, at most `n`, at which it has written; 0 for none."""
        newest = n - n % self.every
        return newest if newest >= self.since else 0


@dataclass(frozen=True, slots=True)
class Written:
    """One written port that an In reads."""

    entry: Entry
    port: str

    @property
    def key(self) -> str:
        return f"{self.entry.key}/{self.port}"

    @property
    def digest(self) -> str:
        return self.entry.outs[self.port]


def is_source(value: str) -> bool:
    """Return whether this could name a source, in some experiment."""
    chunks = value.split("/")
    return len(chunks) in (2, 3) and all(map(_CHUNK.fullmatch, chunks))


def names_all(source: str) -> bool:
    """Return whether it names ports of all agents of a kind, as `robot/*/state`."""
    kind, name, *_ = source.split("/")
    return name == "*" and "*" not in kind


def resolve(
    source: str, agents: Mapping[str, Entry], reader: str, me: str = ""
) -> list[Written]:
    """Return the ports that `source` names, in the order of their keys.

    source: `input/keys` (its only port), `robot/sim/state`, or a glob over both.
    reader: `robot/sim.command`, for the message.  me: key of the agent that reads; a
    glob leaves it out, its own name does not. Raises ExperimentError.
    """
    chunks = source.split("/")
    if not is_source(source):
        raise ExperimentError(
            f"{reader} is connected to {source!r}; expected <kind>/<name> or "
            "<kind>/<name>/<port>, such as 'input/keys' or 'robot/sim/state', or a "
            "glob such as 'robot/ca*/state', where * is any letters. (R0422)"
        )
    if "*" in source:
        glob = source if len(chunks) == 3 else f"{source}/*"
        others = [e for key, e in sorted(agents.items()) if key != me]
        ports = [Written(e, port) for e in others for port in e.outs]
        return [w for w in ports if fnmatchcase(w.key, glob)]
    key = "/".join(chunks[:2])
    entry = agents.get(key)
    if entry is None:
        have = ", ".join(sorted(k for k, e in agents.items() if e.outs)) or "nothing"
        raise ExperimentError(
            f"{reader} is connected to {source!r}, and there is no {key!r}; "
            f"there is {have}.{nearest(key, agents)} (R0422)"
        )
    if len(chunks) == 3:
        if chunks[2] not in entry.outs:
            raise ExperimentError(
                f"{reader} is connected to {source!r}, and {key} has no port "
                f"{chunks[2]!r}; it has {', '.join(entry.outs)}."
                f"{nearest(chunks[2], entry.outs)} (R0422)"
            )
        return [Written(entry, chunks[2])]
    outs = [port for port, digest in entry.outs.items() if digest != CALLS.digest]
    if len(outs) != 1:
        raise ExperimentError(
            f"{reader} is connected to {source!r}, which has {len(outs)} ports; "
            f"write one of: {', '.join(f'{key}/{p}' for p in outs)}. (R0419)"
        )
    return [Written(entry, *outs)]


def writers(source: str, agents: Mapping[str, Entry]) -> set[str]:
    """Return the keys of the agents whose ports `source` names."""
    if "*" in source:
        return {w.entry.key for w in resolve(source, agents, "a reader")}
    return {"/".join(source.split("/")[:2])} & agents.keys()


def reads_itself(agents: Mapping[str, Entry], reader: str, source: str) -> bool:
    """Return whether the value of `source` depends on the process `reader` itself.

    A robot ends the search: its state is measured, and is not the command.
    """
    seen, to_do = set[str](), [source]
    while to_do:
        key = to_do.pop()
        if key == reader:
            return True
        entry = agents.get(key)
        if key not in seen and entry and entry.kind in ("input", "process"):
            seen.add(key)
            to_do += [k for one in entry.reads for k in writers(one, agents)]
    return False
