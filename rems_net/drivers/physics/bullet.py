"""One robot's body in Bullet: its motors, pose, joints, rays and pictures."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from rems_net.bodies.body import Array, Body, Camera
from rems_net.bodies.tree import Tree
from rems_net.drivers.physics.engine import Picture
from rems_net.drivers.physics.files.load import BASE, ROBOT, WORLD
from rems_net.drivers.physics.multibody import add_body
from rems_net.drivers.physics.pictures.bullet import Sign, paint, picture
from rems_net.drivers.physics.pictures.looks import WHEEL, is_wheel
from rems_net.scenes.scene import Colour

#: Bullet's number for a ray that has met nothing
NOTHING = -1

Call = Callable[..., Any]


def cast(
    call: Call,
    own: Sequence[int],
    met: int,
    start: Array,
    direction: Array,
    reach: float,
) -> float:
    """Return a ray's distance to the nearest body but its own, m, at most `reach`.

    met: the groups of bodies that it meets
    """
    ray = [start.tolist()], [(start + reach * direction).tolist()]
    (hit,) = call("rayTestBatch", *ray, collisionFilterMask=met)
    if hit[0] not in own:
        return float(hit[2]) * reach
    # The ray begins inside its robot: search all hits, which come in no order.
    nearest, number = 1.0, 0
    while hit[0] != NOTHING:
        (hit,) = call(
            "rayTestBatch", *ray, collisionFilterMask=met, reportHitNumber=number
        )
        number += 1
        if hit[0] not in own:
            nearest = min(nearest, float(hit[2]))
    return nearest * reach


class Instance:
    """One robot's body; `call` calls Bullet's functions in the body's world."""

    def __init__(self, bullet: Any, call: Call, body: Body, x: float, met: int):
        self._bullet, self._call, self._met = bullet, call, met
        self._robot, self._joints = add_body(bullet, call, body)
        #: Bullet's numbers of the base and the links
        self._links = range(BASE, call("getNumJoints", self._robot))
        if met != WORLD:
            for number in self._links:
                call("setCollisionFilterGroupMask", self._robot, number, ROBOT, met)
        tree = Tree(body)
        self._motors = [self._joints[n] for n in tree.motors]
        self._torques = [tree.links[n].joint.effort for n in tree.motors]
        #: target speed of each motor, rad/s or m/s
        self.targets: Sequence[float] = [0.0] * len(self._motors)
        about = self._call("getDynamicsInfo", self._robot, BASE)
        # Bullet's positions are the base's centre of mass, ours the body's origin.
        self._from_centre = self._bullet.invertTransform(about[3], about[4])
        self._to_centre = about[3], about[4]
        self._kept: list[Any] = []
        #: all markers of the world, if it has a camera
        self.signs: Sequence[Sign] = ()
        if x and not body.fixed:
            self.move((x, 0.0, 0.0), 0.0)

    def tell(self) -> None:
        """Set the motors' target speeds, for Bullet's present length of a step."""
        if not self._motors:
            return
        self._call(
            "setJointMotorControlArray",
            self._robot,
            self._motors,
            self._bullet.VELOCITY_CONTROL,
            targetVelocities=self.targets,
            forces=self._torques,
        )

    def pose(self) -> tuple[Array, Array]:
        """Return position (3,) of the origin, m, and rotation (3, 3), body to world."""
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

    def velocity(self) -> Array:
        centre, _ = self._call("getBasePositionAndOrientation", self._robot)
        speed, spin = self._call("getBaseVelocity", self._robot)
        away = self.pose()[0] - centre
        return np.asarray(speed + np.cross(spin, away))

    def spin(self) -> Array:
        """Return the angular velocity (3,), rad/s, in the world's frame."""
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
        """Return the distance to the nearest thing but itself, m, at most `reach`."""
        return cast(self._call, [self._robot], self._met, start, direction, reach)

    def let_touch(self, bodies: Sequence[int], *, touch: bool) -> None:
        """Set whether other bodies can touch this one."""
        for number in self._links:
            for body in bodies:
                # Another group would count only for bodies that are not near yet.
                pair = self._robot, body, number, BASE, int(touch)
                self._call("setCollisionFilterPair", *pair)

    def keep(self) -> None:
        self._kept = [
            self._call("getBasePositionAndOrientation", self._robot),
            self._call("getBaseVelocity", self._robot),
            self.joints(),
        ]

    def restore(self) -> None:
        place, speed, (positions, speeds) = self._kept
        self._call("resetBasePositionAndOrientation", self._robot, *place)
        self._call("resetBaseVelocity", self._robot, *speed)
        for joint in zip(self._joints, positions, speeds, strict=True):
            self._call("resetJointState", self._robot, *joint)

    def picture(self, camera: Camera, eye: Array, ahead: Array, up: Array) -> Picture:
        return picture(self._bullet, self._call, camera, eye, ahead, up, self.signs)

    def paint(self, body: Body, colour: Colour) -> None:
        """Give the body a colour, and its wheels the colour of wheels."""
        links = dict.fromkeys(self._links, colour)
        for first, link in zip(self._joints, Tree(body).links, strict=True):
            if is_wheel(link.joint):
                # Each part is a link of its own; a file's link has all its parts.
                count = 1 if body.source else len(link.joint.parts)
                parts = range(first, first + count)
                links |= dict.fromkeys(parts, WHEEL)
        for number, one in links.items():
            paint(self._call, self._robot, one, number)
