"""Marking: the marker of a robot or a thing, as written, and as cameras find it."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from rems_net.bodies.body import Body, Embodied
from rems_net.bodies.marker import FAMILIES, Marker
from rems_net.defdict import DefDict, Schema, angle, choice, integer, length, text
from rems_net.errors import SchemaError, nearest, some
from rems_net.scenes import outline
from rems_net.scenes.scene import Scene

#: m. A marker's paper is this much above what it is glued to, so that it can be seen.
GLUED = 5e-4

MARKER = Schema(
    "marker",
    {
        "family": choice(*FAMILIES, doc="of its picture"),
        "id": integer(range=(0, 586), doc="its number in the family"),
        "size": length("m", range=(0, 10), doc="edge of its black square"),
        "x": length("m", doc="of its middle, in the robot's frame"),
        "y": length("m", doc="of its middle, in the robot's frame"),
        "height": length("m", range=(0, 10), doc="above the floor; 0: on the top"),
        "heading": angle("rad", doc="of its picture's top, from the robot's +x"),
    },
)

#: a marker in a world: on a thing, or on the floor
ON = Schema("world.marker", {"on": text(doc="a thing's name"), **MARKER.entries})


def read(value: DefDict, above: float = 0.0) -> Marker:
    """Return the marker of a value of MARKER. Raises SchemaError.

    above: height of its owner's origin above the floor, m
    """
    at = (value["x"], value["y"], value["height"] - above)
    return Marker(value["family"], value["id"], value["size"], at, value["heading"])


def of_robot(robot: object, words: Mapping[str, Any]) -> DefDict:
    """Return a robot's marker, with its height. Raises SchemaError."""
    value = MARKER(words)
    if not value["height"]:
        body = robot.body() if isinstance(robot, Embodied) else None
        top = outline.of_body(body).high if isinstance(body, Body) else 0.0
        if not top:
            raise SchemaError(
                "its marker lies at an unknown height, since the definition's body has "
                'no shape; write such as marker = { height = "60 mm" }. (R1103)'
            )
        value["height"] = top + GLUED
    read(value)  # raises an error for one that cannot be printed
    return value


def in_scene(values: Iterable[DefDict], scene: Scene) -> Scene:
    """Return the scene with these markers, values of ON. Raises SchemaError."""
    names = [thing.name for thing in scene.things]
    found: list[tuple[int, Marker]] = []
    for value in values:
        number, lift = -1, GLUED
        if name := value["on"]:
            if name not in names:
                raise SchemaError(
                    f"a marker is on {name!r}, and no thing is called so; there is "
                    f"{some(names)}.{nearest(name, names)} (R1103)"
                )
            number = names.index(name)
            thing = scene.things[number]
            lift += outline.of_solid(thing.solid).high - thing.at[2]
        if number < 0 or not value["height"]:
            found.append((number, read(value, -lift)))
        else:
            found.append((number, read(value, scene.things[number].at[2])))
    return replace(scene, markers=tuple(found))
