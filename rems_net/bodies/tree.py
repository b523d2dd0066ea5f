"""Tree: the joints of a body in a row, their links' places, and closed loops."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from rems_net.bodies.body import Body
from rems_net.bodies.joints import Hinge, Joint, Loop
from rems_net.bodies.parts import Array, Cylinder, Vector, lump
from rems_net.errors import SchemaError
from rems_net.maths import sincos

#: m. A loop is closed if its ends are this near; and on the way there, nearly closed.
CLOSED, NEARLY = 1e-12, 1e-5
#: rad or m. Joints move at most this far before loops are closed again: far less than
#: would let them fold the other way.
STRIDE = 0.1
#: rad or m. Largest change of a free joint in one round of Newton's method: a larger
#: one goes far beyond the solution, to a loop that is folded the other way.
LEAP = 2.0


@dataclass(frozen=True, slots=True)
class Link:
    """The link that one joint moves.

    joint: as engines build it, see `across`      stated: as the body has it
    parent: number of the link that carries it; -1 for the body itself
    ratio: motion of the joint per motion commanded
    """

    joint: Joint
    stated: Joint
    parent: int
    ratio: float


class Tree:
    """The links of a body, numbered so that each comes before those it carries."""

    def __init__(self, body: Body):
        self.links = tuple(_links(body.joints, -1, [0]))
        self.numbers = {link.joint.name: n for n, link in enumerate(self.links)}
        if len(self.numbers) < len(self.links):
            names = [link.joint.name for link in self.links]
            twice = next(name for name in names if names.count(name) > 1)
            raise SchemaError(
                f"Two joints of the body are called {twice!r}; each needs a name of "
                "its own. Several may obey one `command`. (R0213)"
            )
        #: numbers of the links that a motor moves
        self.motors = tuple(n for n, k in enumerate(self.links) if k.joint.effort)
        #: the loops: link, point on it, other link, point on that
        self.loops = [self._ends(loop) for loop in body.loops]
        ends = {n for first, _, second, _ in self.loops for n in (first, second)}
        bent = {n for end in ends for n in self._under(end)}
        #: numbers of the joints without a motor that close the loops
        self._free = sorted(bent - set(self.motors))

    def number(self, joint: str) -> int:
        """Return the number of the link that this joint moves. Raises SchemaError."""
        if joint not in self.numbers:
            known = ", ".join(self.numbers) or "none"
            raise SchemaError(
                f"The body has no joint {joint!r}; its joints: {known}. (R0207)"
            )
        return self.numbers[joint]

    def _under(self, link: int) -> Iterator[int]:
        """Yield the number of a link, and of all links that carry it."""
        while link >= 0:
            yield link
            link = self.links[link].parent

    def _ends(self, loop: Loop) -> tuple[int, Array, int, Array]:
        """Return the loop's point in the frames of its two links."""
        points, _ = self.places([0.0] * len(self.links))
        first, second = self.number(loop.first), self.number(loop.second)
        return first, loop.at - points[first], second, loop.at - points[second]

    def places(self, positions: Sequence[float]) -> tuple[Array, Array]:
        """Return each link's origin (n, 3) and rotation (n, 3, 3), link to body.

        positions: of the joints, rad or m, in the row's order
        """
        points = np.zeros((len(self.links), 3))
        turns = np.zeros((len(self.links), 3, 3))
        for n, link in enumerate(self.links):
            at, turn = np.zeros(3), np.eye(3)
            if link.parent >= 0:
                at, turn = points[link.parent], turns[link.parent]
            joint = link.joint
            points[n], turns[n] = at + turn @ joint.at, turn
            if isinstance(joint, Hinge):
                turns[n] = turn @ rotation(joint.axis, positions[n])
            else:
                points[n] += positions[n] * (turn @ joint.axis)
        return points, turns

    def closed(self, wanted: Mapping[int, float]) -> list[float]:
        """Return positions of all joints; the free ones close the loops.

        wanted: positions by joint's number, rad or m; others stay at zero
        """
        target = [wanted.get(n, 0.0) for n in range(len(self.links))]
        if not self.loops:
            return target
        furthest = max(map(abs, target))
        steps = max(1, ceil(furthest / STRIDE))
        found = [0.0] * len(target)
        for step in range(1, steps + 1):
            for n, value in enumerate(target):
                if n not in self._free:
                    found[n] = value * step / steps
            self._close(found, NEARLY if step < steps else CLOSED)
        return found

    def _close(self, positions: list[float], enough: float) -> None:
        """Move the free joints until the loops are closed, by Newton's method."""
        for _ in range(20):
            gap, slope = self._gap(positions)
            if np.abs(gap).max() < enough:
                return
            change = np.linalg.lstsq(slope, -gap, rcond=None)[0]
            change *= LEAP / max(LEAP, np.abs(change).max())
            for n, by in zip(self._free, change.tolist(), strict=True):
                positions[n] += by
        raise SchemaError(
            "The body's loops cannot be closed where the joints start: its links are "
            "too short for it. Give `initial` other positions. (R0216)"
        )

    def _gap(self, positions: Sequence[float]) -> tuple[Array, Array]:
        """Return the loops' gaps, m, and their change by each free joint."""
        points, turns = self.places(positions)
        gaps, slopes = [], []
        for first, at, second, there in self.loops:
            one = points[first] + turns[first] @ at
            other = points[second] + turns[second] @ there
            gaps.append(other - one)
            slopes.append(
                np.transpose(
                    [
                        self._moves(n, second, other, points, turns)
                        - self._moves(n, first, one, points, turns)
                        for n in self._free
                    ]
                )
            )
        return np.concatenate(gaps), np.concatenate(slopes)

    def _moves(
        self, joint: int, link: int, point: Array, points: Array, turns: Array
    ) -> Array:
        """Return the motion of a link's point by a joint, m per rad or m."""
        if joint not in self._under(link):
            return np.zeros(3)
        # A joint does not move its own axis.
        axis = turns[joint] @ self.links[joint].joint.axis
        if isinstance(self.links[joint].joint, Hinge):
            return np.asarray(np.cross(axis, point - points[joint]))
        return np.asarray(axis)


def _links(joints: Sequence[Joint], parent: int, met: list[int]) -> Iterator[Link]:
    for joint in joints:
        number = met[0]
        met[0] += 1
        if isinstance(joint, Hinge) and joint.rollers is not None:
            yield Link(across(joint), joint, parent, joint.ratio * abs(joint.grip))
        else:
            yield Link(joint, joint, parent, joint.ratio)
        yield from _links(joint.joints, number, met)


def rotation(axis: Vector, angle: float) -> Array:
    """Return the rotation (3, 3) about an axis, by Rodrigues' formula."""
    s, c = sincos(angle)
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + s * cross + (1 - c) * (cross @ cross))


def across(wheel: Hinge) -> Hinge:
    """Return a plain wheel that drives as the wheel with rollers does.

    It rolls along the axis of the roller that touches the floor, and is slippery along
    its own axle, so that friction acts as it does on the rollers. It turns slower than
    the original by the grip, with the same power and the same kinetic energy.
    """
    assert wheel.rollers is not None
    grip = abs(wheel.grip)
    along = np.array(wheel.rollers) * (1 if wheel.grip > 0 else -1)
    axle = (float(-along[1]), float(along[0]), 0.0)

    part = wheel.parts[0] if len(wheel.parts) == 1 else None
    shape = part.shape if part else None
    if not part or not isinstance(shape, Cylinder) or shape.axis != wheel.axis:
        raise SchemaError(
            f"The wheel {wheel.name!r} has rollers; expected of it one part, a "
            f"cylinder about its axis {wheel.axis}, got {wheel.parts}. (R0215)"
        )
    out = float(np.dot(part.at, wheel.axis))
    at = (out * axle[0], out * axle[1], 0.0)
    tyre = replace(part, shape=replace(shape, axis=axle), at=at)
    old = np.array(wheel.axis)
    inertia = float(old @ lump(wheel.parts).inertia @ old)
    return replace(
        wheel,
        parts=(tyre,),
        axis=axle,
        torque=wheel.torque / grip,
        droop=wheel.droop * grip,
        armature=(inertia + wheel.armature) / grip**2 - inertia,
        damping=wheel.damping / grip**2,
    )
