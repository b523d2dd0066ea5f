"""Worlds: the robots in each, checked before anything starts."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rems_net.agents.agent import Agent
from rems_net.agents.experiment.checking.settings import origin
from rems_net.agents.protocol.plan import Plan
from rems_net.agents.runtime import runtime
from rems_net.agents.world import World, gather
from rems_net.errors import ExperimentError
from rems_net.router.keys import check_name


def robot_host(name: str, host: str | None, world: str | None) -> str:
    """Return the process a robot lives in: its own, unless it shares one."""
    if world is None:
        return check_name(host, "host") if host else f"robot/{name}"
    if host:
        raise ExperimentError(
            f"it has a world ({world!r}) and a host ({host!r}); robots of one world "
            "share a process anyway: leave host out. (R0432)"
        )
    return f"world/{check_name(world, 'world')}"


def world_plan(name: str, options: Mapping[str, Any], folder: Path) -> Plan:
    """Return the plan of a world; the world's process is that of its robots."""
    host = f"world/{name}"
    return Plan("world", name, [World], options=options, host=host, folder=folder)


def fill_worlds(plans: Mapping[str, Plan], agents: Mapping[str, Agent]) -> None:
    """Put robots into their worlds. Raises ExperimentError for what cannot be there."""
    for key, world in plans.items():
        if world.kind != "world":
            continue
        inside = [plan for plan in plans.values() if plan.world == key]
        robots = [plan for plan in inside if plan is not world]
        with origin(f"world {world.name!r}"):
            if not robots:
                raise ExperimentError(
                    f"no robot is in it; write world = {world.name!r} at a robot."
                    " (R0432)"
                )
            for robot in robots:
                if robot.since > 1:
                    raise ExperimentError(
                        f"{robot.key} comes later, by since; a world has its robots "
                        "from its beginning: leave since out. (R0432)"
                    )
            world.every = runtime(agents[key]).every = robots[0].every
            world.machine = robots[0].machine
            gather(agents[plan.key] for plan in inside)
