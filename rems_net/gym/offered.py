"""Offered: what an experiment offers to an environment: its Ins, ports and starts."""

from collections.abc import Iterator, Mapping, Sequence
from math import lcm
from typing import Any, NamedTuple

from rems_net.agents.agent import Agent
from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.protocol.plan import Plan
from rems_net.agents.robot import Driver, Robot
from rems_net.agents.runtime import runtime
from rems_net.defdict import Schema
from rems_net.errors import ExperimentError, nearest, some

#: initial values by robot
Starts = Mapping[str, Mapping[str, Any]]


class Ports(NamedTuple):
    """The schemas of an environment's ports, by their keys.

    act: the Ins that actions are put at.  observe: the ports that are read.  starts: of
    each robot's initial values.  every: number of ticks after which all agents have
    stepped.
    """

    act: dict[str, Schema]
    observe: dict[str, Schema]
    starts: dict[str, Schema]
    every: int


def begins_by_verbs(lab: Experiment) -> bool:
    """Return whether resetting robots and worlds is a whole new beginning."""
    robots = [plan for plan in lab.plans.values() if plan.kind == "robot"]
    others = [p for p in lab.plans.values() if p.kind in ("input", "process")]
    return not others and not any(plan.sources for plan in robots)


def beginnings(lab: Experiment, starts: Starts) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the worlds, and the robots in none, in the order in which they reset.

    Each with its initial values: of a world, those of its robots, by their keys.
    """
    for key, plan in sorted(lab.plans.items()):
        if plan.kind == "world":
            robots = [one for one in lab.plans.values() if one.world == key]
            yield key, {one.key: start_of(one, starts) for one in robots}
        elif plan.kind == "robot" and not plan.world:
            yield key, start_of(plan, starts)


def start_of(plan: Plan, starts: Starts) -> dict[str, Any]:
    """Return the initial values of one robot: the experiment's own, and the drawn."""
    return {**plan.initial, **starts.get(plan.key, {})}


def with_starts(lab: Experiment, starts: Starts) -> None:
    """Give the plans of the experiment their drawn initial values."""
    for key in starts:
        lab.plans[key].initial = start_of(lab.plans[key], starts)


def checked(
    lab: Experiment, act: Sequence[str], observe: Sequence[str], *, here: bool
) -> Ports:
    """Return the schemas of all ports of an environment. Raises ExperimentError.

    here: whether an engine in this process steps its agents
    """
    agents = lab.check()
    if here:
        _check_here(agents)
    commands = _free(agents, lab.plans)
    known = {f"{k}/{p}": s for k, a in agents.items() for p, s in a.published().items()}
    for key in act:
        if key not in commands:
            raise _no_act(key, commands, lab.plans)
    for key in observe:
        if key not in known:
            raise ExperimentError(
                f"observe has {key!r}, and no agent writes that; there is "
                f"{some(known)}.{nearest(key, known)} (R0926)"
            )
    starts = {k: a.initial_schema for k, a in agents.items() if isinstance(a, Robot)}
    every = lcm(*(runtime(agent).every for agent in agents.values()))
    return Ports(
        {key: commands[key] for key in act},
        {key: known[key] for key in observe},
        starts,
        every,
    )


def _check_here(agents: Mapping[str, Agent]) -> None:
    """Raise ExperimentError for robots that an engine in this process cannot step."""
    for key, agent in agents.items():
        if not agent.lockstep:
            raise ExperimentError(
                f"{key} drives a device, which lives in wall time, and this "
                "environment steps models and simulations: make it with fabric=True, "
                "or give the robot another driver. (R0928)"
            )
        if isinstance(agent, Driver) and agent.one_per_process:
            raise ExperimentError(
                f"{key} has a driver of which a process holds one robot only, and a "
                "program may make an environment again: make it with fabric=True, in "
                "which each robot has a process. (R0928)"
            )


def _free(agents: Mapping[str, Agent], plans: Mapping[str, Plan]) -> dict[str, Schema]:
    """Return the Ins that no agent writes, by key."""
    return {
        f"{key}/{port}": agent.__dict__[port].schema
        for key, agent in agents.items()
        for port in agent.ins()
        if not plans[key].reads(port) and hasattr(agent.__dict__.get(port), "schema")
    }


def _no_act(
    key: str, free: Mapping[str, Schema], plans: Mapping[str, Plan]
) -> ExperimentError:
    agent, _, port = key.rpartition("/")
    if agent in plans and (by := plans[agent].reads(port)):
        return ExperimentError(
            f"act has {key!r}, which {by[0]} writes already: leave its line "
            f"`{port} = ...` out of the experiment. (R0926)"
        )
    return ExperimentError(
        f"act has {key!r}, and nothing can be put there; actions can be put at "
        f"{some(free)}.{nearest(key, free)} (R0926)"
    )
