"""A plan for one agent, and the table in which it is written everywhere.

A table is plain data, as in an experiment's file: `name`, `definition`, `driver` and so
on. So is a plan written on its way to a host, to another machine, and in `run.json`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from rems_net.agents import parts, registry
from rems_net.agents.agent import PHASES, Agent
from rems_net.agents.robot import Robot, combine
from rems_net.agents.runtime import RUNTIME, runtime
from rems_net.agents.tick import time_of
from rems_net.agents.verbs import CALLED, plain
from rems_net.defdict import DefDict, Schema

#: the kinds of the two classes of a robot
ROBOT = ("definition", "driver")
#: settings of a robot, each a table of its own
SLOTS = ("parameters", "options", "initial")
#: words about any agent, beside its own settings, and their defaults; since: s
COMMON = {"every": 1, "since": 0.0, "host": "", "machine": "", "restart": 0}

#: one agent, as in a file
Table = Mapping[str, Any]
#: kind -> the agents of this kind, as in a file: [[robot]]
Tables = Mapping[str, Sequence[Table]]


@dataclass(slots=True)
class Plan:
    """Which class, under which name, with which settings, connected to what."""

    kind: str
    name: str
    classes: list[type]
    options: Mapping[str, Any] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    initial: Mapping[str, Any] = field(default_factory=dict)
    sources: dict[str, str] = field(default_factory=dict)
    every: int = 1
    #: the process it lives in; its own by default
    host: str = ""
    #: the first tick it takes part in
    since: int = 1
    #: how often its process may be started again after a crash
    restart: int = 0
    seed: int = 0
    #: the machine that shall bring it; "" for the run's own
    machine: str = ""
    folder: Path = Path()
    out: Path = Path()

    @property
    def key(self) -> str:
        return f"{self.kind}/{self.name}"

    def reads(self, port: str) -> list[str]:
        """Return what a port is connected to: nothing, one source, or several."""
        sources = self.sources.items()
        return [one for of, one in sources if of.partition("/")[0] == port]

    @property
    def world(self) -> str:
        """The key of the world that it shares, or is: the process is the world's."""
        return self.host if self.host.startswith("world/") else ""

    def build(self) -> Agent:
        """Construct the agent; stores only. Raises RemsError for a wrong setting."""
        common: dict[str, Any] = {
            "options": self.options,
            "folder": self.folder,
            "out": self.out,
            "every": self.every,
        }
        cls: Callable[..., Agent] = self.classes[0]
        if self.kind == "robot":
            common |= {"parameters": self.parameters, "initial": self.initial}
            if len(self.classes) == 2:
                cls = combine(*self.classes)
        agent = cls(self.name, **common)
        if RUNTIME in vars(agent):  # no __init__ of the user's own forgot it
            runtime(agent).seed = self.seed
        return agent

    def table(
        self,
        agent: Agent,
        dt: float,
        reference: Callable[[type], str] = parts.reference,
    ) -> dict[str, Any]:
        """Return it as a file says it, without what is at its default.

        agent: built from this; its settings are as they were checked. dt: s.
        reference: how a class is named.
        """
        robot = self.kind == "robot"
        made: dict[str, Any] = {"name": self.name}
        words = class_words(self.kind)
        made |= zip(words, map(reference, self.classes), strict=False)
        options = _given(agent.options)
        if isinstance(agent, Robot):
            slots = {"options": options, "parameters": _given(agent.parameters)}
            if agent.initial:
                slots["initial"] = _given(agent.initial_schema(agent.initial))
            made |= {slot: slots[slot] for slot in SLOTS if slots.get(slot)}
        else:
            made |= options
        usual = {} if robot else usual_sources(type(agent))
        for port, one in sorted(self.sources.items()):
            first, several, _ = port.partition("/")
            if several:
                made.setdefault(first, []).append(one)
            elif usual.get(port) != one:
                made[port] = one
        rest = {word: getattr(self, word) for word in COMMON}
        rest["since"] = time_of(self.since - 1, dt)
        if self.world:
            rest["host"] = ""
            if robot:
                made["world"] = self.world.partition("/")[2]
        elif self.host == self.key:
            rest["host"] = ""
        if self.kind == "world":  # it has those of the robots in it
            rest = {}
        return made | {w: v for w, v in rest.items() if v != COMMON[w]}

    @classmethod
    def read(cls, kind: str, table: Table, folder: Path, dt: float) -> Plan:
        """Return the plan of a table, whose classes are imported. Raises RemsError."""
        given = dict(table)
        kinds = ROBOT if kind == "robot" else (kind,)
        classes: list[type] = [
            parts.checked(one, registry.load(name, folder))
            for one, name in zip(kinds, class_names(kind, table), strict=True)
        ]
        for word in class_words(kind):
            del given[word]
        given.pop("world", None)
        common = {w: given.pop(w, default) for w, default in COMMON.items()}
        common["since"] = round(common["since"] / dt) + 1
        common["host"] = host_of(kind, table)
        name = given.pop("name")
        sources: dict[str, str] = {}
        ins: Iterable[str] = ("command",)
        if kind != "robot":
            agent: type[Agent] = classes[0]
            ins, sources = agent.ins(), usual_sources(agent)
        for port in (*ins, CALLED):
            if port in given:
                sources |= spread(port, given.pop(port))
        slots = given if kind == "robot" else {"options": given}
        return cls(
            kind, name, classes, sources=sources, folder=folder, **slots, **common
        )


def spread(port: str, source: str | Sequence[str]) -> dict[str, str]:
    """Return what an In is connected to: several have a port each, by their names."""
    if isinstance(source, str):
        return {port: source}
    return {f"{port}/{one}": one for one in source}


def read_plans(tables: Tables, folder: Path, dt: float) -> Iterator[Plan]:
    """Yield the plan of each table; before the worlds', those of all robots."""
    every: dict[str, int] = {}
    for kind, one in each(tables):
        plan = Plan.read(kind, one, folder, dt)
        if kind == "world":
            plan.every = every.get(plan.host, 1)
        every.setdefault(plan.world, plan.every)
        yield plan


def each(tables: Tables) -> Iterator[tuple[str, Table]]:
    """Yield kind and table of all agents, in the order of phases."""
    for kind in PHASES:
        for one in tables.get(kind, ()):
            yield kind, one


def by_kind(written: Iterable[tuple[str, dict[str, Any]]]) -> dict[str, list[Any]]:
    """Return tables by the kind of their agent."""
    found: dict[str, list[Any]] = {}
    for kind, one in written:
        found.setdefault(kind, []).append(one)
    return found


def class_words(kind: str) -> tuple[str, ...]:
    """Return the words of a table that name classes; a world has one class always."""
    return {"robot": ROBOT, "world": ()}.get(kind, ("type",))


def class_names(kind: str, table: Table) -> list[str]:
    """Return what a table's classes are called."""
    if kind == "world":
        return [registry.BUILT_IN["world"]["world"]]
    return [table[word] for word in class_words(kind)]


def host_of(kind: str, table: Table) -> str:
    """Return the process in which the agent of a table lives."""
    if world := table.get("world") if kind == "robot" else "":
        return f"world/{world}"
    return table.get("host") or f"{kind}/{table['name']}"


def written(
    plans: Sequence[Plan],
    agents: Mapping[str, Agent],
    dt: float,
    reference: Callable[[type], str] = parts.reference,
) -> dict[str, Any]:
    """Return all from which another process builds these agents, as plain data."""
    tables = ((p.kind, p.table(agents[p.key], dt, reference)) for p in plans)
    return {
        "agents": by_kind(tables),
        "taken": {p.key: _taken(agents[p.key]) for p in plans},
        "dt": dt,
        "seed": plans[0].seed,
    }


def usual_sources(cls: type[Agent]) -> dict[str, str]:
    """Return what Ins are connected to if nothing else is said."""
    return {port: one.source for port, one in cls.ins().items() if one.source}


def _taken(agent: Agent) -> dict[str, bytes]:
    """Return the schemas of Ins that have that of what they are connected to."""
    schemas = agent.schemas()
    open_ = [port for port in agent.ins() if type(agent).ports()[port].is_open]
    return {p: s.to_wire() for p in open_ if (s := schemas.get(p))}


def _given(settings: DefDict) -> dict[str, Any]:
    """Return the settings that are not at their defaults, as a file has them."""
    given, default = plain(settings.to_dict()), _default(settings.schema)
    return {w: v for w, v in given.items() if repr(v) != default[w]}


@lru_cache(maxsize=256)
def _default(schema: Schema) -> dict[str, str]:
    return {word: repr(v) for word, v in plain(schema().to_dict()).items()}


def robot_classes(definition: object, driver: object, folder: Path) -> list[type]:
    """The two classes a robot is made of. Raises ExperimentError."""
    return [
        parts.find("definition", definition, folder),
        parts.find("driver", driver, folder),
    ]
