"""Multibody: a body for Bullet, with a link for each part."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np

from rems_net.bodies.body import Body
from rems_net.bodies.joints import Hinge, Joint
from rems_net.bodies.parts import Array, Box, Cylinder, Part, Sphere, lump
from rems_net.bodies.tree import Tree
from rems_net.drivers.physics.files.load import BASE, ROBOT, WORLD, load_file

ZERO = (0.0, 0.0, 0.0)
STRAIGHT = (0.0, 0.0, 0.0, 1.0)
#: N. Greatest force that closes a loop: far more than any motor here has.
HOLD = 1e4

Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class _Link:
    part: Part
    parent: int = 0
    joint: Joint | None = None


def add_body(
    bullet: Any, call: Callable[..., Any], body: Body
) -> tuple[int, list[int]]:
    """Add a robot's body, heading along +x; return its number and its joints' numbers.

    call: calls the function of that name in the right world
    The joints' numbers are in the order of the body's `Tree`.
    """
    if body.source is not None:
        return load_file(bullet, call, body, body.source)
    base, *fixed = (_Link(part) for part in body.parts)
    tree = Tree(body)
    links, moved = fixed, list[int]()
    for link in tree.links:
        # In parents' numbers, the base is 0.
        parent = 0 if link.parent < 0 else moved[link.parent] + 1
        moved.append(len(links))
        first, *more = link.joint.parts
        links.append(_Link(first, parent, link.joint))
        links += [_Link(part, parent=moved[-1] + 1) for part in more]
    kinds = {type(None): bullet.JOINT_FIXED, Hinge: bullet.JOINT_REVOLUTE}
    robot = call(
        "createMultiBody",
        # Bullet does not move a base without mass.
        0.0 if body.fixed else base.part.mass,
        _shape(bullet, call, base),
        basePosition=(0, 0, body.height),
        baseInertialFramePosition=base.part.at,
        baseInertialFrameOrientation=_turn(base.part),
        linkMasses=[link.part.mass for link in links],
        linkCollisionShapeIndices=[_shape(bullet, call, link) for link in links],
        linkVisualShapeIndices=[-1 for _ in links],
        linkPositions=[link.joint.at if link.joint else ZERO for link in links],
        linkOrientations=[STRAIGHT for _ in links],
        linkInertialFramePositions=[link.part.at for link in links],
        linkInertialFrameOrientations=[_turn(link.part) for link in links],
        linkParentIndices=[link.parent for link in links],
        linkJointTypes=[
            kinds.get(type(link.joint), bullet.JOINT_PRISMATIC) for link in links
        ],
        linkJointAxis=[link.joint.axis if link.joint else ZERO for link in links],
    )
    for number, one in enumerate([base, *links], BASE):
        _finish(bullet, call, robot, number, one)
    for here, point, other, there in tree.loops:
        held = call(
            "createConstraint",
            robot,
            moved[here],
            robot,
            moved[other],
            bullet.JOINT_POINT2POINT,
            ZERO,
            _from_centre(bullet, tree.links[here].joint.parts[0], point),
            _from_centre(bullet, tree.links[other].joint.parts[0], there),
        )
        call("changeConstraint", held, maxForce=HOLD)
    return robot, moved


def _finish(
    bullet: Any, call: Callable[..., Any], robot: int, number: int, link: _Link
) -> None:
    inertia, more = _inertia(link.part), dict[str, Any]()
    joint = link.joint
    if isinstance(joint, Hinge):
        turn = bullet.getMatrixFromQuaternion(_turn(link.part))
        axis = np.array(joint.axis) @ np.array(turn).reshape(3, 3)
        inertia = inertia + joint.armature * axis**2
        if joint.rollers is not None:
            # Without friction along its own z, the axle. With a little friction there,
            # Bullet would mix slipping along the axle into rolling.
            more["anisotropicFriction"] = (1.0, 1.0, 0.0)
    if joint is not None and joint.limits is not None:
        more["jointLowerLimit"], more["jointUpperLimit"] = joint.limits
    call(
        "changeDynamics",
        robot,
        number,
        localInertiaDiagonal=inertia.tolist(),
        lateralFriction=link.part.friction or 0.0,
        rollingFriction=0.0,
        spinningFriction=0.0,
        linearDamping=0.0,
        angularDamping=0.0,
        jointDamping=joint.damping if joint else 0.0,
        **more,
    )
    if joint is not None and not joint.effort:
        # A joint in Bullet has a motor that brakes; force 0 switches it off.
        call("setJointMotorControl2", robot, number, bullet.VELOCITY_CONTROL, force=0.0)
    if link.part.friction is not None:
        call("setCollisionFilterGroupMask", robot, number, ROBOT, WORLD)


def add_shape(bullet: Any, call: Callable[..., Any], part: Part) -> int:
    """Return Bullet's number for the shape of a single part."""
    return _shape(bullet, call, _Link(part))


def add_shapes(bullet: Any, call: Callable[..., Any], parts: Sequence[Part]) -> int:
    """Return Bullet's number for one shape of several parts, at most 16."""
    abouts = [_about(bullet, part) for part in parts]
    return int(
        call(
            "createCollisionShapeArray",
            [kind for kind, _ in abouts],
            halfExtents=[about.get("halfExtents", ZERO) for _, about in abouts],
            radii=[about.get("radius", 0.0) for _, about in abouts],
            lengths=[about.get("height", 0.0) for _, about in abouts],
            collisionFramePositions=[part.at for part in parts],
            collisionFrameOrientations=[_turn(part) for part in parts],
        )
    )


def _about(bullet: Any, part: Part) -> tuple[int, dict[str, Any]]:
    """Return the kind and the sizes of a part's shape, as Bullet names them."""
    match part.shape:
        case Box(size):
            return bullet.GEOM_BOX, {"halfExtents": [edge / 2 for edge in size]}
        case Sphere(radius):
            return bullet.GEOM_SPHERE, {"radius": radius}
        case Cylinder(radius, length, _):
            return bullet.GEOM_CYLINDER, {"radius": radius, "height": length}


def _shape(bullet: Any, call: Callable[..., Any], link: _Link) -> int:
    """Return Bullet's number for the part's shape, at its place on the link."""
    part = link.part
    if part.friction is None:
        return -1
    kind, about = _about(bullet, part)
    rolls = isinstance(link.joint, Hinge) and link.joint.rollers is not None
    if isinstance(part.shape, Cylinder) and rolls:
        # A ball touches the floor in one point, in the middle of the rim.
        kind, about = bullet.GEOM_SPHERE, {"radius": part.shape.radius}
    shape = call(
        "createCollisionShape",
        kind,
        **about,
        collisionFramePosition=part.at,
        collisionFrameOrientation=_turn(part),
    )
    return int(shape)


def _from_centre(bullet: Any, part: Part, point: Array) -> tuple[float, ...]:
    """Return a point of a link relative to its centre of mass, as Bullet needs it."""
    away, turn = bullet.invertTransform(part.at, _turn(part))
    at, _ = bullet.multiplyTransforms(away, turn, point.tolist(), STRAIGHT)
    return tuple(at)


def _inertia(part: Part) -> Array:
    """Return the moments of inertia (3,) about the shape's own axes, kg m2."""
    if isinstance(part.shape, Cylinder):
        part = Part(Cylinder(part.shape.radius, part.shape.length), part.mass)
    return np.diagonal(lump([part]).inertia)


def _turn(part: Part) -> Quaternion:
    """Return the rotation (x, y, z, w) from z to the axis of a cylinder."""
    if not isinstance(part.shape, Cylinder):
        return STRAIGHT
    x, y, z = part.shape.axis
    if z < -0.999999:
        return (1.0, 0.0, 0.0, 0.0)
    # From z to the axis by the shorter way: half of 2 (1 + cos) is the real part.
    scale = sqrt(2 * (1 + z))
    return (-y / scale, x / scale, 0.0, scale / 2)
