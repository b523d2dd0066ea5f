"""The roster: the agents on the fabric, and their ports. The clock publishes it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from rems_net.agents.about.wiring import Entry, names_all, resolve, writers
from rems_net.agents.protocol import limits, shapes
from rems_net.agents.protocol.badge import RUNS
from rems_net.errors import WireError
from rems_net.router.message import BADGES, MOST, pack, read


def entry_to_plain(entry: Entry) -> dict[str, Any]:
    """Return an entry as plain data."""
    return {word: getattr(entry, word) for word in Entry.__slots__}


def entry_from_plain(plain: Any) -> Entry:
    """Read an entry. Raises WireError."""
    given = shapes.fields(plain, "an agent", *Entry.__slots__)
    key = shapes.agent_key(given["key"], "an agent")
    outs = shapes.table(given["outs"], f"the outs of {key}", limits.PORTS)
    for port, schema in outs.items():
        shapes.name(port, f"a port of {key}")
        shapes.digest(schema, f"the digest of {key}/{port}")
    reads = shapes.items(given["reads"], f"the sources of {key}", limits.SOURCES)
    return Entry(
        key,
        shapes.host_name(given["host"], f"the host of {key}"),
        outs,
        [shapes.source(one, f"a source of {key}", limits.SOURCE) for one in reads],
        shapes.whole(given["every"], f"every of {key}", 1),
        shapes.flag(given["lockstep"], f"lockstep of {key}"),
        shapes.whole(given["since"], f"since of {key}", 1),
        shapes.whole(given["badge"], f"the badge of {key}", 0, BADGES),
    )


@dataclass(frozen=True, slots=True)
class Roster:
    """A frozen list of agents that holds from tick `first` on.

    schemas: digest to canonical schema, for every port in `agents`
    run: the run that it belongs to
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
        """Return the agents whose values of this very tick `reader` waits for."""
        return {
            key
            for source in reader.reads
            for key in writers(source, self.agents)
            if self.agents[key].lockstep and self.agents[key].phase < reader.phase
        }

    def read_outside(self, host: str, *, all_at_once: bool = True) -> set[str]:
        """Return the ports (`robot/sim/state`) of `host` that other hosts wait for.

        Only for agents in lock-step. all_at_once: also those that are only read with
        those of all agents of their kind, which can come in one message.
        """
        others = [e for e in self.agents.values() if e.host != host and e.lockstep]
        sources = {
            source
            for entry in others
            for source in entry.reads
            if all_at_once or not names_all(source)
        }
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
            "agents": [entry_to_plain(e) for e in self.agents.values()],
            "schemas": dict(self.schemas),
            "gone": dict(self.gone),
        }
        return pack(plain)

    @classmethod
    def from_wire(cls, payload: bytes) -> "Roster":
        """Read a roster. Raises WireError for anything else."""
        plain = shapes.fields(read(payload), "a roster", *cls.__slots__)
        entries = [
            entry_from_plain(e)
            for e in shapes.items(plain["agents"], "its agents", MOST)
        ]
        schemas = shapes.table(plain["schemas"], "its schemas", MOST)
        for entry in entries:
            for port, schema in entry.outs.items():
                if type(schemas.get(schema)) is not bytes:
                    raise WireError(f"it has no schema for {entry.key}/{port}. (R0621)")
        gone = shapes.table(plain["gone"], "gone", MOST)
        return cls(
            shapes.whole(plain["epoch"], "its epoch"),
            shapes.whole(plain["first"], "its first tick", 1),
            {entry.key: entry for entry in entries},
            schemas,
            shapes.whole(plain["run"], "its run", 0, RUNS),
            {
                h: shapes.shown(why, f"why {h} is gone", limits.CAUSE)
                for h, why in gone.items()
            },
        )
