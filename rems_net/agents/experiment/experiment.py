"""Experiment: agents and a clock, run here."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rems_net.agents import parts, registry
from rems_net.agents.agent import Agent
from rems_net.agents.experiment.checking.connections import check_hands
from rems_net.agents.experiment.checking.settings import (
    check_folder,
    make_folder,
)
from rems_net.agents.experiment.checking.surroundings import doubts
from rems_net.agents.experiment.direct import check_direct, check_fast, run_direct
from rems_net.agents.experiment.folder import (
    Result,
    finish,
    own_folder,
    put_manifest,
)
from rems_net.agents.experiment.lineup import Lineup
from rems_net.agents.experiment.origins import manifest
from rems_net.agents.experiment.show import Show
from rems_net.agents.experiment.solo import Solo, warn_of_numerics
from rems_net.agents.experiment.source.mistakes import idle
from rems_net.agents.parts import reference
from rems_net.agents.protocol.limits import JOIN_TIME, check_pace
from rems_net.agents.protocol.plan import HERE, Plan
from rems_net.arguments import taught
from rems_net.errors import ExperimentError
from rems_net.events import Event, warn
from rems_net.router.files import PROCESS, SESSION, check_files

if TYPE_CHECKING:
    from rems_net.agents.experiment.run import Run

#: name of the output that every run has
RECORDER = "recorder"


class Experiment(Lineup):
    """Agents and a clock. Add agents, then `run`.

    dt, duration: seconds, or text with a unit ("100 ms"); duration None means until the
        inputs end.
    pace: "fast", or a real-time factor (1.0 is real time).
    folder: where relative file names start. on_failure: if an agent fails or dies,
        "stop" ends the run, "drop" goes on without it.
    wait: how long a run waits for the agents that other machines bring, or a table:
        {"start": "5 min", "back": "30 s"}; back is how long a machine may be out of
        sight, asleep or cut off, before its agents count as dead.
    seed: of the random numbers of all agents.
    native: whether agents use all features of this processor; then the last digits of
        recordings differ from those of other processors. record: whether a run that has
        no output of type mcap gets one, which writes run.mcap.
    """

    #: the output that a run has got, to record it
    _recorder: Plan | None = None

    @taught(
        ExperimentError,
        time="Experiment(..., duration=)",
        duration="Experiment(..., duration=)",
        dt="Experiment(..., dt=)",
        seed="Experiment(..., seed=)",
        fast='pace="fast"',
    )
    def run(
        self,
        out: Path | str | None = None,
        *,
        pace: float | str | None = None,
        alone: bool = False,
        direct: bool = False,
        show: Show | None = None,
    ) -> Result:
        """Check, start every agent in a process of its own, tick, end, and report.

        out: the folder of the outputs' files, `runs/<name>` by default; the files of an
        earlier run there are moved to `runs/<name>.1`.
        alone: also start agents of other machines here.
        direct: step all agents in this process, without any other: sooner for short
        runs, and the same bytes.
        show: displays the run; by default its progress on a terminal, else its events.
        The result has the recording of each robot, by its name.
        Raises ExperimentError before anything has started, and AgentError when an agent
        fails or dies; the outputs are complete up to there.
        """
        runner = registry.runner()
        if runner is not None:
            with registry.running_by(None):
                done: Result = runner(
                    self, out, pace=pace, alone=alone, direct=direct, show=show
                )
            return done
        registry.check_starts("run()")
        self.add_recorder()
        agents = self.check()
        ticks = self.ticks(agents)
        factor = check_pace((self.pace or "fast") if pace is None else pace, self.dt)
        nobody = "" if factor else idle(agents, self.plans)
        if not factor:
            check_hands(agents)
        if direct or self.direct:
            check_fast(factor)
            show = show or Show()
            if nobody:
                show.say("run", Event("warning", 0, "run", "idle", nobody))
            return run_direct(self, out, agents, ticks, show)
        with self.going(out, agents, ticks, factor, alone, show, nobody) as run:
            run.clock.run(ticks)
        return run.result

    @contextmanager
    def going(
        self,
        out: Path | str | None,
        agents: Mapping[str, Agent],
        ticks: int,
        pace: float,
        alone: bool = False,
        show: Show | None = None,
        nobody: str = "",
    ) -> "Iterator[Run]":
        """Start every agent in its process; the block makes the ticks by `run.clock`.

        agents: from `check`.  nobody: a warning that nothing is commanded, or "".
        """
        for plan in self.plans.values():  # before anything is moved or printed
            for cls in plan.classes if plan.host != HERE else ():
                reference(cls)
        # Here: the network takes a fifth of a second to load.
        from rems_net.agents.experiment.hosting.hosts import Hosts, restarts
        from rems_net.agents.experiment.placement.offers import machines_of, make_offers
        from rems_net.agents.experiment.run import Run
        from rems_net.agents.protocol.terms import Terms

        every = self.by_host()
        machines = {} if alone else machines_of(every)
        offers = make_offers(self, agents, machines)
        here = {h: p for h, p in every.items() if h not in machines}
        if show is None:
            from rems_net.agents.experiment.display import usual

            show = usual(self.name)
        hosts = Hosts(here, agents, show, self.dt, native=self.native)
        if nobody:
            hosts.say("clock", Event("warning", 0, "clock", "idle", nobody))
        terms = Terms(
            self.dt,
            ticks,
            pace,
            hosts={
                host: frozenset(plan.key for plan in plans)
                for host, plans in every.items()
            },
            tickets=hosts.tickets,
            machines=machines,
            outs={p.key: agents[p.key].published() for h in machines for p in every[h]},
            wait=self.wait if machines else self.wait._replace(start=JOIN_TIME),
            restarts=restarts(every),
            drop=self.on_failure == "drop",
        )
        # before the folder's lock, whose error would name another cause
        check_files(SESSION + PROCESS * len(here))
        near = [agents[plan.key].needs for plan in here.get(HERE, ())]
        warn_of_numerics(*sorted({library for needs in near for library in needs}))
        native = bool(near)
        with own_folder(self, out, agents, show, native=native, pace=pace) as folder:
            beside = "" if self.fabric else self.name
            run = Run(self.fabric, terms, hosts, folder, offers, beside=beside)
            with run.going():
                yield run
            finish(folder, run.result)

    @taught(ExperimentError)
    def engine(self, out: Path | str | None = None) -> Solo:
        """Return this experiment as an engine: stepped in this process, by its caller.

        out: folder of the outputs' files; without it, outputs are left out. Raises
        ExperimentError for a mistake in the experiment.
        """
        registry.end_import()
        if out is not None:
            self.add_recorder()
            out = check_folder(out)
        engine = Solo(self, out)
        agents = engine.build()
        check_direct(self.plans, agents)
        if out is not None:
            put_manifest(manifest(self, agents, native=True), make_folder(out))
        for text in doubts(agents):
            warn("start", text)
        if self.ends(agents):
            engine.ticks = self.ticks(agents)
        return engine

    def add_recorder(self) -> None:
        """Add an output that records the run, unless there is one or none is wanted.

        It lives with an output, or with all agents if they share a process: then it
        needs no process, and gets no message twice. It waits for the values of all
        agents, so no robot shares its process otherwise. With `on_failure = "drop"` it
        must outlive the others, so it has a process of its own.
        """
        if self._recorder is not None:  # of an earlier run, with other agents
            self.plans.pop(self._recorder.key, None)
            self._recorder = None
        mcap = parts.find("output", "mcap", self.folder)
        plans = [*self.plans.values()]
        every = [cls for plan in plans for cls in plan.classes]
        if not (plans and self.record) or any(issubclass(c, mcap) for c in every):
            return
        name = RECORDER
        while f"output/{name}" in self.plans:  # the user has an output of this name
            name += "_"
        self.output(name, "mcap")
        self._recorder = plan = self.plans[f"output/{name}"]
        if self.on_failure == "drop":
            return
        # A process whose outputs may leave ticks out takes no part in the steps.
        free = {
            p.host for p in plans for c in p.classes if not getattr(c, "lockstep", 1)
        }
        apart = {p.host for p in plans if p.kind != "output" or p.machine}
        shared = [p.host for p in plans if p.host not in apart | free]
        if not shared and len(apart) == 1 and not any(p.machine for p in plans):
            shared = [*apart - free]
        if shared:
            plan.host = shared[0]
