"""Scenery: what programs can draw of a robot or a world."""

from contextlib import suppress
from typing import Any

from rems_net.agents.agent import Agent
from rems_net.agents.robot import Robot
from rems_net.agents.world import World, contents
from rems_net.bodies.arena import Arena
from rems_net.bodies.body import Embodied

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
                return of_model(scene)
        return view.of_scene(scene)
    if not isinstance(agent, Robot):
        return {}
    found: dict[str, Any] = {}
    if "x" not in agent.state:
        found["place"] = list(agent.place)
    arena = getattr(agent, "arena", None)
    of = type(agent), agent.parameters.encode()
    with suppress(Exception):  # the user's code, as below
        if agent.shared is None:
            found["arena"] = view.of_arena(arena() if callable(arena) else Arena())
    with suppress(Exception):
        if of not in _bodies and isinstance(agent, Embodied):
            _bodies[of] = {}
            _bodies[of] = view.of_body(built(agent.body()))
    return found | _bodies.get(of, {})
