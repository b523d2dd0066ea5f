"""Engine: steps agents, tick by tick, in the order of the phases.

Order inside a tick: inputs, robots, worlds, processes, outputs. An In reads the value
of this tick from an earlier phase, and the value of the tick before from any other. So
the results of a tick depend on the agents alone, and not on where they run.
"""

from collections.abc import Callable, Iterable, Mapping, MutableMapping, Sequence
from functools import partial
from typing import Any, NamedTuple

from rems_net.agents.about.mistakes import refuse_returned
from rems_net.agents.about.wiring import Entry
from rems_net.agents.agent import PHASES, Agent, Output, files_of
from rems_net.agents.diagnosis import failure
from rems_net.agents.robot import Driver, Robot, be_safe
from rems_net.agents.runtime import Runtime, runtime
from rems_net.agents.tick import Tick
from rems_net.agents.verbs import CALLED
from rems_net.engine.called import Calls
from rems_net.engine.inlet import Inlet, Network
from rems_net.engine.recorded import MessageInlet
from rems_net.engine.share import Share, Trail
from rems_net.engine.visits import Visits
from rems_net.maths.draws import Draws
from rems_net.scenes.shared import Shared

Step = Callable[[Tick], object]
After = Callable[[str, Tick], None]


class Phase(NamedTuple):
    """The agents of one kind that take part, in the order of their keys.

    inlets: Ins that are connected, calls of verbs first.  given: Ins that programs
    outside may fill, by key.  last: of its kind: each output has its own.
    """

    kind: str
    inlets: list[Inlet]
    given: dict[str, Inlet]
    steps: list[Step]
    last: bool


class Engine:
    """Steps agents that live in this process."""

    def __init__(self) -> None:
        self.agents: dict[str, Agent] = {}
        self.inlets: list[Inlet] = []
        #: Values from outside, by key of the In (`robot/sim/command`). An In takes its
        #: value at the next step of its agent.
        self.given: MutableMapping[str, Any] = {}
        #: key of the agent whose code runs now; "" between agents
        self.acting = ""
        #: calls of verbs that come from no agent
        self.visits = Visits(self.inlets)
        self._phases: list[Phase] = []
        self._stepped = False
        self.draws = Draws()  # random numbers that agents draw

    def add(
        self,
        agent: Agent,
        sources: Mapping[str, str],
        again: Iterable[Sequence[Any]] = (),
    ) -> None:
        """Add an agent that is prepared.

        sources: by In, its source.  again: calls from outside, to be repeated.
        """
        self.agents[agent.key] = agent
        self.visits.plan(agent, again)
        runtime(agent).sources = sources
        several = {port.partition("/")[0] for port in sources if "/" in port}
        for port, one in agent.ins().items():
            if port not in several and (port in sources or not one.optional):
                kind = MessageInlet if one.messages else Inlet
                inlet = kind(agent, port, sources.get(port), self.agents)
                self.inlets.append(inlet)
                if isinstance(inlet, MessageInlet):
                    self.visits.recorders.append(inlet)
        for port, source in sorted(sources.items()):
            if port.startswith(CALLED):
                self.inlets.append(Calls(agent, source, self.agents))
            elif "/" in port:
                part = Trail if agent.kind == "world" else Share
                self.inlets.append(part(agent, port, source, self.agents))

    def open(self) -> None:
        """Let every agent acquire its devices and files, in the order of adding."""
        self.draws = Draws()  # earlier draws are not the agents'
        for agent in self.agents.values():
            self.acting = agent.key
            agent.open()
        self.acting = ""

    def close(self) -> tuple[list[str], tuple[str, str] | None]:
        """Close every agent, also after errors.

        Returns the files they made, and the first agent that failed, with the cause.
        """
        made: list[str] = []
        failed: tuple[str, str] | None = None
        for agent in self.agents.values():
            for end in (agent.jobs.close, agent.close, partial(_collect, agent, made)):
                try:
                    end()
                except (Exception, SystemExit) as error:
                    failed = failed or failure(agent.key, error)
        self._phases = []  # a circle of references would keep agents' files open
        return made, failed

    def connect(
        self, entries: Mapping[str, Entry], network: Network | None = None
    ) -> None:
        """Step the agents in `entries` from now on, connected to each other.

        Without a network, all of them are in this engine. Raises ExperimentError or
        ConversionError.
        """
        for inlet in self.inlets:
            inlet.connect(entries, network)
        self._phases = []
        here = [a for key, a in sorted(self.agents.items()) if key in entries]
        present = [i for i in self.inlets if i.agent.key in entries]
        for kind in PHASES:
            some = [agent for agent in here if agent.kind == kind]
            groups = [some]
            if kind == "output":  # none waits for another's; a recorder for the most
                groups = [[one] for one in sorted(some, key=_is_recorder)]
            for group in groups:
                ins = [i for i in present if PHASES[i.phase] == kind]
                if kind == "output":
                    ins = [i for i in ins if i.agent is group[0]]
                linked = [i for i in ins if i.source is not None]
                linked.sort(key=lambda i: not isinstance(i, Calls))
                free = {i.key: i for i in ins if i.source is None}
                if steps := self._steps(group):
                    last = group is groups[-1]
                    self._phases.append(Phase(kind, linked, free, steps, last))

    def _steps(self, agents: list[Agent]) -> list[Step]:
        """Return functions that step these agents: similar robots together."""
        groups: dict[object, list[Any]] = {}
        for agent in agents:
            alike = agent.likeness() if isinstance(agent, Driver) else agent.key
            groups.setdefault(alike, []).append(agent)
        steps: list[Step] = []
        for some in groups.values():
            step: Step | None = None
            if isinstance(some[0], Driver) and (world := some[0].shared) is not None:
                step = partial(self._step_world, some, world)
            elif len(some) > 1:
                step = type(some[0]).swarm(some)
            if step is not None:
                steps.append(self._group(some, step))
            else:
                steps += [self._group([agent], agent.step) for agent in some]
        return steps

    def _group(self, agents: list[Agent], step: Step) -> Step:
        """Return a function that steps these agents, and settles their run states."""
        more = f" and {len(agents) - 1} more" if len(agents) > 1 else ""
        runs = [runtime(agent) for agent in agents]
        return partial(self._step, agents[0].key + more, agents[0], runs, step)

    def step(self, tick: Tick, after: After | None = None) -> None:
        """Do one tick. after: called with each phase's kind when it is done."""
        n, given = tick.n, self.given
        self.visits.begin(n)
        for phase in self._phases:
            for inlet in phase.inlets:
                if not n % inlet.every:
                    inlet.fill(tick)
            if given and phase.given:  # most robots of a swarm get nothing
                for key in phase.given.keys() & given.keys():
                    if not n % phase.given[key].every:
                        phase.given[key].fill(tick)
            for step in phase.steps:
                step(tick)
            if after is not None and phase.last:
                after(phase.kind, tick)
        self.visits.end()

    def _step(
        self, acting: str, agent: Agent, runs: list[Runtime], step: Step, tick: Tick
    ) -> None:
        first = runs[0]
        if tick.n % first.every:
            return
        self.acting = acting
        for run in runs:
            run.begin(tick)
        if (returned := step(first.tick)) is not None:
            refuse_returned(agent, returned)
        first.end()
        self.acting = ""

    def _step_world(self, robots: list[Driver], world: Shared, tick: Tick) -> None:
        """Do the step of `Robot.step`, for all robots of one world."""
        for robot in robots:
            robot.obey(tick)
        if world.before is not None:
            world.before(tick)
        world.advance(tick.dt)
        for robot in robots:
            self.acting = robot.key
            robot.sense()

    def stepped(self) -> bool:
        """Return whether every agent has done a step; may be called in any thread."""
        if not self._stepped and not self.acting:
            agents = [*self.agents.values()]
            self._stepped = bool(agents) and all(runtime(a).tick.n for a in agents)
        return self._stepped

    def hold(self, stopped: bool) -> None:
        """Set whether every robot obeys its safe command from now on.

        Outputs know it, too: to record it.
        """
        for agent in self.agents.values():
            if isinstance(agent, Robot | Output):
                runtime(agent).stopped = stopped

    def forget(self) -> None:
        """Forget a clock that is gone: no robot has a command any more."""
        for inlet in self.inlets:
            if isinstance(inlet, Calls):
                inlet.forget()
        for agent in self.agents.values():
            runtime(agent).forget()
            if isinstance(agent, Robot):
                be_safe(agent)


def _collect(agent: Agent, made: list[str]) -> None:
    """Add the files that an output has made."""
    if isinstance(agent, Output):
        made += files_of(agent)


def _is_recorder(agent: Agent) -> bool:
    return any(port.messages for port in agent.ins().values())
