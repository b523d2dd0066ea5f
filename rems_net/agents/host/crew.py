"""Crew: the agents of one host, stepped in the order of the phases."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

from rems_net.agents.agent import PHASES, Agent, Output, files_of
from rems_net.agents.diagnosis import failure
from rems_net.agents.host.inbox import Inbox
from rems_net.agents.host.inlet import Inlet
from rems_net.agents.host.outlet import Outlet
from rems_net.agents.protocol.roster import Roster
from rems_net.agents.robot import Driver
from rems_net.agents.tick import Tick
from rems_net.agents.world import Shared
from rems_net.defdict import DefDict
from rems_net.errors import SchemaError
from rems_net.router.message import pack_stamp


@dataclass(slots=True)
class Phase:
    """The agents of one kind, in the order of their keys, with their ports."""

    inlets: list[Inlet]
    steps: list[Callable[[Tick], None]]
    outlets: list[Outlet]


class Crew:
    """Steps these agents, as far as the roster names them."""

    def __init__(self, name: str):
        self.name, self.badge = name, 0
        #: who would be to blame for an exception now
        self.acting = name
        self._phases: list[Phase] = []

    def muster(
        self,
        roster: Roster,
        agents: Mapping[str, Agent],
        inlets: list[Inlet],
        outlets: list[Outlet],
    ) -> None:
        """From now on, step those whom the roster names."""
        self._phases = []
        here = sorted(k for k in agents if k in roster.agents)
        for kind in PHASES:
            named = [agents[k] for k in here if agents[k].kind == kind]
            if named:
                keys = {agent.key for agent in named}
                self._phases.append(
                    Phase(
                        [i for i in inlets if i.agent.key in keys],
                        self._steps(named),
                        [o for o in outlets if o.agent.key in keys],
                    )
                )

    def step(self, tick: Tick, inbox: Inbox) -> None:
        """Do tick `tick`: for each phase read, step, write."""
        # With a thousand robots here, most are told nothing and seen by nobody: what
        # needs nothing done is passed over without a call.
        n, stamp = tick.n, pack_stamp(tick.n, tick.t, self.badge)
        latest = inbox.seat.latest
        for phase in self._phases:
            for inlet in phase.inlets:
                if inlet.source is None and inlet.key not in latest:
                    continue
                if not n % inlet.agent.every:
                    inlet.fill(tick, inbox)
            for step in phase.steps:
                step(tick)
            for outlet in phase.outlets:
                agent = outlet.agent
                if n % agent.every:
                    continue
                outlet.n = n
                if outlet.wanted or outlet.publisher.watched or outlet.closing:
                    fresh = agent.origin == n
                    outlet.publish(stamp if fresh else outlet.stamp(n, tick.t))

    def _steps(self, agents: list[Agent]) -> list[Callable[[Tick], None]]:
        """What steps these agents; robots that are a swarm to their driver at once."""
        steps: list[Callable[[Tick], None]] = []
        swarms: dict[object, list[Driver]] = {}
        for agent in agents:
            if isinstance(agent, Driver):
                swarms.setdefault(agent.likeness(), []).append(agent)
            else:
                steps.append(partial(self._step_one, agent, agent.step))
        for robots in swarms.values():
            together: Callable[[Tick], None] | None = None
            if (world := robots[0].shared) is not None:
                together = partial(self._step_world, robots, world)
            elif len(robots) > 1:
                together = type(robots[0]).swarm(robots)
            if together is not None:
                steps.append(partial(self._step_many, robots, together))
            else:
                steps += [partial(self._step_one, r, r.step) for r in robots]
        return steps

    def _step_one(
        self, agent: Agent, step: Callable[[Tick], object], tick: Tick
    ) -> None:
        if tick.n % agent.every:
            return
        self.acting = agent.key
        agent.begin(tick)
        if (returned := step(agent.tick)) is not None:
            _refuse(agent, returned)
        agent.origin = agent.source_tick()
        self.acting = self.name

    def _step_many(
        self, robots: list[Driver], step: Callable[[Tick], None], tick: Tick
    ) -> None:
        if tick.n % robots[0].every:
            return
        self.acting = f"{robots[0].key} and {len(robots) - 1} more"
        for robot in robots:
            robot.begin(tick)
            robot.origin = tick.n
        step(robots[0].tick)
        self.acting = self.name

    def _step_world(self, robots: list[Driver], world: Shared, tick: Tick) -> None:
        """What `Robot.step` does, for all that are in one world."""
        for robot in robots:
            robot.obey(tick)
        world.advance(tick.dt)
        try:
            for robot in robots:
                robot.sense()
        except BaseException:
            self.acting = robot.key
            raise


def close(
    agents: Mapping[str, Agent],
) -> tuple[list[str], tuple[str, str] | None]:
    """Close all of them: the files they made, and the first that failed in it."""
    made: list[str] = []
    failed: tuple[str, str] | None = None
    for agent in agents.values():
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


def _refuse(agent: Agent, returned: object) -> None:
    """Raise SchemaError where a step returned what it should have set."""
    outs = list(agent.outs())
    if outs and isinstance(returned, Mapping | DefDict):
        raise SchemaError(
            f"{type(agent).__name__}.step returned {returned!r:.60}, which goes "
            f"nowhere; set its Out: self.{outs[0]} = {returned!r:.60}"
        )
