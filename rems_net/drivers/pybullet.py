"""Pybullet: a robot done by the Bullet physics engine."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import cos, pi, sin, sqrt, tan
from typing import Any

import numpy as np

from rems_net.agents.body import (
    Arena,
    Array,
    Body,
    Box,
    Cylinder,
    Hinge,
    Part,
    Sphere,
    Vector,
    lump,
)
from rems_net.drivers.needs import load, look_for
from rems_net.drivers.physics import GRAVITY, Physics

#: Boxes in the round wall; they leave the circle by half a millimetre in 0.4 m.
WALL_PIECES = 64
WALL_THICKNESS = 0.01
#: Collision groups, so that a ray sees the world and not the robot it comes from.
WORLD, ROBOT = 1, 2
STRAIGHT = (0.0, 0.0, 0.0, 1.0)
#: Bullet numbers links from 0; the base is -1, and 0 where links name their parent.
BASE = -1

Quaternion = tuple[float, float, float, float]


class Pybullet(Physics):
    """Runs the definition's body in Bullet, without a window.

    A motor holds the commanded speed with whatever torque that takes, up to `torque`.
    A contact's friction is the part's own.
    """

    def prepare(self) -> None:
        """Check that PyBullet is installed."""
        look_for("pybullet", "pybullet")
        super().prepare()

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


class _World:
    def __init__(self, bullet: Any, body: Body, arena: Arena):
        self._bullet = bullet
        self._client = bullet.connect(bullet.DIRECT)
        self._call("setGravity", 0, 0, GRAVITY)
        self._add_arena(arena)
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

    def _add_arena(self, arena: Arena) -> None:
        floor = self._call("createCollisionShape", self._bullet.GEOM_PLANE)
        self._add_fixed(floor, (0.0, 0.0, 0.0), STRAIGHT)
        if not arena.radius:
            return
        middle = arena.radius + WALL_THICKNESS / 2
        size = (WALL_THICKNESS, 2 * middle * tan(pi / WALL_PIECES), arena.wall_height)
        piece = self._shape(Part(Box(size), 0.0))
        for number in range(WALL_PIECES):
            turn = 2 * pi * number / WALL_PIECES
            at = (middle * cos(turn), middle * sin(turn), arena.wall_height / 2)
            self._add_fixed(piece, at, (0.0, 0.0, sin(turn / 2), cos(turn / 2)))

    def _add_fixed(self, shape: int, at: Vector, turn: Quaternion) -> None:
        fixed = self._call("createMultiBody", 0, shape, -1, at, turn)
        # Bullet multiplies the frictions of two: with 1 here, the robot's part decides.
        self._call("changeDynamics", fixed, BASE, lateralFriction=1.0)
        self._call("setCollisionFilterGroupMask", fixed, BASE, WORLD, WORLD | ROBOT)

    def _add_robot(self, body: Body) -> tuple[int, list[int]]:
        """Make every part a link, fixed to the base or to the part that a motor turns.

        Returns the robot and the links that have a motor, in the order of the hinges.
        """
        base, *fixed = body.parts
        links: list[tuple[Part, int, Hinge | None]] = [(one, 0, None) for one in fixed]
        motors = []
        for hinge in body.hinges:
            motors.append(len(links))
            first, *more = hinge.parts
            links.append((first, 0, hinge))
            links += [(one, motors[-1] + 1, None) for one in more]
        b = self._bullet
        robot = self._call(
            "createMultiBody",
            base.mass,
            self._shape(base),
            basePosition=(0, 0, body.height),
            baseInertialFramePosition=base.at,
            baseInertialFrameOrientation=_turn(base),
            linkMasses=[part.mass for part, _, _ in links],
            linkCollisionShapeIndices=[self._shape(part) for part, _, _ in links],
            linkVisualShapeIndices=[-1 for _ in links],
            linkPositions=[hinge.at if hinge else (0, 0, 0) for _, _, hinge in links],
            linkOrientations=[STRAIGHT for _ in links],
            linkInertialFramePositions=[part.at for part, _, _ in links],
            linkInertialFrameOrientations=[_turn(part) for part, _, _ in links],
            linkParentIndices=[parent for _, parent, _ in links],
            linkJointTypes=[
                b.JOINT_REVOLUTE if hinge else b.JOINT_FIXED for _, _, hinge in links
            ],
            linkJointAxis=[hinge.axis if hinge else (0, 0, 1) for _, _, hinge in links],
        )
        for number, (part, _, hinge) in enumerate([(base, 0, None), *links], BASE):
            self._settle_link(robot, number, part, hinge)
        return robot, motors

    def _settle_link(
        self, robot: int, number: int, part: Part, hinge: Hinge | None
    ) -> None:
        inertia = _inertia(part)
        if hinge is not None:
            turn = self._bullet.getMatrixFromQuaternion(_turn(part))
            axis = np.array(hinge.axis) @ np.array(turn).reshape(3, 3)
            inertia = inertia + hinge.armature * axis**2
        self._call(
            "changeDynamics",
            robot,
            number,
            localInertiaDiagonal=inertia.tolist(),
            lateralFriction=part.friction or 0.0,
            rollingFriction=0.0,
            spinningFriction=0.0,
            linearDamping=0.0,
            angularDamping=0.0,
            jointDamping=0.0,
            activationState=self._bullet.ACTIVATION_STATE_DISABLE_SLEEPING,
        )
        if part.friction is not None:
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
    """Return the rotation (x, y, z, w) that lays the shape as it is: a cylinder's axis."""
    if not isinstance(part.shape, Cylinder):
        return STRAIGHT
    x, y, z = part.shape.axis
    if z < -0.999999:
        return (1.0, 0.0, 0.0, 0.0)
    # From z to the axis by the shorter way: half of 2 (1 + cos) is the real part.
    scale = sqrt(2 * (1 + z))
    return (-y / scale, x / scale, 0.0, scale / 2)
