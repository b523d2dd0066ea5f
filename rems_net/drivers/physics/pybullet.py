"""Pybullet: a robot done by the Bullet physics engine."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np

from rems_net.drivers.needs import load
from rems_net.drivers.physics.physics import Physics
from rems_net.maths import cos, sin
from rems_net.worlds.body import (
    GRAVITY,
    Arena,
    Array,
    Body,
    Box,
    Cylinder,
    Hinge,
    Part,
    Sphere,
    lump,
)

#: The most boxes that Bullet takes for one body.
BOXES = 16
#: Floor and walls give this much under the robot's weight, without a bounce, m. Where
#: they are rigid, Bullet lets a robot at rest creep by some micrometres a second.
GIVE = 1e-4
#: Collision groups, so that a ray sees the world and not the robot it comes from.
WORLD, ROBOT = 1, 2
ZERO = (0.0, 0.0, 0.0)
STRAIGHT = (0.0, 0.0, 0.0, 1.0)
#: Bullet numbers links from 0; the base is -1, and 0 where links name their parent.
BASE = -1

Quaternion = tuple[float, float, float, float]


class Pybullet(Physics):
    """Runs the definition's body in Bullet, without a window.

    A motor holds the commanded speed with whatever torque that takes, up to `torque`,
    without any droop.
    A contact's friction is the part's own. Bullet resolves it along the x and y of the
    world, so wheels that slip at an angle to them turn the robot: by up to 0.74 degrees
    at a start at full speed (docs/woodbot.md).
    """

    needs = ("pybullet",)

    def build(self, body: Body, arena: Arena) -> _World:
        """Translate the body and the arena into a Bullet world of their own."""
        with _silence():
            bullet = load("pybullet", "pybullet")
        return _World(bullet, body, arena)


@contextmanager
def _silence() -> Iterator[None]:
    """Keep off the terminal what Bullet's C code writes to it when it is loaded."""
    terminal = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(terminal, 2)
        os.close(terminal)
        os.close(nowhere)


@dataclass(frozen=True, slots=True)
class _Link:
    part: Part
    parent: int = 0
    hinge: Hinge | None = None


class _World:
    def __init__(self, bullet: Any, body: Body, arena: Arena):
        self._bullet = bullet
        self._client = bullet.connect(bullet.DIRECT)
        self._call("setGravity", 0, 0, GRAVITY)
        links = (part for hinge in body.hinges for part in hinge.parts)
        self._add_arena(arena, lump([*body.parts, *links]).mass)
        self._robot, self._motors = self._add_robot(body)
        self._torques = [hinge.torque for hinge in body.hinges]
        about = self._call("getDynamicsInfo", self._robot, BASE)
        # Bullet speaks of the base's centre of mass, we of the body's origin.
        self._from_centre = bullet.invertTransform(about[3], about[4])
        self._to_centre = about[3], about[4]

    def _call(self, name: str, *args: Any, **more: Any) -> Any:
        """Call Bullet's function of that name in this world and no other."""
        return getattr(self._bullet, name)(*args, **more, physicsClientId=self._client)

    def advance(self, speeds: Sequence[float], h: float, count: int) -> None:
        self._call("setTimeStep", h)
        self._call(
            "setJointMotorControlArray",
            self._robot,
            self._motors,
            self._bullet.VELOCITY_CONTROL,
            targetVelocities=speeds,
            forces=self._torques,
        )
        step, client = self._bullet.stepSimulation, self._client
        for _ in range(count):
            step(client)

    def pose(self) -> tuple[Array, Array]:
        centre = self._call("getBasePositionAndOrientation", self._robot)
        at, turn = self._bullet.multiplyTransforms(*centre, *self._from_centre)
        rotation = np.array(self._bullet.getMatrixFromQuaternion(turn))
        return np.array(at), rotation.reshape(3, 3)

    def spin(self) -> Array:
        return np.array(self._call("getBaseVelocity", self._robot)[1])

    def move(self, shift: Sequence[float], yaw: float) -> None:
        b = self._bullet
        centre = self._call("getBasePositionAndOrientation", self._robot)
        at, turn = b.multiplyTransforms(*centre, *self._from_centre)
        _, turn = b.multiplyTransforms(
            (0, 0, 0), b.getQuaternionFromEuler((0, 0, yaw)), (0, 0, 0), turn
        )
        there = b.multiplyTransforms(np.add(at, shift).tolist(), turn, *self._to_centre)
        self._call("resetBasePositionAndOrientation", self._robot, *there)
        self._call("resetBaseVelocity", self._robot, (0, 0, 0), (0, 0, 0))

    def ray(self, start: Array, direction: Array, reach: float) -> float:
        end = start + reach * direction
        (hit,) = self._call(
            "rayTestBatch", [start.tolist()], [end.tolist()], collisionFilterMask=WORLD
        )
        return float(hit[2]) * reach

    def close(self) -> None:
        self._bullet.disconnect(self._client)

    def _add_arena(self, arena: Arena, mass: float) -> None:
        b = self._bullet
        self._add_fixed(self._call("createCollisionShape", b.GEOM_PLANE), mass)
        walls = arena.walls()
        # A body costs time in every step, whatever it does: so few of many boxes.
        for some in (walls[i : i + BOXES] for i in range(0, len(walls), BOXES)):
            boxes = self._call(
                "createCollisionShapeArray",
                [b.GEOM_BOX] * len(some),
                halfExtents=[[edge / 2 for edge in wall.size] for wall in some],
                collisionFramePositions=[wall.at for wall in some],
                collisionFrameOrientations=[
                    (0.0, 0.0, sin(wall.yaw / 2), cos(wall.yaw / 2)) for wall in some
                ],
            )
            self._add_fixed(boxes, mass)

    def _add_fixed(self, shape: int, mass: float) -> None:
        fixed = self._call("createMultiBody", 0, shape)
        stiffness = mass * -GRAVITY / GIVE
        self._call(
            "changeDynamics",
            fixed,
            BASE,
            # Bullet multiplies the frictions of two: with 1, the robot's part decides.
            lateralFriction=1.0,
            contactStiffness=stiffness,
            contactDamping=2 * sqrt(stiffness * mass),
        )
        self._call("setCollisionFilterGroupMask", fixed, BASE, WORLD, WORLD | ROBOT)

    def _add_robot(self, body: Body) -> tuple[int, list[int]]:
        """Make every part a link, fixed to the base or to the part that a motor turns.

        Returns the robot and the links that have a motor, in the order of the hinges.
        """
        base, *fixed = (_Link(part) for part in body.parts)
        links, motors = fixed, []
        for hinge in body.hinges:
            motors.append(len(links))
            first, *more = hinge.parts
            links.append(_Link(first, hinge=hinge))
            links += [_Link(part, parent=motors[-1] + 1) for part in more]
        b = self._bullet
        robot = self._call(
            "createMultiBody",
            base.part.mass,
            self._shape(base.part),
            basePosition=(0, 0, body.height),
            baseInertialFramePosition=base.part.at,
            baseInertialFrameOrientation=_turn(base.part),
            linkMasses=[link.part.mass for link in links],
            linkCollisionShapeIndices=[self._shape(link.part) for link in links],
            linkVisualShapeIndices=[-1 for _ in links],
            linkPositions=[link.hinge.at if link.hinge else ZERO for link in links],
            linkOrientations=[STRAIGHT for _ in links],
            linkInertialFramePositions=[link.part.at for link in links],
            linkInertialFrameOrientations=[_turn(link.part) for link in links],
            linkParentIndices=[link.parent for link in links],
            linkJointTypes=[
                b.JOINT_REVOLUTE if link.hinge else b.JOINT_FIXED for link in links
            ],
            linkJointAxis=[link.hinge.axis if link.hinge else ZERO for link in links],
        )
        for number, link in enumerate([base, *links], BASE):
            self._finish(robot, number, link)
        return robot, motors

    def _finish(self, robot: int, number: int, link: _Link) -> None:
        inertia = _inertia(link.part)
        if link.hinge:
            turn = self._bullet.getMatrixFromQuaternion(_turn(link.part))
            axis = np.array(link.hinge.axis) @ np.array(turn).reshape(3, 3)
            inertia = inertia + link.hinge.armature * axis**2
        self._call(
            "changeDynamics",
            robot,
            number,
            localInertiaDiagonal=inertia.tolist(),
            lateralFriction=link.part.friction or 0.0,
            rollingFriction=0.0,
            spinningFriction=0.0,
            linearDamping=0.0,
            angularDamping=0.0,
            jointDamping=0.0,
        )
        if link.part.friction is not None:
            self._call("setCollisionFilterGroupMask", robot, number, ROBOT, WORLD)

    def _shape(self, part: Part) -> int:
        """Return Bullet's number for the part's shape where it sits on its link."""
        if part.friction is None:
            return -1
        b = self._bullet
        about: dict[str, Any]
        match part.shape:
            case Box(size):
                kind, about = b.GEOM_BOX, {"halfExtents": [edge / 2 for edge in size]}
            case Sphere(radius):
                kind, about = b.GEOM_SPHERE, {"radius": radius}
            case Cylinder(radius, length, _):
                kind, about = b.GEOM_CYLINDER, {"radius": radius, "height": length}
        shape = self._call(
            "createCollisionShape",
            kind,
            **about,
            collisionFramePosition=part.at,
            collisionFrameOrientation=_turn(part),
        )
        return int(shape)


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
