"""Pybullet: driver that runs a robot in the Bullet physics engine."""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from math import sqrt
from typing import Any

import numpy as np

from rems_net.bodies.body import GRAVITY, Array, Body, Part, Sphere, lump
from rems_net.bodies.tree import Tree
from rems_net.drivers.physics.bullet import Instance, cast
from rems_net.drivers.physics.engine import APART, AWAY, ROLLING, Aim
from rems_net.drivers.physics.files.load import BASE, ROBOT, WORLD
from rems_net.drivers.physics.multibody import add_shape, add_shapes
from rems_net.drivers.physics.physics import Physics
from rems_net.drivers.physics.pictures.bullet import Sign, floor, lay_tiles, paint
from rems_net.drivers.physics.pictures.looks import SHADE, WALL, cameras, hull
from rems_net.libraries import load
from rems_net.maths import cos, sin
from rems_net.scenes.ghost import Ghost
from rems_net.scenes.scene import Scene, Thing

#: boxes that Bullet accepts for one body, at most
BOXES = 16
#: m. Floor and walls give way by this under the robot's weight, without a bounce. On
#: rigid ones, Bullet lets a robot at rest creep by some micrometres a second.
GIVE = 1e-4
#: m. The same for ghosts: one that moves into a robot pushes it away in some 10 ms.
SOFT = 1e-3
#: Bullet's number for a visible shape that is the same as the collision shape
AS_IT_IS = -1


class Pybullet(Physics):
    """Driver that runs the definition's body in Bullet, without a window.

    A motor holds the commanded speed with the torque that this needs, up to `torque`,
    without any droop. A contact's friction is the part's own; of two parts that may
    move, the product. Bullet resolves it along the x and y of the world, so wheels that
    slip at an angle to them turn the robot: by up to 0.74 degrees at a start at full
    speed (docs/woodbot.md).
    """

    needs = ("pybullet",)

    def build(self, bodies: Sequence[Body], scene: Scene) -> "_Engine":
        """Translate the bodies and the scene into a Bullet world of their own."""
        with _silence():
            bullet = load("pybullet", "pybullet")
        return _Engine(bullet, bodies, scene)


@contextmanager
def _silence() -> Iterator[None]:
    """Silence what Bullet's C code writes to the terminal when it is loaded."""
    terminal = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(terminal, 2)
        os.close(terminal)
        os.close(nowhere)


class _Engine:
    def __init__(self, bullet: Any, bodies: Sequence[Body], scene: Scene):
        self.bullet = bullet
        self._client = bullet.connect(bullet.DIRECT)
        self.call("setGravity", 0, 0, GRAVITY)
        heaviest = max([*map(_mass, bodies), *(thing.mass for thing in scene.things)])
        self._seen = any(cameras(bodies))
        self._add_scene(scene, heaviest)
        # Parts of one robot never touch each other, but other robots and things.
        met = WORLD | ROBOT if len(bodies) > 1 or scene.things else WORLD
        if met != WORLD:
            # Otherwise a run after a reset depends on contacts before it: by their
            # order, and by when the solver stops, which it does for groups of bodies.
            self.call(
                "setPhysicsEngineParameter",
                deterministicOverlappingPairs=1,
                solverResidualThreshold=0.0,
            )
        self.instances = [
            Instance(bullet, self.call, body, APART * number, met)
            for number, body in enumerate(bodies)
        ]
        self._things = [self._add_thing(thing) for thing in scene.things]
        self._ghosts = [self._add_ghost(ghost, heaviest) for ghost in scene.ghosts]
        #: whether robots can touch each ghost
        self._touching = [True] * len(self._ghosts)
        for number, ghost in enumerate(scene.ghosts):
            self.haunt(number, ghost)
        if self._seen:
            for number, body in enumerate(bodies):
                self.instances[number].paint(body, hull(number))
            for made, thing in zip(self._things, scene.things, strict=True):
                paint(self.call, made, thing.colour)
            for instance in self.instances:
                instance.signs = [*self._signs(bodies, scene)]
        self._kept: int | None = None
        count = len(self.instances)
        self._poses = np.zeros((count, 3)), np.zeros((count, 3, 3))
        self._spins = np.zeros((count, 3))
        self._rays: Sequence[Aim] = []

    def call(self, name: str, *args: Any, **more: Any) -> Any:
        """Call Bullet's function of that name, in this world only."""
        return getattr(self.bullet, name)(*args, **more, physicsClientId=self._client)

    def _signs(self, bodies: Sequence[Body], scene: Scene) -> Iterator[Sign]:
        """Yield each marker, and the pose of its owner."""
        for number, body in enumerate(bodies):
            for marker in body.markers:
                yield self.instances[number].pose, marker
        for number, marker in scene.markers:
            yield partial(self.thing, number) if number >= 0 else _floor, marker

    def command(self, targets: Sequence[Sequence[float]]) -> None:
        for instance, told in zip(self.instances, targets, strict=True):
            instance.targets = told

    def advance(self, h: float, count: int) -> None:
        # At this call, Bullet turns torques into impulses, by this length of a step.
        self.call("setTimeStep", h)
        for instance in self.instances:
            instance.tell()
        step, client = self.bullet.stepSimulation, self._client
        for _ in range(count):
            step(client)

    def poses(self) -> tuple[Array, Array]:
        positions, rotations = self._poses
        for n, instance in enumerate(self.instances):
            positions[n], rotations[n] = instance.pose()
        return self._poses

    def spins(self) -> Array:
        spins = np.array([[instance.spin()] for instance in self.instances])
        self._spins[:] = np.matmul(spins, self._poses[1])[:, 0]
        return self._spins

    def aim(self, rays: Sequence[Aim]) -> None:
        self._rays = rays

    def rays(self) -> list[float]:
        own = self.instances
        return [own[n].ray(*line, reach) for n, line, reach in self._rays]

    def refresh(self) -> None:
        """Do nothing: Bullet updates its poses itself."""

    def keep(self) -> None:
        if self._kept is not None:
            self.call("removeState", self._kept)
        # The state includes the contacts and impulses from which the solver starts.
        self._kept = self.call("saveState")
        for instance in self.instances:
            instance.keep()

    def restore(self) -> None:
        self.call("restoreState", self._kept)

    def thing(self, number: int) -> tuple[Array, Array]:
        at, turn = self.call("getBasePositionAndOrientation", self._things[number])
        rotation = np.array(self.bullet.getMatrixFromQuaternion(turn))
        return np.array(at), rotation.reshape(3, 3)

    def haunt(self, number: int, ghost: Ghost) -> None:
        bodies = self._ghosts[number]
        if self._touching[number] != ghost.touches:
            self._touching[number] = ghost.touches
            for instance in self.instances:
                instance.let_touch(bodies, touch=ghost.touches)
        at, half = ghost.place[0].tolist(), ghost.heading / 2
        turn = (0.0, 0.0, sin(half), cos(half))
        for body in bodies:
            at = AWAY if ghost.pose is None else at
            self.call("resetBasePositionAndOrientation", body, at, turn)

    def look(self, number: int, start: Array, way: Array, reach: float) -> float:
        own = self._ghosts[number]
        return cast(self.call, own, WORLD | ROBOT, start, way, reach)

    def close(self) -> None:
        self.bullet.disconnect(self._client)

    def _add_scene(self, scene: Scene, mass: float) -> None:
        b = self.bullet
        looks = floor(b, self.call) if self._seen else AS_IT_IS
        made = self._add_fixed(
            self.call("createCollisionShape", b.GEOM_PLANE), mass, looks
        )
        if self._seen:
            lay_tiles(self.call, made)
        walls = scene.walls
        # Each body costs time in every step: make few bodies of many boxes.
        for some in (walls[i : i + BOXES] for i in range(0, len(walls), BOXES)):
            boxes = self.call(
                "createCollisionShapeArray",
                [b.GEOM_BOX] * len(some),
                halfExtents=[[edge / 2 for edge in wall.size] for wall in some],
                collisionFramePositions=[wall.at for wall in some],
                collisionFrameOrientations=[
                    (0.0, 0.0, sin(wall.yaw / 2), cos(wall.yaw / 2)) for wall in some
                ],
            )
            wall = self._add_fixed(boxes, mass)
            if self._seen:
                paint(self.call, wall, WALL)

    def _add_fixed(
        self,
        shape: int,
        mass: float,
        looks: int = AS_IT_IS,
        give: float = GIVE,
        friction: float = 1.0,
    ) -> int:
        fixed: int = self.call("createMultiBody", 0, shape, looks)
        stiffness = mass * -GRAVITY / give
        self.call(
            "changeDynamics",
            fixed,
            BASE,
            # Bullet multiplies two frictions: with 1 here, the robot's part decides.
            lateralFriction=friction,
            contactStiffness=stiffness,
            contactDamping=2 * sqrt(stiffness * mass),
        )
        self.call("setCollisionFilterGroupMask", fixed, BASE, WORLD, WORLD | ROBOT)
        return fixed

    def _add_ghost(self, ghost: Ghost, mass: float) -> list[int]:
        """Return the bodies of a ghost, which is not there yet."""
        made, solids = list[int](), ghost.solids
        for some in (solids[i : i + BOXES] for i in range(0, len(solids), BOXES)):
            parts = [Part(one.shape, 1.0, tuple(one.at.tolist())) for one in some]
            shape = add_shapes(self.bullet, self.call, parts)
            made.append(self._add_fixed(shape, mass, give=SOFT, friction=0.0))
            if self._seen:
                paint(self.call, made[-1], SHADE)
        return made

    def _add_thing(self, thing: Thing) -> int:
        about = self.bullet.getQuaternionFromEuler((0, -thing.pitch, thing.heading))
        made = self.call(
            "createMultiBody",
            thing.mass,
            add_shape(self.bullet, self.call, Part(thing.shape, thing.mass)),
            basePosition=thing.at,
            baseOrientation=about,
        )
        rolling = 0.0
        if isinstance(thing.shape, Sphere):
            rolling = ROLLING * thing.shape.radius
        self.call(
            "changeDynamics",
            made,
            BASE,
            lateralFriction=thing.friction,
            rollingFriction=rolling,
            spinningFriction=0.0,
            linearDamping=0.0,
            angularDamping=0.0,
        )
        self.call("setCollisionFilterGroupMask", made, BASE, ROBOT, WORLD | ROBOT)
        return int(made)


def _mass(body: Body) -> float:
    parts = (part for link in Tree(body).links for part in link.joint.parts)
    return lump([*body.parts, *parts]).mass


def _floor() -> tuple[Array, Array]:
    """Return the floor's position and rotation."""
    return np.zeros(3), np.eye(3)
