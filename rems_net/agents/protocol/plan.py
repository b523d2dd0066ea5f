"""A plan for one agent, and its table, which has one form everywhere.

A table is plain data, as in an experiment's file: `name`, `definition`, `driver` and so
on. A plan has this form on its way to a host, to another machine, and in `run.json`.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from rems_net.agents import parts, registry
from rems_net.agents.agent import PHASES, Agent
from rems_net.agents.protocol.shapes import wrong
from rems_net.agents.robot import Robot, combine
from rems_net.agents.rules import Rules, check_rules, rule_reference
from rems_net.agents.runtime import RUNTIME, runtime
from rems_net.agents.tick import time_of
from rems_net.agents.verbs import CALLED, plain
from rems_net.agents.world import GHOSTS
from rems_net.defdict import DefDict, Schema

T = TypeVar("T")

#: kinds of the two classes of a robot
ROBOT = ("definition", "driver")
#: settings that the classes of an agent declare, each in a table of its own
SLOTS = ("parameters", "options", "initial", "marker")
#: keys of every agent besides those tables, and their defaults; since: s
COMMON: dict[str, Any] = {
    **{"every": 1, "since": 0.0, "host": "", "machine": "", "restart": 0},
    "rules": [],
}

#: the host that is no process, but a thread of the run's own
HERE = "here"
#: in a table: the calls from outside that a rerun repeats
AGAIN = "calls again"
#: one agent, as in a file
Table = Mapping[str, Any]
#: kind -> the agents of this kind, as in a file: [[robot]]
Tables = Mapping[str, Sequence[Table]]


@dataclass(slots=True)
class Plan:
    """Plan of one agent: its class, name, settings and connections."""

    kind: str
    name: str
    classes: list[type]
    options: Mapping[str, Any] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    initial: Mapping[str, Any] = field(default_factory=dict)
    marker: Mapping[str, Any] = field(default_factory=dict)
    sources: dict[str, str] = field(default_factory=dict)
    every: int = 1
    #: rules for the values that its Ins read
    rules: Rules = ()
    #: the process it lives in; its own by default
    host: str = ""
    #: the first tick it takes part in
    since: int = 1
    #: how often its process may be started again after a crash
    restart: int = 0
    seed: int = 0
    #: the machine that is to bring it; "" for the run's own
    machine: str = ""
    #: calls from outside that are repeated: rows of `Outside`
    again: Sequence[Sequence[Any]] = ()
    folder: Path = Path()
    out: Path = Path()

    @property
    def key(self) -> str:
        return f"{self.kind}/{self.name}"

    def reads(self, port: str) -> list[str]:
        """Return the sources of a port: none, one, or several."""
        sources = self.sources.items()
        return [one for of, one in sources if of.partition("/")[0] == port]

    @property
    def world(self) -> str:
        """Key of the world that it is in, or is, which is its process; "" for none."""
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
            if self.marker:
                common["marker"] = self.marker
            if len(self.classes) == 2:
                cls = combine(*self.classes)
        agent = cls(self.name, **common)
        if RUNTIME in vars(agent):  # the user's own __init__ may have forgotten it
            runtime(agent).seed = self.seed
            runtime(agent).rules = self.rules
            runtime(agent).sources = self.sources
        return agent

    def table(
        self,
        agent: Agent,
        dt: float,
        reference: Callable[[type], str] = parts.reference,
    ) -> dict[str, Any]:
        """Return it as a table of a file, without values that are at their defaults.

        agent: built from this; its settings are checked.
        dt: s.
        reference: returns the name of a class.
        """
        robot = self.kind == "robot"
        made: dict[str, Any] = {"name": self.name}
        words = class_words(self.kind)
        made |= zip(words, map(reference, self.classes), strict=False)
        slots = {"options": _given(agent.options)}
        if isinstance(agent, Robot):
            slots["parameters"] = _given(agent.parameters)
            if agent.initial:
                slots["initial"] = _given(agent.initial_schema(agent.initial))
            if agent.marked:
                slots["marker"] = _given(agent.marker)
        made |= {slot: slots[slot] for slot in SLOTS if slots.get(slot)}
        usual = {} if robot else usual_sources(type(agent))
        sources = {} if self.kind == "world" else self.sources
        for port, one in sorted(sources.items()):
            first, several, _ = port.partition("/")
            if several:
                made.setdefault(first, []).append(one)
            elif usual.get(port) != one:
                made[port] = one
        if self.again:
            made[AGAIN] = [*map(list, self.again)]
        rest = {word: getattr(self, word) for word in COMMON}
        rest["rules"] = [rule_reference(one, reference) for one in self.rules]
        rest["since"] = time_of(self.since - 1, dt)
        if self.world:
            rest["host"] = ""
            if robot:
                made["world"] = self.world.partition("/")[2]
        elif self.host == self.key:
            rest["host"] = ""
        if self.kind == "world":  # a world has those of the robots in it
            rest = {}
        return made | {w: v for w, v in rest.items() if v != COMMON[w]}

    @classmethod
    def read(cls, kind: str, table: Table, folder: Path, dt: float) -> "Plan":
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
        again = given.pop(AGAIN, ())
        common = {w: given.pop(w, default) for w, default in COMMON.items()}
        common["since"] = round(common["since"] / dt) + 1
        common["host"] = host_of(kind, table)
        common["rules"] = check_rules(common["rules"], folder)
        name = given.pop("name")
        sources: dict[str, str] = {}
        ins: Iterable[str] = ("command",)
        if kind != "robot":
            agent: type[Agent] = classes[0]
            ins, sources = agent.ins(), usual_sources(agent)
        for port in (*ins, CALLED):
            if port in given:
                sources |= spread(port, given.pop(port))
        slots = {slot: given.pop(slot, {}) for slot in slots_of(kind)}
        if kind == "world":
            sources = ghost_sources(slots["options"])
        if given:
            raise wrong(f"a plan of {kind}/{name}", [*given], "no other words")
        return cls(
            kind,
            name,
            classes,
            sources=sources,
            again=again,
            folder=folder,
            **slots,
            **common,
        )


def spread(port: str, source: str | Sequence[str]) -> dict[str, str]:
    """Return the sources of an In; each of several has a port with its name."""
    if isinstance(source, str):
        return {port: source}
    return {f"{port}/{one}": one for one in source}


def read_plans(tables: Tables, folder: Path, dt: float) -> Iterator[Plan]:
    """Yield the plan of each table; those of robots before those of worlds."""
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


def grouped(pairs: Iterable[tuple[str, T]]) -> dict[str, list[T]]:
    """Return the values by their key: tables by the kind of their agent."""
    found: dict[str, list[T]] = {}
    for key, one in pairs:
        found.setdefault(key, []).append(one)
    return found


def class_words(kind: str) -> tuple[str, ...]:
    """Return the keys of a table that name classes; a world always has one class."""
    return {"robot": ROBOT, "world": ()}.get(kind, ("type",))


def slots_of(kind: str) -> tuple[str, ...]:
    """Return the tables of settings that an agent of this kind has."""
    return SLOTS if kind == "robot" else ("options",)


def class_names(kind: str, table: Table) -> list[str]:
    """Return the names of a table's classes."""
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
    """Return, as plain data, all that another process needs to build these agents."""
    tables = ((p.kind, p.table(agents[p.key], dt, reference)) for p in plans)
    return {
        "agents": grouped(tables),
        "taken": taken(plans, agents),
        "dt": dt,
        "seed": plans[0].seed,
    }


def usual_sources(cls: type[Agent]) -> dict[str, str]:
    """Return the default sources of Ins."""
    return {port: one.source for port, one in cls.ins().items() if one.source}


def taken(
    plans: Sequence[Plan], agents: Mapping[str, Agent]
) -> dict[str, dict[str, bytes]]:
    """Return the schemas of Ins that take the schema of their source, by agent."""
    return {plan.key: _taken(agents[plan.key]) for plan in plans}


def _taken(agent: Agent) -> dict[str, bytes]:
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


def ghost_sources(options: Mapping[str, Any]) -> dict[str, str]:
    """Return the sources of a world's ghosts, by port. options: of the world."""
    ghosts = options.get("ghosts", ())
    return {f"{GHOSTS}/{one['name']}": one["follows"] for one in ghosts}


def robot_classes(definition: object, driver: object, folder: Path) -> list[type]:
    """Return the two classes of a robot. Raises ExperimentError."""
    return [
        parts.find("definition", definition, folder),
        parts.find("driver", driver, folder),
    ]
