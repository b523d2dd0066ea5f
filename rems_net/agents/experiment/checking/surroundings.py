"""Surroundings: walls and things around an experiment's robots before it starts."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

from rems_net.agents.agent import Agent
from rems_net.agents.robot import Robot
from rems_net.agents.world import World, contents
from rems_net.bodies.arena import WALL_PIECES
from rems_net.bodies.body import Body, Embodied, Ray
from rems_net.defdict import many_turns
from rems_net.maths import hypot
from rems_net.scenes import outline
from rems_net.scenes.scene import solid_of

#: Number of robots up to which bodies are recorded: more make a run's file large.
SHOWN = 20


def radius(agent: Any) -> float:
    """Return the radius [m] of the round wall around a robot; 0 if there is none."""
    if agent.shared is not None:
        return float(agent.shared.scene.radius)
    arena = getattr(agent, "arena", None)
    found = getattr(arena() if callable(arena) else None, "radius", 0.0)
    return float(found) if isinstance(found, int | float) else 0.0


def bodies(agents: Mapping[str, Agent]) -> dict[str, Body]:
    """Return the bodies of robots, by key: none of many, and none that is unknown."""
    robots = {key: one for key, one in agents.items() if isinstance(one, Robot)}
    found: dict[str, Body] = {}
    for key, robot in robots.items() if len(robots) <= SHOWN else ():
        # Without a world, this is the first call of the robot's `body`: it may fail.
        with suppress(Exception):
            body = robot.body() if isinstance(robot, Embodied) else None
            if isinstance(body, Body):
                found[key] = body
    return found


def outline_of(body: Body | None) -> str:
    """Return the outline of a robot on the floor, in its own frame.

    As "x,y x,y ..." in m; "" if its body is in a file, or unknown.
    """
    if body is not None and body.source is None:
        with suppress(Exception):  # the user has written the body
            return _points(outline.of_body(body))
    return ""


def rays_of(body: Body | None) -> dict[str, list[float]]:
    """Return start [m], direction and reach [m] of distance sensors, by their names."""
    sensors = () if body is None else body.sensors
    found = [one for one in sensors if isinstance(one, Ray)]
    with suppress(Exception):  # as above
        return {
            one.name: [*map(float, (*one.at, *one.direction, one.reach))]
            for one in found
        }
    return {}


def worlds(agents: Mapping[str, Agent]) -> dict[str, dict[str, str]]:
    """Return the outlines of walls and things in each world, by its name.

    All but a round wall, which each robot has as its arena.
    """
    found: dict[str, dict[str, str]] = {}
    for world in agents.values():
        if isinstance(world, World):
            scene, _ = contents(world)
            walls = scene.walls[WALL_PIECES if scene.radius else 0 :]
            things = {
                f"wall {i}": outline.of_solid(solid_of(wall))
                for i, wall in enumerate(walls, 1)
            }
            for thing in scene.things:
                things[thing.name] = outline.of_solid(thing.solid)
            found[world.name] = {name: _points(one) for name, one in things.items()}
    return found


def doubts(agents: Mapping[str, Agent]) -> Iterator[str]:
    """Yield a sentence for each odd start of a robot, and for what agents doubt."""
    for agent in agents.values():
        yield from agent.doubts(agents)
    yield from _outside(agents)
    robots = [one for one in agents.values() if isinstance(one, Robot)]
    turned = [(robot.key, *one) for robot in robots for one in robot.odd_turns()]
    for key, path, turns in turned[:1]:
        more = f" (and {len(turned) - 1} more)" if turned[1:] else ""
        yield f"{key}{more} starts at {path}, which is {turns}"
    for robot in robots[:SHOWN]:
        for path, field in robot.parameters.schema.rows():
            value = robot.parameters[path]
            if turns := many_turns(value, field.unit):
                yield f"{robot.key} has {path} = {value:g}, which is {turns}"


def _outside(agents: Mapping[str, Agent]) -> Iterator[str]:
    """Yield a sentence for each robot that starts outside the walls around it."""
    for agent in agents.values():
        length = width = 0.0
        if isinstance(agent, World):
            scene, robots = contents(agent)
            length, width = agent.options["size"].tolist()
            round_wall, name = scene.radius, agent.key
        elif isinstance(agent, Robot) and agent.shared is None and _stated(agent):
            robots, round_wall, name = [agent], radius(agent), "its arena"
        else:
            continue
        for robot in robots:
            x, y, _ = robot.place
            if robot.initial_schema is robot.state.schema:
                own = robot.initial_schema({**robot.initial})
                x, y = (own.get(one, 0.0) for one in "xy")
            beyond = 0 < length < 2 * abs(x) or 0 < width < 2 * abs(y)
            if beyond or 0 < round_wall < float(hypot(x, y)):
                yield (
                    f"{robot.key} starts at x = {x:g} m, y = {y:g} m, which is outside "
                    f"the walls of {name}; give it another `initial`"
                )


def _stated(robot: Robot) -> bool:
    """Return whether a person has set the arena: a robot's own may be left aside."""
    usual = robot.parameters.schema().get("arena_radius")
    return bool(robot.parameters.get("arena_radius") != usual)


def _points(one: outline.Outline) -> str:
    return " ".join(f"{x:.4g},{y:.4g}" for x, y in (one.corners + 0.0).tolist())
