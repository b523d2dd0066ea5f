"""A robot that is an eye, and what it sees."""

from collections.abc import Mapping
from math import radians
from typing import Any

import numpy as np

from rems_net.agents.ports import In, Out
from rems_net.agents.robot import Definition, Driver, combine
from rems_net.agents.world import World
from rems_net.bodies.body import Body, Box, Camera, Part, Vector
from rems_net.defdict import Schema, angle, array, length, velocity
from rems_net.drivers.physics.engine import Picture
from rems_net.errors import MissingPartError
from rems_net.libraries import look_for
from rems_net.robots.epuck import EpuckWithCamera
from rems_net.robots.woodbot import Woodbot

Engine = type[Driver]


def why_not(engine: Engine) -> str:
    """Why this engine draws no picture here; "" where it does."""
    try:
        for library in engine.needs:
            look_for(library, library)
        robot = combine(EpuckWithCamera, engine)("r")
        robot.prepare()
    except MissingPartError as error:
        return str(error)
    return ""


class Eye(Definition):
    """A box of 10 cm on the floor, and a camera in its middle."""

    command = In(Schema("eye.command", {"speed": velocity()}))
    state = Out(Schema("eye.state", {"x": length(), "y": length(), "heading": angle()}))
    sensors = Out(Schema("eye.sensors", {"seen": array((24, 32, 3), dtype="u1")}))
    at: Vector = (0.0, 0.0, 0.0)
    direction: Vector = (1.0, 0.0, 0.0)

    def body(self) -> Body:
        camera = Camera("seen", self.at, self.direction, 32, 24, radians(60))
        box = Part(Box((0.1, 0.1, 0.1)), 1.0)
        return Body((box,), sensors=(camera,), height=0.05)


def looking(at: Vector, direction: Vector) -> type[Eye]:
    return type("Eye", (Eye,), {"at": at, "direction": direction})


def seen(
    definition: type[Definition],
    engine: Engine,
    others: Mapping[str, Mapping[str, Any]] | None = None,
    initial: Mapping[str, Any] | None = None,
    **place: Any,
) -> Picture:
    """The first picture of the first camera, in a world of this place."""
    robots = [combine(definition, engine)("r", initial=initial)]
    for name, start in (others or {}).items():
        robots.append(combine(Woodbot, engine)(name, initial=start))
    world = World("place", options=place)
    for agent in [*robots, world]:
        agent.prepare()
    world.gather(robots)
    try:
        for robot in robots:
            robot.open()
        first = robots[0].sensors
        (path,) = (p for p, f in first.schema.rows() if f.shape)
        picture: Picture = first[path]
        return picture
    finally:
        for robot in robots:
            robot.close()


def middle(picture: Picture, colour: str) -> tuple[float, float]:
    """Column and row of the middle of what has this colour, in pixels."""
    red, green, blue = np.moveaxis(picture.astype(int), 2, 0)
    mine = {
        "red": (red > 2.5 * green) & (red > 60),
        "brown": (red > 1.3 * green) & (green > 1.5 * blue),
        "blue": (blue > 1.5 * green) & (blue > 60),
        "green": (green > 1.5 * red) & (green > 1.5 * blue),
        "dark": (red < 50) & (green < 50) & (blue < 50),
    }[colour]
    rows, columns = np.nonzero(mine)
    assert len(rows) > 3, f"nothing is {colour}"
    return float(columns.mean()), float(rows.mean())
