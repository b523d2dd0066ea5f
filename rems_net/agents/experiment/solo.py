"""Solo: a whole experiment in this process, stepped by its caller."""

from collections.abc import Callable, Mapping, MutableMapping
from functools import cache
from math import inf
from pathlib import Path
from threading import get_ident
from typing import Any, Self

from rems_net.agents.about.mistakes import sum_up
from rems_net.agents.about.wiring import Entry
from rems_net.agents.agent import Agent, Output
from rems_net.agents.background.overdue import naming_overdue
from rems_net.agents.diagnosis import failure
from rems_net.agents.experiment.checking.settings import check_seed
from rems_net.agents.experiment.lineup import Lineup
from rems_net.agents.protocol.plan import Plan
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick, time_of
from rems_net.agents.verbs import verbs_of
from rems_net.defdict import parse_quantity
from rems_net.engine.engine import Engine
from rems_net.engine.inlet import Inlet
from rems_net.engine.visits import Visits
from rems_net.errors import AgentError, ExperimentError, nearest
from rems_net.events import warn
from rems_net.maths.numerics import describe


class Solo:
    """Steps a whole experiment in this process: no network, no other process.

        with lab.engine() as engine:
            engine.step(20)
            print(engine["robot/sim"].state["x"])

    The values are those of `lab.run()`, to the last bit; with a physics engine, only in
    a process that was started pinned, as `rems` starts its own (else it warns).

    out: folder of the outputs' files; None leaves the outputs out.  ticks: number
    after which `run()` ends; None for no end.
    """

    def __init__(self, lab: Lineup, out: Path | None, ticks: int | None = None):
        self.dt, self.ticks, self.seed = lab.dt, ticks, lab.seed
        self._lab, self._out = lab, out
        #: agents that are built and not open yet, with their plans
        self._built: list[tuple[Agent, Plan]] = []
        #: the newest tick that was done; 0 before the first
        self.n = 0
        #: files that the outputs have made; known after `close`
        self.files: list[str] = []
        self._engine: Engine | None = None
        self._entries: list[Entry] = []
        #: agents that the caller has asked for
        self._noted: dict[str, Agent] = {}
        #: ticks at which agents join
        self._joins: set[int] = set()
        #: whether a tick was begun and not finished
        self._within = False
        self._thread = 0

    @property
    def t(self) -> float:
        """Fabric time [s] at the end of the newest tick."""
        return time_of(self.n, self.dt)

    @property
    def agents(self) -> Mapping[str, Agent]:
        """All agents, by key, to be read."""
        return self._here().agents

    def build(self) -> dict[str, Agent]:
        """Build and check every agent for the next `open`. Raises ExperimentError."""
        plans = self._lab.plans
        for plan in plans.values():
            plan.out = self._out or Path()
        agents = self._lab.check(self.seed)
        self._built = [
            (agents[key], plan)
            for key, plan in plans.items()
            if self._out is not None or plan.kind != "output"
        ]
        return agents

    def open(self) -> Self:
        """Build every agent and let it acquire its devices and files. Returns self."""
        if self._engine is not None:
            raise ExperimentError(
                "this engine is open already; close() it first. (R0434)"
            )
        if not self._built:
            self.build()
        engine, self._entries = Engine(), []
        needs: set[str] = set()
        for agent, plan in self._built:
            if isinstance(agent, Output):  # an engine has nobody to leave behind
                runtime(agent).in_step = True
            engine.add(agent, plan.sources, plan.again)
            reads = [*plan.sources.values()]
            self._entries.append(Entry.of(agent, reads, plan.since))
            needs |= {*agent.needs}
        self._built = []
        for inlet in engine.inlets:
            if inlet.source is None and inlet.schema is not None:
                inlet.sources = [Given(inlet, engine.given, engine.visits)]
        self._joins = {1, *(entry.since for entry in self._entries)}
        warn_of_numerics(*sorted(needs))
        self.n, self._within, self.files = 0, False, []
        self._engine, self._thread = engine, get_ident()
        try:
            try:
                with naming_overdue():
                    engine.open()
            except (Exception, SystemExit) as error:
                raise self._blamed(engine, error) from error
        except BaseException as error:
            self.__exit__(type(error), error)
            raise
        return self

    def close(self) -> None:
        """Close every agent. Raises AgentError for one that fails while it closes."""
        engine, self._engine = self._engine, None
        for agent in self._noted.values():  # a circle would keep its files open
            for name in verbs_of(agent):
                agent.__dict__.pop(name, None)
        self._noted.clear()
        if engine is not None:
            self.files, failed = engine.close()
            if failed is not None:
                raise AgentError(*failed)

    def reset(self, seed: int | None = None) -> Self:
        """Begin again, also after a failure, with this seed or the same.

        Every agent is made again: it may have kept anything in attributes of its own.
        """
        seed = self.seed if seed is None else check_seed(seed)
        self.close()
        self.seed, self._built = seed, []
        return self.open()

    def __enter__(self) -> Self:
        return self if self._engine is not None else self.open()

    def __exit__(self, kind: object, error: BaseException | None, *_: object) -> None:
        try:
            self.close()
        except AgentError:
            if error is None:  # otherwise the first failure is the one to report
                raise

    def step(self, count: int = 1) -> None:
        """Do this many ticks. Raises AgentError for an agent that fails."""
        engine = self._here()
        if type(count) is not int or count < 0:
            raise ExperimentError(
                f"step() takes a number of ticks, such as 10, and got {count!r:.60}; "
                'run(until="2 s") goes on to a time. (R0434)'
            )
        if self._within:
            raise ExperimentError(
                f"tick {self.n + 1} was begun and not done to its end; reset() begins "
                "again, and an agent does not step its own engine. (R0434)"
            )
        try:
            if engine.stepped():
                self._ticks(engine, count)
            else:
                with naming_overdue(engine.stepped):
                    self._ticks(engine, count)
        except (Exception, SystemExit) as error:
            raise self._blamed(engine, error) from error

    def _ticks(self, engine: Engine, count: int) -> None:
        dt = self.dt
        for n in range(self.n + 1, self.n + 1 + count):
            self._within = True
            if n in self._joins:
                engine.connect({e.key: e for e in self._entries if e.since <= n})
            engine.step(Tick(n, time_of(n, dt), dt))
            self.n, self._within = n, False

    def run(self, until: "float | str | Callable[[Solo], bool] | None" = None) -> None:
        """Step until the experiment ends.

        until: fabric time (seconds, or text such as "200 ms"), or a function of this
        engine, called after each tick, that returns True to end.
        """
        if callable(until):
            while not until(self) and self.n < (self.ticks or inf):
                self.step()
            return
        if until is None and self.ticks is None:
            raise ExperimentError(
                "this experiment has no end: give it a duration, or write "
                "run(until=10). (R0411)"
            )
        last = self.ticks or 0
        if until is not None:
            last = round(parse_quantity(until, "s") / self.dt)
        self.step(max(0, last - self.n))

    def __getitem__(self, key: str) -> Any:
        """Return an agent by its key, such as `robot/sim`, or by its name alone."""
        engine = self._here()
        agents = engine.agents
        found = [k for k in agents if k == key or k.partition("/")[2] == key]
        if len(found) != 1:
            raise KeyError(
                f"there is no agent {key!r}; there is {', '.join(agents)}."
                f"{nearest(key, agents)} (R0434)"
            )
        agent = agents[found[0]]
        if agent.key not in self._noted:  # its calls are noted from now on
            self._noted[agent.key] = agent
            agent.__dict__.update(engine.visits.verbs(agent))
        return agent

    def put(self, key: str, values: Mapping[str, Any]) -> None:
        """Put a value at an In that no agent writes, such as `robot/sim/command`.

        values: fields in the units of the In, or quantities. The agent takes them at
        its next step; a robot obeys a command for its `max_age`.
        """
        self.put_at(self.inlet(key), values)

    def put_at(self, inlet: Inlet, values: Mapping[str, Any]) -> None:
        """Put a value at an In of `inlet()`, without a look at its key."""
        inlet.put(values, self.n)
        if (engine := self._here()).visits.recorders:  # it is noted when it is taken
            engine.given[inlet.key] = self.n

    def inlet(self, key: str) -> Inlet:
        """Return an In that no agent writes. Raises ExperimentError for any other."""
        inlets = {i.key: i for i in self._here().inlets if i.schema}
        free = [key for key, inlet in inlets.items() if inlet.source is None]
        if key not in free:
            reads = f"reads {inlets[key].source!r} already" if key in inlets else ""
            raise ExperimentError(
                f"{key!r} {reads or 'is no In here'}; values can be put at: "
                f"{', '.join(free) or 'nothing'}.{nearest(key, free)} (R0434)"
            )
        return inlets[key]

    def stop(self) -> None:
        """Hold every robot at its safe command, as `rems stop` does."""
        self._here().hold(True)

    def release(self) -> None:
        """Let the robots obey their commands again."""
        self._here().hold(False)

    def sum_up(self, *, failed: bool) -> None:
        """Warn of mistakes that are known only at the end, such as Outs never set."""
        engine = self._here()
        agents = engine.agents.values()
        sum_up(agents, engine.inlets, engine.draws, "an agent", failed=failed)

    def _here(self) -> Engine:
        """Return the engine, if it may be used now. Raises ExperimentError."""
        if self._engine is None:
            raise ExperimentError("this engine is closed; open() it first. (R0434)")
        if self._thread != get_ident():
            raise ExperimentError(
                "this engine was opened in another thread; an engine is used in one "
                "thread only. Open one for each. (R0434)"
            )
        return self._engine

    def _blamed(self, engine: Engine, error: BaseException) -> AgentError:
        """Return the AgentError of an exception in an agent's code."""
        n, acting = self.n + 1 if self._within else 0, engine.acting
        return AgentError(*failure(acting or "the experiment", error, n, engine.agents))


@cache
def warn_of_numerics(*physics: str) -> None:
    """Warn, once in a process, that these libraries may give other last digits."""
    if physics and not describe().endswith("pinned"):
        warn(
            "numerics",
            f"this process was not started pinned: the last digits of "
            f"{' and '.join(physics)} may differ from those of `rems run`.",
        )


class Given:
    """The caller of an engine, who has put a value at an In: a source of `Solo`."""

    key, label = "", "the program that steps the engine"
    entry: Entry | None = None

    def __init__(self, inlet: Inlet, given: MutableMapping[str, Any], visits: Visits):
        self._inlet, self._given, self._visits = inlet, given, visits

    def take(self, tick: Tick) -> None:
        """Note the value, which is there already, at the step that takes it."""
        source_tick = self._given.pop(self._inlet.key, None)
        if source_tick is not None:
            value = self._inlet.agent.__dict__[self._inlet.port]
            self._visits.put(self._inlet, value, tick.n - 1, source_tick)
