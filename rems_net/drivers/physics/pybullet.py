"""Pybullet: a robot done by the Bullet physics engine."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import sqrt
from typing import Any

import numpy as np

from rems_net.drivers.needs import load
from rems_net.drivers.physics.multibody import BASE, ROBOT, WORLD, add_body
from rems_net.drivers.physics.physics import Physics
from rems_net.maths import cos, sin
from rems_net.worlds.body import GRAVITY, Arena, Array, Body, lump
from rems_net.worlds.tree import Tree

#: The most boxes that Bullet takes for one body.
BOXES = 16
#: Floor and walls give this much under the robot's weight, without a bounce, m. Where
#: they are rigid, Bullet lets a robot at rest creep by some micrometres a second.
GIVE = 1e-4


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


class _World:
    def __init__(self, bullet: Any, body: Body, arena: Arena):
        self._bullet = bullet
        self._client = bullet.connect(bullet.DIRECT)
        self._call("setGravity", 0, 0, GRAVITY)
        tree = Tree(body)
        parts = (part for link in tree.links for part in link.joint.parts)
        self._add_arena(arena, lump([*body.parts, *parts]).mass)
        self._robot, self._joints = add_body(bullet, self._call, body)
        self._motors = [self._joints[n] for n in tree.motors]
        self._torques = [tree.links[n].joint.effort for n in tree.motors]
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

    def joints(self) -> tuple[list[float], list[float]]:
        if not self._joints:
            return [], []
        told = self._call("getJointStates", self._robot, self._joints)
        return [one[0] for one in told], [one[1] for one in told]

    def bend(self, positions: Sequence[float]) -> None:
        for joint, position in zip(self._joints, positions, strict=True):
            self._call("resetJointState", self._robot, joint, position, 0.0)

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
