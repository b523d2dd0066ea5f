"""Shapes: boxes, rods and discs that a picture shows, and paint for them.

All are geoms of MuJoCo in the frame of the link that carries them.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from math import cos, pi, sin

from rems_net.bodies.body import Body, Cylinder, Joint, Vector
from rems_net.drivers.physics.mjcf import text

Colour = tuple[float, float, float]
#: the attributes of a geom of MuJoCo
Geom = dict[str, str]
#: geoms by the link that carries them
Geoms = dict[str, list[Geom]]

BLACK, DARK, GREY, SILVER, WHITE = (
    (shade, shade, shade + 0.01) for shade in (0.10, 0.22, 0.42, 0.72, 0.92)
)
WOOD, TAN, GREEN, BLUE = (
    (0.85, 0.68, 0.45),
    (0.72, 0.55, 0.33),
    (0.1, 0.42, 0.2),
    (0.12, 0.25, 0.6),
)
RED, GOLD, YELLOW, ORANGE = (
    (0.72, 0.1, 0.1),
    (0.8, 0.66, 0.3),
    (0.95, 0.75, 0.1),
    (1.0, 0.42, 0.02),
)
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Look:
    """How a robot is painted, and what is drawn on its links.

    paint: of the parts of its base that touch, in their order, the last for the rest;
        None leaves one out
    elevation: of the camera, degrees      rays: their length, by the robot's size
    bare: beginnings of the names of links whose own shapes are left out
    """

    paint: tuple[Colour | None, ...] = (GREY,)
    links: Geoms = field(default_factory=dict)
    bare: tuple[str, ...] = ()
    elevation: float = -25.0
    rays: float = 0.5


def box(size: Vector, at: Vector, paint: Colour, yaw: float = 0.0) -> Geom:
    """Return a box of these edges, m, turned about z, rad."""
    half = text([edge / 2 for edge in size])
    turn = {"euler": text([0, 0, yaw])} if yaw else {}
    return {"type": "box", "size": half, "pos": text(at), **turn, **_rgba(paint)}


def rod(radius: float, start: Vector, end: Vector, paint: Colour, **more: str) -> Geom:
    """Return a cylinder, or `type` another shape, from one point to another, m."""
    ends = text([start, end])
    shape = {"type": "cylinder", "size": text(radius), "fromto": ends}
    return {**shape, **_rgba(paint), **more}


def disc(
    radius: float, at: Vector, thick: float, paint: Colour, axis: Vector = Z
) -> Geom:
    """Return a cylinder about its middle, m."""
    start, end = (
        tuple(p + sign * thick / 2 * a for p, a in zip(at, axis, strict=True))
        for sign in (-1, 1)
    )
    return rod(radius, start, end, paint)  # type: ignore[arg-type]


def _rgba(paint: Colour) -> Geom:
    return {"rgba": text([*paint, 1])}


def wheels(body: Body, radius: float, paint: Colour, bolts: int = 5) -> Geoms:
    """Return what is in the tyre of each wheel: a disc, holes in it, and a cap."""
    found = {}
    for joint in joints(body.joints):
        if joint.name.startswith("wheel"):
            tyre = joint.parts[-1].shape
            assert isinstance(tyre, Cylinder)
            wide = tyre.length
            found[joint.name] = [
                disc(radius, (0, 0, 0), wide + 0.04 * radius, paint, Y),
                *(
                    disc(0.16 * radius, (x, 0, z), wide + 0.08 * radius, DARK, Y)
                    for x, z in ring(bolts, 0.6 * radius)
                ),
                disc(0.25 * radius, (0, 0, 0), wide + 0.12 * radius, GREY, Y),
            ]
    return found


def joints(some: Iterable[Joint]) -> Iterator[Joint]:
    """Yield joints, each before those that it carries."""
    for joint in some:
        yield joint
        yield from joints(joint.joints)


def ring(count: int, radius: float = 1.0) -> Iterator[tuple[float, float]]:
    """Yield points of a circle, the first at 0 degrees."""
    for number in range(count):
        turn = 2 * pi * number / count
        yield radius * cos(turn), radius * sin(turn)
