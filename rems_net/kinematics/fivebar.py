"""FiveBar: two servos that move one point by four links, and an arm with one.

    top servo ---- B
    |                \
    |                 C      E, C and the tip are one plate
    |                / \
    bottom servo -- E ---- tip

In the plane of the linkage, x is ahead and z up; a link at 0 hangs straight down, and
positive angles swing it ahead.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import pi, sqrt
from typing import Any

import numpy as np

from rems_net.errors import SchemaError
from rems_net.kinematics.arm import Arm
from rems_net.kinematics.chain import Chain, ChainJoint
from rems_net.kinematics.pose import Pose
from rems_net.kinematics.rotation import (
    Array,
    Nine,
    Three,
    Vector,
    about,
    nine,
    product,
    transposed,
    wrapped,
)
from rems_net.kinematics.target import Target
from rems_net.maths import atan2, hypot, sincos

UP: Vector = (0.0, 0.0, 1.0)
#: axis of the linkage: by a positive angle, a hanging link swings ahead
BACK: Vector = (0.0, -1.0, 0.0)
#: a point in the plane of the linkage: ahead, up
Point = tuple[Any, Any]


@dataclass(frozen=True, slots=True)
class FiveBar:
    """The lengths of a five-bar linkage, m.

    ahead, top, bottom: places of the two servos, one straight below the other
    crank: from each servo to its elbow, B or E
    upper, lower: from B to C, and from E to C
    tip: from E to the tip      bent: from E-C to E-tip, rad, from ahead towards up
    """

    ahead: float
    top: float
    bottom: float
    crank: float
    upper: float
    lower: float
    tip: float
    bent: float

    def elbows(self, top: Any, bottom: Any) -> tuple[Point, Point]:
        """Return the elbows' places, B and E, for the angles of the two servos, rad."""
        (st, ct), (sb, cb) = sincos(top), sincos(bottom)
        r = self.crank
        b = self.ahead + r * st, self.top - r * ct
        return b, (self.ahead + r * sb, self.bottom - r * cb)

    def joint(self, top: Any, bottom: Any) -> Point:
        """Return the links' common point, C. Raises SchemaError if they do not meet.

        Of two solutions, it is the one for which the real linkage is assembled.
        """
        b, e = self.elbows(top, bottom)
        x, z = e[0] - b[0], e[1] - b[1]
        apart = hypot(x, z)
        x, z = x / apart, z / apart
        a, c = self.upper, self.lower
        along = (a * a - c * c + apart * apart) / (2.0 * apart)
        square = a * a - along * along
        if isinstance(square, float):
            if square < 0.0:
                raise SchemaError(
                    f"The linkage does not close: with its servos at {float(top):.3f} "
                    f"and {float(bottom):.3f} rad the elbows are {1000 * apart:.1f} mm "
                    f"apart; expected {1000 * abs(a - c):.1f} to "
                    f"{1000 * (a + c):.1f}. (R0216)"
                )
            across: Any = sqrt(square)
        else:
            across = np.sqrt(square)
        return b[0] + along * x + across * z, b[1] + along * z - across * x

    def plate(self, top: Any, bottom: Any) -> Any:
        """Return the angle of E-tip, rad, 0 hanging down."""
        _, e = self.elbows(top, bottom)
        c = self.joint(top, bottom)
        s, k = sincos(self.bent)
        x, z = c[0] - e[0], c[1] - e[1]
        return atan2(x * k - z * s, -(x * s + z * k))

    def slopes(self, top: float, bottom: float) -> tuple[float, float]:
        """Return the plate's turn per turn of the top and the bottom servo, rad/rad.

        C keeps its distance from B and from E, so it moves across both links.
        """
        b, e = self.elbows(top, bottom)
        c = self.joint(top, bottom)
        (st, ct), (sb, cb) = sincos(top), sincos(bottom)
        r = self.crank
        ux, uz = c[0] - b[0], c[1] - b[1]
        lx, lz = c[0] - e[0], c[1] - e[1]
        whole = ux * lz - uz * lx
        # The top servo moves only B, the bottom one only E; C moves with them.
        push, pull = r * (ux * ct + uz * st), r * (lx * cb + lz * sb)
        # The velocity of C, less that of E.
        vx, vz = -uz * pull / whole - r * cb, ux * pull / whole - r * sb
        return -push / whole, (lx * vz - lz * vx) / (lx * lx + lz * lz)

    def inverse(self, tip: Point) -> Iterator[tuple[float, float, float]]:
        """Yield angles of the servos and the plate for a tip: top, bottom, plate, rad.

        Up to four; in some of them the linkage is assembled the other way.
        """
        x, down = tip[0] - self.ahead, self.bottom - tip[1]
        a, b = self.crank, self.tip
        bend = (x * x + down * down - a * a - b * b) / (2 * a * b)
        bend = min(max(bend, -1.0), 1.0)
        s, k = sincos(self.bent)
        for elbow in (1.0, -1.0):
            knee = elbow * atan2(sqrt(1.0 - bend * bend), bend)
            sk, ck = sincos(knee)
            bottom = wrapped(atan2(x, down) - atan2(b * sk, a + b * ck))
            plate = bottom + knee
            sp, cp = sincos(plate)
            sb, cb = sincos(bottom)
            # From E along the plate's edge to C, seen from the top servo.
            cx = a * sb + self.lower * (sp * k - cp * s)
            cz = self.bottom - self.top - a * cb - self.lower * (cp * k + sp * s)
            away = hypot(cx, cz)
            spread = (a * a + away * away - self.upper**2) / (2 * a * away)
            spread = min(max(spread, -1.0), 1.0)
            angle = atan2(sqrt(1.0 - spread * spread), spread)
            for side in (1.0, -1.0):
                yield wrapped(atan2(cx, -cz) + side * angle), bottom, plate


class FiveBarArm(Arm):
    """A shoulder that turns a five-bar linkage, and a wrist of three joints at its tip.

    Joints: shoulder (about z), top and bottom servo, and the wrist's three: about x,
    about y and about -z of the tip while all are at zero and the plate hangs down.
    hand: the wrist's frame, seen from the tip of the hanging plate
    base: of the shoulder, in the robot's frame      tool: in the frame of the wrist
    """

    def __init__(
        self,
        names: Sequence[str],
        limits: Sequence[tuple[float, float]],
        bars: FiveBar,
        *,
        hand: Pose,
        base: Pose | None = None,
        tool: Pose | None = None,
    ):
        super().__init__(names, limits)
        self.bars, self.hand = bars, hand
        self.base, self.tool = base or Pose.of(), tool or Pose.of()
        #: shoulder, lower half of the linkage, and wrist: an arm without a loop
        self.chain = Chain(
            _half(names, bars), base=self.base, tool=self.hand @ self.tool
        )

    @property
    def foot(self) -> tuple[float, float]:
        """Point where the shoulder's axis meets the ground, m."""
        return float(self.base.position[0]), float(self.base.position[1])

    def serial(self, q: Sequence[Any]) -> list[Any]:
        """Return the positions of the joints of `chain` for these six joints."""
        shoulder, top, bottom, *wrist = q
        return [shoulder, bottom, self.bars.plate(top, bottom) - bottom, *wrist]

    def tip(self, q: Sequence[Any]) -> tuple[Three, Nine]:
        """Return the tool's position and rotation; for arrays of joints, arrays."""
        return self.chain.tip(self.serial(q))

    def jacobian(self, q: Sequence[float]) -> Array:
        """Return the tool's motion per joint, (6, 6): m and rad, per rad."""
        columns = self.chain.jacobian(self.serial(q))
        by_top, by_bottom = self.bars.slopes(float(q[1]), float(q[2]))
        plate = columns[:, 2].copy()
        columns[:, 2] = columns[:, 1] + (by_bottom - 1.0) * plate
        columns[:, 1] = by_top * plate
        return columns

    def guesses(self, target: Target, start: Array) -> Iterator[list[float]]:
        """Yield up to sixteen solutions: from the wrist the tip, and so the servos."""
        if target.rotation is None or target.rolls:
            return
        goal = Pose(target.position, target.rotation)
        wrist = self.base.inverse() @ goal @ (self.hand @ self.tool).inverse()
        rotation = nine(wrist.rotation)
        x, y, z = wrist.position.tolist()
        ahead = atan2(y, x) if x * x + y * y > 1e-18 else float(start[0])
        out = float(hypot(x, y))
        for turn, reach in ((ahead, out), (wrapped(ahead + pi), -out)):
            for top, bottom, plate in self.bars.inverse((reach, z)):
                swing = product(about(UP, *sincos(turn)), about(BACK, *sincos(plate)))
                for last in _wrist(product(transposed(swing), rotation)):
                    yield [turn, top, bottom, *last]


def _half(names: Sequence[str], bars: FiveBar) -> list[ChainJoint]:
    tip, here = (0.0, 0.0, -bars.tip), (0.0, 0.0, 0.0)
    return [
        ChainJoint(names[0], here, UP),
        ChainJoint(names[2], (bars.ahead, 0.0, bars.bottom), BACK),
        ChainJoint("plate", (0.0, 0.0, -bars.crank), BACK),
        ChainJoint(names[3], tip, (1.0, 0.0, 0.0)),
        ChainJoint(names[4], here, (0.0, 1.0, 0.0)),
        ChainJoint(names[5], here, (0.0, 0.0, -1.0)),
    ]


def _wrist(r: Nine) -> Iterator[tuple[float, float, float]]:
    """Yield the two ways to turn by Rx(a) Ry(b) Rz(-c): a, b, c, rad."""
    flat = hypot(r[0], r[1])
    if flat < 1e-9:  # b is a quarter turn: a and c have the same axis
        yield atan2(r[3] * r[2], r[4]), atan2(r[2], 0.0), 0.0
        return
    for side in (1.0, -1.0):
        a = atan2(-side * r[5], side * r[8])
        yield a, atan2(r[2], side * flat), atan2(side * r[1], side * r[0])
