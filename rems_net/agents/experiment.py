"""Experiment: a set of agents and a clock; checked before anything starts."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rems_net.agents import registry
from rems_net.agents.agent import Agent, Input, Output, Process
from rems_net.agents.clock import Clock
from rems_net.agents.launch import HostProcess
from rems_net.agents.plan import Plan, robot_classes
from rems_net.agents.roster import Entry, resolve
from rems_net.defdict import parse_quantity
from rems_net.errors import AgentError, ExperimentError, RemsError, nearest
from rems_net.router import find
from rems_net.router.keys import FABRIC, check_name
from rems_net.router.session import Session
from rems_net.router.settings import Link

_BASES: dict[str, type[Agent]] = {"input": Input, "process": Process, "output": Output}

#: seconds a run may take to end, whatever happened
END = 2.0


@dataclass
class Result:
    """What a run left behind.

    ticks: made            files: written by the outputs
    lines: (agent's host, what it printed), in order
    """

    ticks: int = 0
    files: list[Path] = field(default_factory=list)


class Experiment:
    """Agents and a clock. Add agents, then `run`.

    dt, duration: seconds, or text with a unit ("100 ms"); duration None means until
    the inputs end. pace: "fast", or a real-time factor (1.0 is real time).
    folder: what relative file names start from. on_failure: what happens when an
    agent fails or dies: "stop" ends the run, "drop" goes on without it.
    """

    def __init__(
        self,
        name: str = "experiment",
        *,
        dt: float | str = 0.1,
        duration: float | str | None = None,
        pace: float | str = "fast",
        fabric: str = FABRIC,
        folder: Path | str = ".",
        on_failure: str = "stop",
    ):
        self.name = check_name(name, "the experiment's name")
        self.fabric = check_name(fabric, "the fabric's name")
        self.dt = seconds(dt, "dt")
        self.duration = None if duration is None else seconds(duration, "duration")
        self.pace = check_pace(pace)
        self.folder = Path(folder).resolve()
        self.on_failure = check_choice(on_failure, "on_failure", ("stop", "drop"))
        self.plans: dict[str, Plan] = {}

    # -- adding ------------------------------------------------------------------

    def input(self, name: str, type: str | type, **settings: Any) -> None:
        """Add an input: a built-in type ("csv") or a class of your own."""
        self._add("input", name, type, settings)

    def process(self, name: str, type: str | type, **settings: Any) -> None:
        """Add a process. A setting named as one of its Ins connects that In."""
        self._add("process", name, type, settings)

    def output(self, name: str, type: str | type, **settings: Any) -> None:
        """Add an output: a built-in type ("csv") or a class of your own."""
        self._add("output", name, type, settings)

    def robot(
        self,
        name: str,
        definition: str | type,
        driver: str | type,
        *,
        command: str | None = None,
        parameters: Mapping[str, Any] | None = None,
        options: Mapping[str, Any] | None = None,
        initial: Mapping[str, Any] | None = None,
        every: int = 1,
        since: float | str = 0.0,
        host: str | None = None,
    ) -> None:
        """Add a robot: what it is, and how it is done.

        command: what tells it ("input/keys"); without, it takes what any program puts
        at its command key. parameters are of the definition, options of the driver,
        initial is the state it starts in. Robots of one host share a process. Every
        agent can step at every k-th tick only, and join `since` some seconds.
        """
        with origin(f"robot {name!r}"):
            classes = robot_classes(definition, driver, self.folder)
            self._check_mapping(parameters, "parameters")
            self._check_mapping(options, "options")
            self._check_mapping(initial, "initial")
            plan = Plan(
                "robot",
                name,
                classes,
                options=options or {},
                parameters=parameters or {},
                initial=initial or {},
                sources={} if command is None else {"command": command},
                every=check_every(every),
                since=self._first_tick(since),
                host=check_name(host, "host") if host else f"robot/{name}",
                folder=self.folder,
            )
            self._put(plan)

    def _add(self, kind: str, name: str, type: str | type, settings: Any) -> None:
        with origin(f"{kind} {name!r}"):
            cls = registry.find(kind, type, self.folder)
            if not issubclass(cls, _BASES[kind]):
                raise ExperimentError(
                    f"{cls.__name__} is no {kind}; expected a subclass of "
                    f"{_BASES[kind].__name__}."
                )
            every = check_every(settings.pop("every", 1))
            host = settings.pop("host", None)
            host = check_name(host, "host") if host else f"{kind}/{name}"
            sources = {p: i.source for p, i in cls.ins().items() if i.source}
            for port in cls.ins().keys() & settings.keys():
                source = settings.pop(port)
                if not isinstance(source, str):
                    raise ExperimentError(
                        f"{port} is {source!r}; expected what it is connected to, "
                        "such as 'robot/sim/state'."
                    )
                sources[port] = source
            plan = Plan(
                kind,
                name,
                [cls],
                options=settings,
                sources=sources,
                every=every,
                since=self._first_tick(settings.pop("since", 0.0)),
                host=host,
                folder=self.folder,
            )
            self._put(plan)

    def _first_tick(self, since: float | str) -> int:
        """The tick that begins at fabric time `since`."""
        if since in (0, "0 s"):
            return 1
        return round(seconds(since, "since") / self.dt) + 1

    def _put(self, plan: Plan) -> None:
        check_name(plan.name, f"the name of this {plan.kind}")
        if plan.key in self.plans:
            raise ExperimentError(
                f"there are two agents named {plan.key}; give one another name."
            )
        self.plans[plan.key] = plan

    @staticmethod
    def _check_mapping(value: object, what: str) -> None:
        if value is not None and not isinstance(value, Mapping):
            raise ExperimentError(
                f'{what} is {value!r}; expected a table, such as {{ track = "0.1 m" }}.'
            )

    # -- checking ----------------------------------------------------------------

    def check(self) -> dict[str, Agent]:
        """Build every agent and connect all ports, without starting anything.

        Raises ExperimentError for the first thing that is wrong.
        """
        if not self.plans:
            raise ExperimentError(
                "this experiment has no agents; add a robot, such as "
                'robot("model", "woodbot", "kinematic").'
            )
        agents: dict[str, Agent] = {}
        for key, plan in self.plans.items():
            with origin(f"{plan.kind} {plan.name!r}"):
                agent = plan.build()
                agent.prepare()
                agents[key] = agent
        entries = {
            key: Entry(key, key, {p: s.digest for p, s in agent.published().items()})
            for key, agent in agents.items()
        }
        for key, plan in self.plans.items():
            with origin(f"{plan.kind} {plan.name!r}"):
                self._check_connections(agents[key], plan, entries, agents)
        return agents

    def _check_connections(
        self,
        agent: Agent,
        plan: Plan,
        entries: Mapping[str, Entry],
        agents: Mapping[str, Agent],
    ) -> None:
        own = agent.schemas()
        for port in agent.ins():
            source = plan.sources.get(port)
            if source is None:
                if agent.kind != "robot":  # a robot may be told by any program
                    raise ExperimentError(
                        f"its In {port!r} is connected to nothing; say where it reads, "
                        f"such as {port}='robot/sim/state'."
                    )
                continue
            for found in resolve(source, entries, f"{agent.key}.{port}"):
                if port in own and found.entry.key != agent.key:
                    written = agents[found.entry.key].schemas()[found.port]
                    written.converter(
                        own[port],
                        source_label=found.key,
                        target_label=f"{agent.key}/{port}",
                    )

    def ticks(self, agents: Mapping[str, Agent]) -> int:
        """How many ticks the experiment lasts."""
        if self.duration is not None:
            duration = self.duration
        else:
            ends = [a.end for a in agents.values() if isinstance(a, Input) and a.end]
            if not ends:
                raise ExperimentError(
                    'this experiment has no duration, such as "10 s", and no input '
                    "that ends."
                )
            duration = max(ends)
        ticks = round(duration / self.dt)
        if ticks < 1:
            raise ExperimentError(
                f"duration is {duration:g} s, less than one step of dt = {self.dt:g} s."
            )
        return ticks

    # -- running -----------------------------------------------------------------

    def run(
        self,
        out: Path | str | None = None,
        *,
        pace: float | str | None = None,
        show: Show | None = None,
    ) -> Result:
        """Check, start every agent in a process of its own, tick, end, and report.

        out: the folder for what the outputs make, `runs/<name>` by default.
        Raises ExperimentError before anything has started, and AgentError when an
        agent fails or dies; the outputs are complete up to there.
        """
        if registry.loading():
            raise registry.ScriptEnd
        agents = self.check()
        ticks = self.ticks(agents)
        folder = Path(out if out is not None else Path("runs") / self.name).resolve()
        make_folder(folder)
        for plan in self.plans.values():
            plan.out = folder
        show = show or Show()
        factor = self.pace if pace is None else check_pace(pace)
        run = Run(self, agents, folder, factor, show)
        return run.go(ticks)


class Show:
    """What a run tells while it runs; this one says warnings and prints, no more."""

    def begin(self, clock: Clock, ticks: int, endpoint: str) -> None:
        """The agents are being started; `clock` may be looked at from now on."""

    def say(self, source: str, line: str) -> None:
        """An agent printed a line."""
        print(f"[{source}] {line}", file=sys.stderr)

    def end(self) -> None:
        """The run is over."""


class Run:
    """One run of an experiment: its router, clock and host processes."""

    def __init__(
        self,
        experiment: Experiment,
        agents: Mapping[str, Agent],
        folder: Path,
        pace: float,
        show: Show,
    ):
        self.experiment, self.agents, self.folder = experiment, agents, folder
        self.pace, self.show = pace, show
        self.hosts: dict[str, HostProcess] = {}
        self._dead: dict[str, int] = {}
        self._ending = False
        self._lock = threading.Lock()

    def go(self, ticks: int) -> Result:
        session, note = self._session()
        try:
            clock = Clock(
                session,
                dt=self.experiment.dt,
                pace=self.pace,
                expect=frozenset(self._by_host()),
                drop=self.experiment.on_failure == "drop",
                look=self._look,
                tell=lambda sentence: self._say("clock", sentence),
            )
            clock.open()
            self.show.begin(clock, ticks, session.link.endpoint)
            try:
                return self._tick(clock, ticks, session.link)
            finally:
                self.show.end()
        finally:
            if note is not None:
                note.unlink(missing_ok=True)
            session.close()

    def _tick(self, clock: Clock, ticks: int, link: Link) -> Result:
        """Start the hosts, make the ticks, and end the hosts whatever happened."""
        try:
            self._start(link)
            clock.gather()
            clock.run(ticks)
        except BaseException:
            self._release(clock, patience=0.3)
            raise
        failure = self._release(clock, patience=END)
        if failure is not None:
            raise failure
        return Result(clock.tick.n, [Path(p) for p in clock.made()])

    def _release(self, clock: Clock, patience: float) -> AgentError | None:
        self._ending = True
        try:
            return clock.release(END)
        finally:
            for host in self.hosts.values():
                host.end(patience)

    def _session(self) -> tuple[Session, Path | None]:
        fabric = self.experiment.fabric
        if os.environ.get(find.VARIABLE):
            return find.open_session(fabric), None
        return find.serve(fabric)

    def _by_host(self) -> dict[str, list[Plan]]:
        hosts: dict[str, list[Plan]] = {}
        for plan in self.experiment.plans.values():
            hosts.setdefault(plan.host, []).append(plan)
        return hosts

    def _start(self, link: Link) -> None:
        for name, plans in self._by_host().items():
            host = HostProcess(name, self._say)
            self.hosts[name] = host
            host.start(
                {
                    "endpoint": link.endpoint,
                    "fabric": link.fabric,
                    "host": name,
                    "path": sys.path,
                    "agents": [plan.to_wire(self.agents[plan.key]) for plan in plans],
                }
            )

    def _look(self) -> None:
        """Blame the first process that died, with what the system says of its death."""
        if self._ending:
            return
        for name, host in self.hosts.items():
            if death := host.death():
                self._dead[name] = self._dead.get(name, 0) + 1
                # At the first look its own last words may still be on their way.
                if self._dead[name] == 2:
                    raise AgentError(name, death)

    def _say(self, source: str, line: str) -> None:
        with self._lock:
            self.show.say(source, line)


class origin:  # noqa: N801 - reads as a word where it is used
    """Says in every error which agent it is about: `robot 'sim': ...`."""

    def __init__(self, what: str):
        self.what = what

    def __enter__(self) -> None:
        pass

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        if isinstance(error, RemsError):
            raise ExperimentError(f"{self.what}: {error}") from None


def seconds(value: object, what: str) -> float:
    """A positive number of seconds, from a number or text with a unit."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ExperimentError(
            f'{what} is {value!r}; expected seconds, such as "0.1 s".'
        )
    try:
        number = parse_quantity(value, "s")
    except RemsError as error:
        raise ExperimentError(f"{what}: {error}") from None
    if not 0 < number < 1e9:
        raise ExperimentError(
            f"{what} is {value!r}; expected more than 0 s and less than 1e9 s."
        )
    return number


def check_pace(value: object) -> float:
    """0.0 for "fast", else a real-time factor above 0."""
    if value == "fast":
        return 0.0
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        number = -1.0
    if isinstance(value, bool) or not 0 < number < 1e6:
        hint = nearest(value, ["fast"]) if isinstance(value, str) else ""
        raise ExperimentError(
            f'pace is {value!r}; expected "fast" or a real-time factor above 0, '
            f"such as 1.0.{hint}"
        )
    return number


def check_choice(value: object, what: str, choices: tuple[str, ...]) -> str:
    """`value` if it is one of the choices."""
    if isinstance(value, str) and value in choices:
        return value
    hint = nearest(value, choices) if isinstance(value, str) else ""
    expected = " or ".join(f'"{c}"' for c in choices)
    raise ExperimentError(f"{what} is {value!r}; expected {expected}.{hint}")


def check_every(value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise ExperimentError(f"every is {value!r}; expected a whole number from 1.")
    return value


def make_folder(folder: Path) -> None:
    """Make `folder`, or say why the system would not."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ExperimentError(
            f"cannot make the folder {folder}: {error.strerror}."
        ) from None
