"""Scenery: what programs can draw of a robot or a world."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from rems_net.agents import registry
from rems_net.agents.agent import Agent
from rems_net.agents.robot import Robot
from rems_net.agents.world import World, contents
from rems_net.bodies.arena import Arena
from rems_net.bodies.body import Embodied
from rems_net.defdict import Schema

#: By class and parameters; a crowd's robots all have one body.
_bodies: dict[tuple[type, bytes], dict[str, Any]] = {}


def scene_of(agent: Agent) -> dict[str, Any]:
    """Return what can be drawn of a world or a robot; `scenes/view.py` has the form."""
    # Imported here: few runs are drawn, and each process would load it.
    from rems_net.bodies.files.built import built
    from rems_net.scenes import view

    if isinstance(agent, World):
        scene = contents(agent)[0]
        if scene.mjcf:
            from rems_net.scenes.model import of_model

            with suppress(Exception):  # the user's file
                drawn = of_model(scene)
                return {**drawn, "things": drawn["things"] + view.ghosts(scene)}
        return view.of_scene(scene)
    if not isinstance(agent, Robot):
        return {}
    found: dict[str, Any] = {}
    if "x" not in agent.state or "y" not in agent.state:
        found["place"] = list(agent.place)
    arena = getattr(agent, "arena", None)
    of = type(agent), agent.parameters.encode()
    with suppress(Exception):  # the user's code, as below
        if agent.shared is None:
            place = arena() if callable(arena) else Arena()
            found["arena"] = {"radius": place.radius, "height": place.wall_height}
    with suppress(Exception):
        if of not in _bodies and isinstance(agent, Embodied):
            _bodies[of] = {}
            _bodies[of] = view.of_body(built(agent.body()))
    return found | _bodies.get(of, {})


def scene_by(schemas: Mapping[str, Schema]) -> dict[str, Any]:
    """Return what can be drawn of a robot that describes only its ports, as boards do.

    schemas: of its ports, by name. If a built-in definition has the same ones, the
    robot looks like that; without such a definition the answer is empty.
    """
    digests = {port: schema.digest for port, schema in schemas.items()}
    for reference in registry.BUILT_IN["definition"].values():
        cls: Any = registry.load(reference, Path())
        robot: Robot = cls("board")
        robot.prepare()
        if digests == {port: s.digest for port, s in robot.published().items()}:
            return {"made_of": cls.__name__, **scene_of(robot)}
    return {}
