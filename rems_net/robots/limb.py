"""Limb: one of SCALER's limbs as an arm: its dimensions, masses and joints."""

from math import asin, pi

import numpy as np

from rems_net.bodies.body import Box, Cylinder, Hinge, Loop, Part, Servo, Sphere, Vector
from rems_net.kinematics.fivebar import FiveBar
from rems_net.kinematics.pose import Pose
from rems_net.maths import sincos

#: The joints of an arm, in the order of REMS's q1, q11, q21, q4, q5, q6.
JOINTS = ("shoulder", "top", "bottom", "wrist/1", "wrist/2", "wrist/3")
#: rad. Stops of the joints. None is published: all are guesses. The top servo's upper
#: stop is chosen: from 1.234 on the elbows can meet, and the linkage does not close.
STOPS = ((-1.2, 1.2), (-1.57, 1.2), (0.0, pi), (-pi, pi), (-1.9, 1.9), (-pi, pi))
#: m. Lengths of the linkage: REMS's constants for six joints and a gripper.
BARS = FiveBar(
    ahead=-0.01057,
    top=-0.07125,
    bottom=-0.09975,
    crank=0.113,
    upper=0.142035,
    lower=0.13635,
    tip=0.21505,
    bent=asin(0.03675 / 0.142035),
)
#: x and y of the shoulders on the body, m, and rotation of their frames about z, rad
SHOULDERS = {"left": (0.136, 0.144, pi / 2), "right": (0.136, -0.144, -pi / 2)}
#: the wrist's frame on a plate that hangs down, and the gripper in the wrist's frame
HAND = Pose(
    np.zeros(3), np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
)
GRIPPERS = {
    "left": Pose(np.array([-0.030, -0.0625, 0.0995]), np.diag([-1.0, -1.0, 1.0])),
    "right": Pose.of((0.030, -0.0625, 0.0995)),
}
#: kg, from SCALER's URDF, which has no motors: the masses that move with each joint,
#: among them the linkage's two joints without a motor.
MASSES = {
    "shoulder": 0.20375,
    "top": 0.01728,
    "knee": 0.02032,
    "bottom": 0.02281,
    "plate": 0.14559,
    "wrist/1": 0.01141,
    "wrist/2": 0.08876,
    "wrist/3": 0.00980,
}
#: Torque, N m: XM430-W350 at 12 V. The other values are guesses: droop, rad/s at full
#: torque; gain of the servos, 1/s; inertia of the gears, kg m2; thickness of links, m.
TORQUE, DROOP, GAIN, GEARS, THICK = 4.1, 0.5, 40.0, 0.01, 0.01


def paths(arm: str) -> list[str]:
    """Return the paths of an arm's joints, in order."""
    return [f"{arm}/{joint}" for joint in JOINTS]


class Limb:
    """An arm as a tree of joints, at zero: both servos' links hang down.

    The top servo's link carries the upper link, which ends at a point of the plate.
    """

    def __init__(self, arm: str, speed: float):
        self._arm = arm
        self._x, self._y, turn = SHOULDERS[arm]
        self._side = 1.0 if turn > 0 else -1.0
        self._servo = Servo(GAIN, speed, share=f"{arm}/speed")
        x, z = BARS.joint(0.0, 0.0)
        #: point at which the links meet, seen from the shoulder
        self._meet = (float(x), 0.0, float(z))
        self._s, self._c = sincos(float(BARS.plate(0.0, 0.0)))

    def shoulder(self) -> Hinge:
        """Return the whole arm, from its first joint on."""
        elbow = (0.0, 0.0, -BARS.crank)
        x, _, z = self._meet
        upper = (x - BARS.ahead, 0.0, z - BARS.top + BARS.crank)
        knee = self._free("knee", elbow, (self._rod("knee", upper),))
        tip = self._slanted((0.0, 0.0, -BARS.tip))
        # The plate: from its elbow to the wrist, and to the end of the upper link.
        held = (x - BARS.ahead, 0.0, z - BARS.bottom + BARS.crank)
        edges = self._rod("plate", tip, 0.8), self._rod("plate", held, 0.2)
        plate = self._free("plate", elbow, edges, self._wrist(tip))
        return self._driven(
            0,
            (self._x, self._y, 0.0),
            (0.0, 0.0, 1.0),
            Part(
                Box((0.06, 0.06, 0.09)),
                MASSES["shoulder"],
                self._out((BARS.ahead, 0.0, (BARS.top + BARS.bottom) / 2)),
            ),
            self._crank(1, BARS.top, elbow, knee),
            self._crank(2, BARS.bottom, elbow, plate),
        )

    def loop(self) -> Loop:
        """Return the loop that holds the upper link at the plate."""
        x, y, z = self._out(self._meet)
        at = (self._x + x, self._y + y, z)
        return Loop(f"{self._arm}/knee", f"{self._arm}/plate", at)

    def _crank(self, number: int, height: float, elbow: Vector, link: Hinge) -> Hinge:
        at, rod = self._out((BARS.ahead, 0.0, height)), self._rod(JOINTS[number], elbow)
        return self._driven(number, at, self._out((0.0, -1.0, 0.0)), rod, link)

    def _wrist(self, tip: Vector) -> Hinge:
        reach = (HAND.rotation @ GRIPPERS[self._arm].position).tolist()
        hand = self._rod("wrist/3", self._slanted(tuple(reach)))
        here = (0.0, 0.0, 0.0)
        last = self._driven(5, here, self._turned((0.0, 0.0, -1.0)), hand)
        ball = Part(Sphere(THICK), MASSES["wrist/2"])
        middle = self._driven(4, here, self._turned((0.0, 1.0, 0.0)), ball, last)
        ball = Part(Sphere(THICK), MASSES["wrist/1"])
        at, axis = self._out(tip), self._turned((1.0, 0.0, 0.0))
        return self._driven(3, at, axis, ball, middle)

    def _driven(
        self, number: int, at: Vector, axis: Vector, part: Part, *joints: Hinge
    ) -> Hinge:
        name = f"{self._arm}/{JOINTS[number]}"
        return Hinge(
            name,
            (part,),
            at=at,
            axis=axis,
            torque=TORQUE,
            droop=DROOP,
            armature=GEARS,
            servo=self._servo,
            limits=STOPS[number],
            position=name,
            joints=joints,
        )

    def _free(
        self, name: str, at: Vector, parts: tuple[Part, ...], *joints: Hinge
    ) -> Hinge:
        axis = self._out((0.0, -1.0, 0.0))
        return Hinge(f"{self._arm}/{name}", parts, at, axis, joints=joints)

    def _rod(self, name: str, end: Vector, share: float = 1.0) -> Part:
        """Return a rod from its joint to a point `end`, seen in the arm's frame."""
        x, y, z = self._out(end)
        length = float(np.linalg.norm(end))
        axis = (x / length, y / length, z / length)
        middle = (x / 2, y / 2, z / 2)
        return Part(Cylinder(THICK, length, axis), share * MASSES[name], middle)

    def _turned(self, axis: Vector) -> Vector:
        return self._out(self._slanted(axis))

    def _slanted(self, vector: Vector) -> Vector:
        """Return a vector of the hanging plate, turned with the plate at zero."""
        x, y, z = vector
        return x * self._c - z * self._s, y, x * self._s + z * self._c

    def _out(self, vector: Vector) -> Vector:
        """Return a vector of the arm's frame in the body's frame."""
        x, y, z = vector
        return -self._side * y, self._side * x, z
