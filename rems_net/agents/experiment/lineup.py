"""Lineup: a set of agents and a clock, added one by one and checked as a whole."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rems_net.agents import parts
from rems_net.agents.agent import Agent, Input
from rems_net.agents.background.overdue import naming_overdue
from rems_net.agents.experiment.checking.connections import (
    Link,
    check_connections,
    check_foreseen,
    connect_verbs,
    written,
)
from rems_net.agents.experiment.checking.settings import (
    MEANT,
    check_command,
    check_common,
    check_mapping,
    check_sources,
    checked,
    count_ticks,
    origin,
    stated,
)
from rems_net.agents.experiment.checking.worlds import (
    check_ghosts,
    check_here,
    fill_worlds,
    robot_host,
    world_plan,
)
from rems_net.agents.experiment.source.methods import built, check_words
from rems_net.agents.experiment.source.mistakes import check_class
from rems_net.agents.protocol.plan import (
    Plan,
    grouped,
    robot_classes,
    usual_sources,
)
from rems_net.agents.protocol.terms import Wait
from rems_net.agents.verbs import CALLED
from rems_net.arguments import taught
from rems_net.defdict import Rule
from rems_net.errors import ExperimentError
from rems_net.router.keys import check_name

#: settings that a class declares, as a table of its own
Options = Mapping[str, Any] | None
Many = Sequence[Mapping[str, Any]]


class Lineup:
    """Agents and a clock: the content of an `Experiment`, which has the settings."""

    name: str
    fabric: str
    dt: float
    duration: float | None
    pace: float
    folder: Path
    on_failure: str
    wait: Wait
    seed: int
    native: bool
    direct: bool
    record: bool

    @taught(ExperimentError, **MEANT)
    def __init__(
        self,
        name: str = "experiment",
        *,
        dt: float | str = 0.1,
        duration: float | str | None = None,
        pace: float | str = "fast",
        fabric: str = "",
        folder: Path | str = ".",
        on_failure: str = "stop",
        wait: float | str | Mapping[str, float | str] | None = None,
        seed: int = 0,
        native: bool = False,
        direct: bool = False,
        record: bool = True,
    ):
        for word, value in {**locals()}.items():
            if word != "self":
                setattr(self, word, value)
        self.plans: dict[str, Plan] = {}
        #: by key in small letters, the key of the first agent with it
        self._folded: dict[str, str] = {}

    if not TYPE_CHECKING:  # a type checker knows the settings

        def __setattr__(self, name: str, value: object) -> None:
            """Set a setting, checked. Raises ExperimentError."""
            super().__setattr__(name, checked(self, name, value))

    @taught(ExperimentError)
    def input(
        self, name: str, type: str | type, *, options: Options = None, **words: Any
    ) -> None:
        """Add an input: a built-in type ("csv") or a class of your own.

        options are of its class. words: `every`, `since`, `host`, `machine`, `restart`,
        `rules` are as of a robot, and a word with the name of an In connects it.
        """
        self._add("input", name, type, options, words)

    @taught(ExperimentError)
    def process(
        self, name: str, type: str | type, *, options: Options = None, **words: Any
    ) -> None:
        """Add a process; options and words are as of an input."""
        self._add("process", name, type, options, words)

    @taught(ExperimentError, ' Write options={{"{word}": ...}}.')
    def world(self, name: str, *, options: Options = None, ghosts: Many = ()) -> None:
        """Describe a place for the robots added with this `world` (docs/worlds.md).

        options: walls, things, or a file with the whole place.  ghosts: robots that are
        elsewhere, a dict each: name, definition, and the port that it follows.
        """
        with origin(f"world {name!r}"):
            check_mapping(options, "options")
            options = dict(options or {}, **({"ghosts": ghosts} if ghosts else {}))
            known = self.plans.pop(f"world/{name}", None)
            if known is not None and known.options:
                raise ExperimentError(
                    f"there are two worlds named {name!r}; give one another name."
                    " (R0417)"
                )
            self._put(world_plan(name, options, self.folder))

    @taught(ExperimentError)
    def output(
        self, name: str, type: str | type, *, options: Options = None, **words: Any
    ) -> None:
        """Add an output; options and words are as of an input."""
        self._add("output", name, type, options, words)

    @taught(
        ExperimentError,
        " A setting of the definition goes into parameters={{'{word}': ...}}, one of "
        "the driver into options={{'{word}': ...}}.",
    )
    def robot(
        self,
        name: str,
        definition: str | type,
        driver: str | type,
        *,
        command: str | Sequence[str] | None = None,
        parameters: Options | Path | str = None,
        options: Options = None,
        initial: Options = None,
        marker: Options = None,
        every: int = 1,
        since: float | str = 0.0,
        host: str | None = None,
        machine: str | None = None,
        restart: int = 0,
        world: str | None = None,
        rules: Sequence[Rule | str] = (),
    ) -> None:
        """Add a robot: its definition, and the driver that moves it.

        command: its writer ("input/keys"), or several of which each writes fields of
        its own (["input/base", "process/arm"]); without it, any program may put a
        command at its key. parameters are of the definition, or the name of a file that
        `rems identify --out` has written; options are of the driver;
        initial is the state it starts in; marker, the one on it, by which cameras find
        it ({"id": 3, "size": "40 mm"}). rules make its command of what is read: each
        is a function with @rule above it, or its name ("lab.py:arrows_to_wheels").
        Robots of one host share a process; robots of one `world` share that, too: they
        touch and see each other. Every agent can step at every k-th tick only (every),
        join after some seconds (since), be started again after a crash (at most restart
        times), and be brought by another `machine`, on which `rems agent bring --as`
        its name was typed.
        """
        with origin(f"robot {name!r}"):
            classes = robot_classes(definition, driver, self.folder)
            given = {"options": options, "initial": initial, "marker": marker}
            for word, value in given.items():
                check_mapping(value, word)
            parameters, options = stated(parameters, classes, options, self.folder)
            sources = check_command(command)
            words: dict[str, Any] = {"every": every, "since": since, "rules": rules}
            words |= {"machine": machine, "restart": restart}
            common = check_common("", words, self.dt, self.folder)
            common["host"] = robot_host(name, host, world)
            plan = Plan(
                "robot",
                name,
                classes,
                options=options,
                parameters=parameters,
                initial=initial or {},
                marker=marker or {},
                sources=sources,
                folder=self.folder,
                **common,
            )
            if plan.world and plan.world not in self.plans:
                self._put(world_plan(str(world), {}, self.folder))
            self._put(plan)

    def _add(
        self, kind: str, name: str, type: str | type, options: Options, words: Any
    ) -> None:
        with origin(f"{kind} {name!r}"):
            cls = parts.find(kind, type, self.folder)
            check_mapping(options, "options")
            common = check_common(f"{kind}/{name}", words, self.dt, self.folder)
            sources = usual_sources(cls)
            for port in cls.ins().keys() & words.keys():
                sources[port] = words.pop(port)
            check_sources(sources)
            plan = Plan(
                kind,
                name,
                [cls],
                options=options or {},
                sources=sources,
                folder=self.folder,
                **common,
            )
            self._put(plan, words)
            check_words(cls, words)

    def _put(self, plan: Plan, words: Collection[str] = ()) -> None:
        check_name(plan.name, f"the name of this {plan.kind}")
        # Windows and macOS take a.csv and A.csv for one file
        first = self._folded.setdefault(plan.key.casefold(), plan.key)
        if first != plan.key or plan.key in self.plans:
            names = plan.key if first == plan.key else f"{first} and {plan.key}"
            raise ExperimentError(
                f"there are two agents named {names}; give one another name. (R0417)"
            )
        # Before its settings: they may be wrong because of the class.
        check_class(plan, words)
        self.plans[plan.key] = plan

    def check(self, seed: int | None = None) -> dict[str, Agent]:
        """Build every agent and connect all ports, without starting anything.

        seed: replaces the experiment's own. Raises ExperimentError for the first
        mistake.
        """
        if not self.plans:
            raise ExperimentError(
                "this experiment has no agents; add a robot, such as "
                'robot("model", "woodbot", "kinematic"). (R0416)'
            )
        with naming_overdue():
            return self._checked(seed)

    def _checked(self, seed: int | None) -> dict[str, Agent]:
        agents = self.build(seed)
        entries, links = written(agents), list[Link]()
        for key, plan in self.plans.items():
            with origin(f"{plan.kind} {plan.name!r}"):
                links += check_connections(agents[key], plan.sources, entries, agents)
                check_ghosts(plan, self.plans, entries, agents)
                check_here(plan, agents[key])
                called = connect_verbs(agents[key], plan.sources, entries)
            for robot, ports in called.items():
                sources = self.plans[robot].sources
                sources |= {f"{CALLED}/{port}": port for port in ports}
        check_foreseen(links, agents)
        return agents

    def build(self, seed: int | None = None) -> dict[str, Agent]:
        """Build every agent, and put the robots of each world into it."""
        agents: dict[str, Agent] = {}
        for key, plan in self.plans.items():
            with origin(f"{plan.kind} {plan.name!r}"):
                plan.seed = self.seed if seed is None else seed
                agents[key] = built(plan)
        fill_worlds(self.plans, agents)
        return agents

    def ends(self, agents: Mapping[str, Agent]) -> bool:
        """Return whether it ends by itself."""
        inputs = (a for a in agents.values() if isinstance(a, Input))
        return bool(self.duration or any(one.end for one in inputs))

    def ticks(self, agents: Mapping[str, Agent]) -> int:
        """Return how many ticks the experiment lasts."""
        ends = [a.end for a in agents.values() if isinstance(a, Input) and a.end]
        return count_ticks(self.duration, self.dt, ends)

    def by_host(self) -> dict[str, list[Plan]]:
        """Return the plans of each process, by the name of their host."""
        return grouped((plan.host, plan) for plan in self.plans.values())
