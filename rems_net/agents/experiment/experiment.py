"""Experiment: a set of agents and a clock; checked before anything starts."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from rems_net.agents import parts, registry
from rems_net.agents.agent import Agent, Input
from rems_net.agents.experiment.checking.connections import check_connections, written
from rems_net.agents.experiment.checking.foresight import check_foreseen
from rems_net.agents.experiment.checking.settings import (
    check_choice,
    check_every,
    check_flag,
    check_folder,
    check_mapping,
    check_pace,
    check_restart,
    check_seed,
    count_ticks,
    origin,
    seconds,
)
from rems_net.agents.experiment.checking.worlds import (
    fill_worlds,
    robot_host,
    world_plan,
)
from rems_net.agents.experiment.folder import finish, own_folder
from rems_net.agents.experiment.placement.borrowing import borrowed, relayed
from rems_net.agents.experiment.placement.offers import machines_of, make_offers
from rems_net.agents.experiment.run import Hosts, Result, Run, Show, restarts
from rems_net.agents.experiment.source.methods import built, check_settings
from rems_net.agents.experiment.source.mistakes import check_class, idle
from rems_net.agents.protocol.alike import check_version
from rems_net.agents.protocol.limits import JOIN_TIME, PATIENCE, WAIT
from rems_net.agents.protocol.plan import Plan, robot_classes
from rems_net.agents.protocol.terms import Terms
from rems_net.errors import ExperimentError, FabricError, nearest
from rems_net.router import find
from rems_net.router.gate.standing import check_member
from rems_net.router.keys import check_name


class Experiment:
    """Agents and a clock. Add agents, then `run`.

    dt, duration: seconds, or text with a unit ("100 ms"); duration None means until
    the inputs end. pace: "fast", or a real-time factor (1.0 is real time).
    folder: what relative file names start from. on_failure: what happens when an
    agent fails or dies: "stop" ends the run, "drop" goes on without it.
    patience: how long a machine may be out of sight, asleep or cut off, before its
    agents count as dead. wait: how long a run waits for the agents that other machines
    bring. catch_up: whether a run at a pace that was held hurries until
    it is in time again; never with robots that are really driven. seed: what the random
    numbers of all agents come from. native: whether agents compute with all that this
    processor has; recordings then differ in their last digits from those of others.
    """

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
        patience: float | str = PATIENCE,
        wait: float | str = WAIT,
        catch_up: bool = False,
        seed: int = 0,
        native: bool = False,
    ):
        self.name = check_name(name, "the experiment's name")
        #: its name; "" for this user's own
        self.fabric = fabric and check_name(fabric, "the fabric's name")
        self.dt = seconds(dt, "dt")
        self.duration = None if duration is None else seconds(duration, "duration")
        self.pace = check_pace(pace)
        self.folder = check_folder(folder)
        self.on_failure = check_choice(on_failure, "on_failure", ("stop", "drop"))
        self.patience = seconds(patience, "patience")
        self.wait = seconds(wait, "wait")
        self.catch_up = check_flag(catch_up, "catch_up")
        self.seed = check_seed(seed)
        self.native = check_flag(native, "native")
        self.plans: dict[str, Plan] = {}

    # -- adding ------------------------------------------------------------------

    def input(self, name: str, type: str | type, **settings: Any) -> None:
        """Add an input: a built-in type ("csv") or a class of your own."""
        self._add("input", name, type, settings)

    def process(self, name: str, type: str | type, **settings: Any) -> None:
        """Add a process. A setting named as one of its Ins connects that In."""
        self._add("process", name, type, settings)

    def world(self, name: str, **settings: Any) -> None:
        """Say what is in a place that robots share, beside them.

        radius, or size: of the walls around it; walls, boxes, balls, cylinders, ramps:
        a list of dicts each (docs/worlds.md); or mjcf: a file that is the place. A
        robot is in it that is added with this `world`.
        """
        with origin(f"world {name!r}"):
            known = self.plans.pop(f"world/{name}", None)
            if known is not None and known.options:
                raise ExperimentError(
                    f"there are two worlds named {name!r}; give one another name."
                )
            self._put(world_plan(name, settings, self.folder))

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
        machine: str | None = None,
        restart: int = 0,
        world: str | None = None,
    ) -> None:
        """Add a robot: what it is, and how it is done.

        command: what tells it ("input/keys"); without, it takes what any program puts
        at its command key. parameters are of the definition, options of the driver,
        initial is the state it starts in. Robots of one host share a process; those of
        one `world` share that, too: they touch and see each other. Every
        agent can step at every k-th tick only, join `since` some seconds, and be
        brought by another `machine`, on which `rems bring --as` its name was typed;
        started again after a crash, up to `restart` times.
        """
        with origin(f"robot {name!r}"):
            classes = robot_classes(definition, driver, self.folder)
            check_mapping(parameters, "parameters")
            check_mapping(options, "options")
            check_mapping(initial, "initial")
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
                host=robot_host(name, host, world),
                machine=check_name(machine, "machine") if machine else "",
                restart=check_restart(restart),
                folder=self.folder,
            )
            if plan.world and plan.world not in self.plans:
                self._put(world_plan(str(world), {}, self.folder))
            self._put(plan)
            if relay := relayed(plan):
                self._put(relay)

    def _add(self, kind: str, name: str, type: str | type, settings: Any) -> None:
        with origin(f"{kind} {name!r}"):
            cls = parts.find(kind, type, self.folder)
            every = check_every(settings.pop("every", 1))
            restart = check_restart(settings.pop("restart", 0))
            host = settings.pop("host", None)
            host = check_name(host, "host") if host else f"{kind}/{name}"
            machine = settings.pop("machine", None)
            machine = check_name(machine, "machine") if machine else ""
            sources = {p: i.source for p, i in cls.ins().items() if i.source}
            for port in cls.ins().keys() & settings.keys():
                source = settings.pop(port)
                if not isinstance(source, str):
                    raise ExperimentError(
                        f"{port} is {source!r}; expected what it is connected to, "
                        "such as 'robot/sim/state'."
                    )
                sources[port] = source
            since = self._first_tick(settings.pop("since", 0.0))
            plan = Plan(
                kind,
                name,
                [cls],
                options=settings,
                sources=sources,
                every=every,
                since=since,
                host=host,
                machine=machine,
                restart=restart,
                folder=self.folder,
            )
            self._put(plan)
            check_settings(cls, settings)

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
        if plan.machine and plan.restart:
            raise ExperimentError(
                f"machine {plan.machine!r} starts nothing again after a crash; leave "
                "restart or machine out."
            )
        check_class(plan)  # before what it is told: that may be wrong because of it
        self.plans[plan.key] = plan

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
        agents = self._build()
        entries = written(agents)
        for key, plan in self.plans.items():
            with origin(f"{plan.kind} {plan.name!r}"):
                check_connections(agents[key], plan.sources, entries, agents)
        check_foreseen(self.plans, entries, agents)
        driven = [key for key, agent in agents.items() if not agent.lockstep]
        if self.catch_up and driven:
            raise ExperimentError(
                f"catch_up would drive {driven[0]} in fast forward after a hold; leave "
                "it out, or use simulated robots only."
            )
        return agents

    def _build(self) -> dict[str, Agent]:
        agents: dict[str, Agent] = {}
        for key, plan in self.plans.items():
            with origin(f"{plan.kind} {plan.name!r}"):
                plan.seed = self.seed
                agents[key] = built(plan)
        fill_worlds(self.plans, agents)
        return agents

    def ticks(self, agents: Mapping[str, Agent]) -> int:
        """How many ticks the experiment lasts."""
        ends = [a.end for a in agents.values() if isinstance(a, Input) and a.end]
        return count_ticks(self.duration, self.dt, ends)

    # -- running -----------------------------------------------------------------

    def run(
        self,
        out: Path | str | None = None,
        *,
        pace: float | str | None = None,
        elsewhere: Collection[str] = (),
        alone: bool = False,
        show: Show | None = None,
    ) -> Result:
        """Check, start every agent in a process of its own, tick, end, and report.

        out: the folder for what the outputs make, `runs/<name>` by default; what an
        earlier run left there is moved to `runs/<name>.1`.
        elsewhere: agents ("robot/b") that other machines bring, by `join`.
        alone: also start what is to be on other machines here.
        show: what it tells while it runs; on a terminal its progress, by default.
        The result has the recording of each robot, by its name.
        Raises ExperimentError before anything has started, and AgentError when an
        agent fails or dies; the outputs are complete up to there.
        """
        runner = registry.runner()
        if runner is not None:
            with registry.running_by(None):
                done: Result = runner(
                    self, out, pace=pace, elsewhere=elsewhere, alone=alone, show=show
                )
            return done
        agents = self.check()
        ticks = self.ticks(agents)
        factor = self.pace if pace is None else check_pace(pace)
        lent = borrowed(self.plans.values(), factor)
        every, away = self._by_host(), self._hosts(elsewhere, "elsewhere")
        away |= {self.plans[one.robot].host for one in lent}
        machines = {} if alone else machines_of(every, away)
        offers = make_offers(
            self.name, self.folder, every, agents, machines, native=self.native
        )
        away |= machines.keys()
        here = {h: p for h, p in every.items() if h not in away}
        if show is None:
            # Here, since it takes a tenth of a second to load.
            from rems_net.agents.experiment.progress import usual

            show = usual(self.name)
        hosts = Hosts(here, agents, show, native=self.native)
        told = [key for key, plan in self.plans.items() if "command" in plan.sources]
        if not factor and (sentence := idle(agents, told)):
            hosts.say("clock", f"warning: {sentence}")
        terms = Terms(
            self.dt,
            ticks,
            factor,
            hosts={
                host: frozenset(plan.key for plan in plans)
                for host, plans in every.items()
            },
            tickets=hosts.tickets,
            machines=machines,
            outs={p.key: agents[p.key].published() for h in away for p in every[h]},
            wait=self.wait if away else JOIN_TIME,
            restarts=restarts(self._by_host()),
            drop=self.on_failure == "drop",
            patience=self.patience,
            catch_up=self.catch_up,
        )
        with self._own_folder(out, agents, show) as folder:
            fabric = self.fabric or find.own_fabric()
            if fabric in {one.home for one in lent}:  # a fabric has one clock
                fabric = self.name
            result = Run(fabric, terms, hosts, folder, offers, lent).go()
            finish(folder, result.files)
        return result

    def join(
        self,
        only: Collection[str],
        out: Path | str | None = None,
        *,
        show: Show | None = None,
    ) -> None:
        """Bring some agents ("robot/b") of this experiment to a clock that runs.

        The machine with the clock runs the same experiment with these `elsewhere`;
        REMS_ROUTER says where. Returns when the run ends. Raises as `run` does, and
        FabricError where there is no router.
        """
        runner = registry.runner()
        if runner is not None:
            with registry.running_by(None):
                runner(self, out, only=only, show=show)
            return
        agents = self.check()
        wanted = self._hosts(only, "only")
        self._bring(wanted, agents, out, show or Show(), free=False)

    def visit(self, out: Path | str | None = None, *, show: Show | None = None) -> None:
        """Bring all agents to an open fabric, and stay until interrupted.

        What they are connected to may come later, and go. Raises ExperimentError
        before anything has started, FabricError where there is no router, and
        AgentError for an agent that fails.
        """
        agents = self._build()
        self._bring(self._by_host().keys(), agents, out, show or Show(), free=True)

    def _bring(
        self,
        wanted: Collection[str],
        agents: Mapping[str, Agent],
        out: Path | str | None,
        show: Show,
        *,
        free: bool,
    ) -> None:
        """Start these hosts for a clock elsewhere, and wait until they have ended."""
        fabric = self.fabric or find.own_fabric()
        with find.open_session(fabric) as session:
            check_member(session)
            check_version(session)
            link = session.link
            there = find.fabrics(session)
        if there and fabric not in there:
            raise FabricError(
                f"nothing runs on the fabric {fabric!r} at {link.endpoint}. Say which, "
                f"by --fabric: {', '.join(there)}"
            )
        brought = {h: p for h, p in self._by_host().items() if h in wanted}
        hosts = Hosts(brought, agents, show, native=self.native)
        writes = any(plan.kind == "output" for p in brought.values() for plan in p)
        with self._own_folder(out, agents, show) if writes else nullcontext():
            try:
                hosts.start(link, own=False, free=free)
                hosts.wait()
            finally:
                hosts.leave()

    def _by_host(self) -> dict[str, list[Plan]]:
        hosts: dict[str, list[Plan]] = {}
        for plan in self.plans.values():
            hosts.setdefault(plan.host, []).append(plan)
        return hosts

    def _hosts(self, keys: Collection[str], what: str) -> set[str]:
        """The hosts in which these agents live."""
        for key in keys:
            if key not in self.plans:
                raise ExperimentError(
                    f"{what} names {key!r}, and there is no such agent; there is "
                    f"{', '.join(self.plans)}.{nearest(key, self.plans)}"
                )
        return {self.plans[key].host for key in keys}

    def _own_folder(
        self, out: Path | str | None, agents: Mapping[str, Agent], show: Show
    ) -> AbstractContextManager[Path]:
        return own_folder(
            self.name,
            out,
            self.plans,
            agents,
            self.dt,
            show,
            seed=self.seed,
            native=self.native,
        )
