"""Sheet: the content of a robot's file, the same for every file format.

All values are in the frame of the first link while every joint is at zero: m, kg, rad.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil
from pathlib import Path

import numpy as np

from rems_net.bodies.parts import Array, Vector
from rems_net.errors import SchemaError, nearest, some

#: middle (3,) and full edges (3,) of a box along the frame's axes, m
Box = tuple[Array, Array]


@dataclass(frozen=True, slots=True)
class Solid:
    """Rigid parts of the robot.

    mass: kg      boxes: around all shapes that can touch, seen from the solid's joint
    """

    mass: float
    boxes: tuple[Box, ...] = ()


@dataclass(frozen=True, slots=True)
class Moved:
    """A joint, and the solid that it moves.

    turns: whether it is a hinge, not a slide
    parent: number of the joint that carries it; -1 for none
    at: seen from the parent, m      axis: unit vector
    limits: rad or m; None without      effort: N m or N, 0 if not stated
    speed: the file's limit, rad/s or m/s; 0 if not stated
    follows: the joint that moves it, and the ratio of its motion to that joint's
    asked: range of its own actuator's target, rad or m; None without
    gain: of its own servo, 1/s      brake: N m s/rad or N s/m; both 0 if not stated
    """

    name: str
    turns: bool
    parent: int
    at: Vector
    axis: Vector
    solid: Solid
    limits: tuple[float, float] | None = None
    effort: float = 0.0
    speed: float = 0.0
    damping: float = 0.0
    armature: float = 0.0
    follows: tuple[str, float] | None = None
    asked: tuple[float, float] | None = None
    gain: float = 0.0
    brake: float = 0.0


@dataclass(frozen=True, slots=True)
class Sheet:
    """A robot's first link, and its joints in the engines' order.

    urdf, root: as of a `Source`      bolted: whether the file fixes it to the world
    height: of the first link's frame above the floor; None if not stated
    """

    path: Path
    root: str
    base: Solid
    joints: tuple[Moved, ...] = ()
    urdf: str = ""
    height: float | None = None
    bolted: bool = False
    #: names of all its links
    links: tuple[str, ...] = ()
    #: of an MJCF, as of a `Source`
    plain: str = ""
    grips: Mapping[str, float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The file's name, for messages."""
        return self.path.name

    @property
    def shapes(self) -> str:
        """The file format's term for shapes that touch, for messages."""
        return "<collision>" if self.urdf else "geoms with contype=1"

    @property
    def touches(self) -> bool:
        """Whether any shape of the robot can touch anything."""
        solids = [self.base, *(joint.solid for joint in self.joints)]
        return "<collision>" in self.urdf or any(solid.boxes for solid in solids)

    @property
    def places(self) -> list[Array]:
        """Positions of the joints, seen from the first link, (3,) m each."""
        found = list[Array]()
        for joint in self.joints:
            carrier = found[joint.parent] if joint.parent >= 0 else np.zeros(3)
            found.append(carrier + joint.at)
        return found

    @property
    def low(self) -> float:
        """Height of the lowest point above the first link's frame, m."""
        solids = [self.base, *(joint.solid for joint in self.joints)]
        return min(
            (
                float(at[2] + middle[2] - size[2] / 2)
                for at, solid in zip([np.zeros(3), *self.places], solids, strict=True)
                for middle, size in solid.boxes
            ),
            default=0.0,
        )

    @property
    def reach(self) -> float:
        """Distance that no point of the robot can exceed from the first link, m."""
        reaches, most = list[float](), _far(self.base)
        for joint in self.joints:
            before = reaches[joint.parent] if joint.parent >= 0 else 0.0
            slides = 0.0 if joint.turns else max(map(abs, joint.limits or (0.0,)))
            reaches.append(before + slides + float(np.linalg.norm(joint.at)))
            most = max(most, reaches[-1] + _far(joint.solid))
        return ceil(10 * most) / 10


def _far(solid: Solid) -> float:
    """Return the largest distance of the solid's boxes from its joint, m."""
    corners = (np.abs(middle) + size / 2 for middle, size in solid.boxes)
    return max((float(np.linalg.norm(corner)) for corner in corners), default=0.0)


def no_joint(file: str, name: str, known: Sequence[str]) -> SchemaError:
    """Return the error for a joint that the file does not have."""
    return SchemaError(
        f"{file} has no joint {name!r} that moves.{nearest(name, known)} Its joints: "
        f"{some(known)}. (R0207)"
    )


def check_links(file: str, friction: object, known: Sequence[str]) -> None:
    """Raise SchemaError if friction is given to a link that the file does not have."""
    for name in friction if isinstance(friction, Mapping) else ():
        if name not in known:
            raise SchemaError(
                f"{file} has no link {name!r} to give a friction to."
                f"{nearest(name, known)} Its links: {some(known)}. (R0207)"
            )
