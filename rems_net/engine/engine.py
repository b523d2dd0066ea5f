"""Engine: steps agents, tick by tick, in the order of the phases.

Order inside a tick: inputs, robots, worlds, processes, outputs. An In reads the value
of this tick from an earlier phase, and the value of the tick before from any other. So
what a tick computes depends on the agents alone, and not on where they run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, MutableMapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from rems_net.agents.agent import PHASES, Agent, Output, files_of
from rems_net.agents.diagnosis import failure
from rems_net.agents.robot import Driver, Robot
from rems_net.agents.runtime import Runtime, runtime
from rems_net.agents.tick import Tick
from rems_net.agents.world import Shared
from rems_net.defdict import DefDict, Schema
from rems_net.engine.inlet import Elsewhere, Inlet
from rems_net.engine.wiring import Entry
from rems_net.errors import SchemaError

Step = Callable[[Tick], object]


@dataclass(slots=True)
class Phase:
    """The agents of one kind that take part, in the order of their keys.

    inlets: Ins that are connected.  given: Ins that programs outside may fill, by key.
    """

    kind: str
    inlets: list[Inlet]
    given: dict[str, Inlet]
    steps: list[Step]


class Engine:
    """Steps agents that live in this process.

    given: what came from outside, by key of the In (`robot/sim/command`); an In takes
    it at the next step of its agent.
    """

    def __init__(self, given: MutableMapping[str, Any] | None = None):
        self.agents: dict[str, Agent] = {}
        self.inlets: list[Inlet] = []
        self.given: MutableMapping[str, Any] = {} if given is None else given
        #: key of the agent whose code runs now; "" between agents
        self.acting = ""
        self._phases: list[Phase] = []
        self._stepped = False

    # -- once --------------------------------------------------------------------

    def add(self, agent: Agent) -> None:
        """Take in an agent that is prepared."""
        self.agents[agent.key] = agent

    def wire(self, sources: Mapping[str, Mapping[str, str]]) -> None:
        """Make the Ins. sources: agent -> In -> its connection."""
        for agent in self.agents.values():
            told = sources.get(agent.key, {})
            for port in agent.ins():
                self.inlets.append(Inlet(agent, port, told.get(port)))

    def open(self) -> None:
        """Let every agent acquire what it needs, in the order in which they came."""
        for agent in self.agents.values():
            self.acting = agent.key
            agent.open()
        self.acting = ""

    def close(self) -> tuple[list[str], tuple[str, str] | None]:
        """Close every agent, whatever happens.

        Returns the files they made, and the first agent that failed in it, with the
        cause.
        """
        made: list[str] = []
        failed: tuple[str, str] | None = None
        for agent in self.agents.values():
            try:
                agent.jobs.close()
                agent.close()
            except (Exception, SystemExit) as error:
                failed = failed or failure(agent.key, error)
            try:
                made += files_of(agent) if isinstance(agent, Output) else []
            except (Exception, SystemExit) as error:
                failed = failed or failure(agent.key, error)
        return made, failed

    # -- who takes part ----------------------------------------------------------

    def connect(
        self,
        entries: Mapping[str, Entry],
        schema: Callable[[str], Schema],
        elsewhere: Elsewhere,
    ) -> None:
        """Step the agents in `entries` from now on, connected to each other.

        schema: of a digest.  elsewhere: makes the source of a port that no agent of
        this engine writes in lock-step. Raises ExperimentError or ConversionError.
        """
        for inlet in self.inlets:
            inlet.connect(entries, self.agents, schema, elsewhere)
        self._phases = []
        here = sorted(key for key in self.agents if key in entries)
        for kind in PHASES:
            named = [self.agents[k] for k in here if self.agents[k].kind == kind]
            if named:
                keys = {agent.key for agent in named}
                ins = [i for i in self.inlets if i.agent.key in keys]
                self._phases.append(
                    Phase(
                        kind,
                        [i for i in ins if i.source is not None],
                        {i.key: i for i in ins if i.source is None},
                        self._steps(named),
                    )
                )

    def _steps(self, agents: list[Agent]) -> list[Step]:
        """Return what steps these agents: similar robots of one driver at once."""
        steps: list[Step] = []
        swarms: dict[object, list[Driver]] = {}
        for agent in agents:
            if isinstance(agent, Driver):
                swarms.setdefault(agent.likeness(), []).append(agent)
            else:
                steps.append(partial(self._step_one, agent, agent.step))
        for robots in swarms.values():
            together: Step | None = None
            if (world := robots[0].shared) is not None:
                together = partial(self._step_world, robots, world)
            elif len(robots) > 1:
                together = type(robots[0]).swarm(robots)
            if together is not None:
                runs = [runtime(robot) for robot in robots]
                steps.append(partial(self._step_many, robots, runs, together))
            else:
                steps += [partial(self._step_one, r, r.step) for r in robots]
        return steps

    # -- at each tick ------------------------------------------------------------

    def step(self, tick: Tick, after: Callable[[str, Tick], None]) -> None:
        """Do one tick. after: called with each phase's kind when it is done."""
        n, given = tick.n, self.given
        for phase in self._phases:
            # Most robots of a swarm get no command: look at the shorter of the two.
            if given and phase.given:
                few = phase.given if len(phase.given) < len(given) else [*given]
                for key in few:
                    inlet = phase.given.get(key)
                    if inlet is not None and not n % inlet.run.every:
                        inlet.fill(tick)
            for inlet in phase.inlets:
                if not n % inlet.run.every:
                    inlet.fill(tick)
            for step in phase.steps:
                step(tick)
            after(phase.kind, tick)

    def _step_one(self, agent: Agent, step: Step, tick: Tick) -> None:
        run = runtime(agent)
        if tick.n % run.every:
            return
        self.acting = agent.key
        if (returned := step(run.begin(tick))) is not None:
            _refuse(agent, returned)
        run.end()
        self.acting = ""

    def _step_many(
        self, robots: list[Driver], runs: list[Runtime], step: Step, tick: Tick
    ) -> None:
        first = runs[0]
        if tick.n % first.every:
            return
        self.acting = f"{robots[0].key} and {len(robots) - 1} more"
        for run in runs:
            run.begin(tick)
            run.source_tick = tick.n
        step(first.tick)
        self.acting = ""

    def _step_world(self, robots: list[Driver], world: Shared, tick: Tick) -> None:
        """Do what `Robot.step` does, for all robots of one world."""
        for robot in robots:
            robot.obey(tick)
        world.advance(tick.dt)
        try:
            for robot in robots:
                robot.sense()
        except BaseException:
            self.acting = robot.key
            raise

    def stepped(self) -> bool:
        """Return whether every agent has done a step; may be called in any thread."""
        if not self._stepped and not self.acting:
            agents = [*self.agents.values()]
            self._stepped = bool(agents) and all(runtime(a).tick.n for a in agents)
        return self._stepped

    def hold(self, stopped: bool) -> None:
        """From now on every robot obeys its safe command, or no longer."""
        for agent in self.agents.values():
            if isinstance(agent, Robot):
                runtime(agent).stopped = stopped

    def forget(self) -> None:
        """Forget a clock that is gone: no robot has a command any more."""
        for agent in self.agents.values():
            runtime(agent).forget()
            if isinstance(agent, Robot):
                agent.command = agent.command.schema()


def _refuse(agent: Agent, returned: object) -> None:
    """Raise SchemaError if a step returned what it should have set."""
    outs = list(agent.outs())
    if outs and isinstance(returned, Mapping | DefDict):
        raise SchemaError(
            f"{type(agent).__name__}.step returned {returned!r:.60}, which goes "
            f"nowhere; set its Out: self.{outs[0]} = {returned!r:.60}"
        )
