"""Worlds: the robots in each, checked before anything starts."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rems_net.agents import parts
from rems_net.agents.about.wiring import Entry, resolve
from rems_net.agents.agent import Agent
from rems_net.agents.experiment.checking.settings import origin
from rems_net.agents.protocol.plan import HERE, Plan, ghost_sources
from rems_net.agents.robot import Robot
from rems_net.agents.rules import connect, given_part
from rems_net.agents.runtime import runtime
from rems_net.agents.world import World, gather
from rems_net.errors import ExperimentError
from rems_net.router.keys import check_name
from rems_net.scenes.description import FOLLOWED, POSE

#: what every ghost needs, with an example
_NEEDED = {"name": "real", "definition": "woodbot", "follows": "robot/real/state"}


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


def check_here(plan: Plan, agent: Agent) -> None:
    """Raise ExperimentError for an agent that must not live in the run's process."""
    if plan.host != HERE:
        return
    if what := "machine" if plan.machine else "restart" if plan.restart else "":
        raise ExperimentError(
            f"it has {what}, and host = {HERE!r} is the program that runs the "
            f"experiment; leave {what} or host out. (R0433)"
        )
    if isinstance(agent, Robot) and not agent.lockstep:
        raise ExperimentError(
            "it drives a device, which must stand still if the program of its run is "
            f"busy or dies; leave host = {HERE!r} out. (R0433)"
        )


def world_plan(name: str, options: Mapping[str, Any], folder: Path) -> Plan:
    """Return the plan of a world; the world's process is that of its robots."""
    host = f"world/{name}"
    options = dict(options)
    if "ghosts" in options:
        options["ghosts"] = _ghosts(options["ghosts"], folder)
    plan = Plan("world", name, [World], options=options, host=host, folder=folder)
    plan.sources = ghost_sources(options)
    return plan


def _ghosts(given: Any, folder: Path) -> list[dict[str, Any]]:
    """Return ghosts by whose definitions any process finds the class."""
    tables = [given] if isinstance(given, Mapping) else given
    if not isinstance(tables, list | tuple) or not all(
        isinstance(table, Mapping) for table in tables
    ):
        raise ExperimentError(
            f"ghosts is {given!r:.60}; expected a table for each: write "
            '[[world.ghosts]] below the world, or ghosts=[{"name": ...}]. (R0223)'
        )
    return [_ghost(dict(table), folder) for table in tables]


def _ghost(table: dict[str, Any], folder: Path) -> dict[str, Any]:
    for key, example in _NEEDED.items():
        if not table.get(key):
            raise ExperimentError(
                f"a ghost has no {key}; write such as {key} = {example!r}. A ghost has "
                "a name, the definition of its robot, and follows a port with a pose."
                " (R0223)"
            )
    cls = parts.find("definition", table["definition"], folder)
    if not isinstance(table["definition"], str) or ":" not in table["definition"]:
        table["definition"] = _reference(cls, folder)
    World.options.schema({"ghosts": [table]})
    return table


def _reference(cls: type, folder: Path) -> str:
    """Return the name of a class; a file below the folder has the same everywhere."""
    where, _, name = parts.reference(cls).rpartition(":")
    here = folder.resolve()
    if where.endswith(".py") and Path(where).is_relative_to(here):
        where = Path(where).relative_to(here).as_posix()
    return f"{where}:{name}"


def check_ghosts(
    world: Plan,
    plans: Mapping[str, Plan],
    entries: Mapping[str, Entry],
    agents: Mapping[str, Agent],
) -> None:
    """Raise RemsError for a ghost that follows something without a pose."""
    for port, source in ghost_sources(world.options).items():
        name = port.partition("/")[2]
        reader = f"{world.key}.{name}"
        found = resolve(source, entries, reader, world.key)
        if "*" in source:
            raise ExperimentError(
                f"the ghost {name!r} follows {source!r}, and a ghost "
                "follows one port; name it, such as 'robot/real/state'. (R0223)"
            )
        (one,) = found
        writer = plans.get(one.entry.key)
        if writer is not None and writer.world == world.key:
            raise ExperimentError(
                f"the ghost {name!r} follows {one.key}, which is in {world.key} "
                "itself, and a ghost would stand inside of it; follow a robot that is "
                "elsewhere. (R0224)"
            )
        theirs = agents[one.entry.key].schemas()[one.port]
        rules = runtime(agents[world.key]).rules
        connect(
            theirs, given_part(FOLLOWED, theirs, rules, POSE), rules, one.key, reader
        )


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
