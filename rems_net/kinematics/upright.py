"""UprightArm: an arm of five joints, as small arms often have, in closed form."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import pi, sqrt

from rems_net.kinematics.chain import Chain, ChainJoint
from rems_net.kinematics.pose import Pose
from rems_net.kinematics.rotation import (
    Array,
    Vector,
    nine,
    product,
    three,
    transposed,
    turned,
    wrapped,
)
from rems_net.kinematics.target import Target
from rems_net.maths import atan2, sincos

UP: Vector = (0.0, 0.0, 1.0)
LEFT: Vector = (0.0, 1.0, 0.0)


@dataclass(frozen=True, slots=True)
class Proportions:
    """Lengths of an upright arm, m.

    height, ahead: of the second axis over the foot, and in front of it
    upper, lower: from the second axis to the third, and on to the fourth
    wrist, tool: from the fourth axis to the place of the fifth, and on to the tool
    """

    height: float
    ahead: float
    upper: float
    lower: float
    wrist: float
    tool: float


class UprightArm(Chain):
    """An arm that turns on its foot, bends at three parallel axes and rolls its hand.

    At zero it points straight up; positive angles lean it ahead. Its tool can reach a
    position with a pitch and a roll; the yaw follows from the position.
    """

    def __init__(
        self,
        names: Sequence[str],
        limits: Sequence[tuple[float, float]],
        size: Proportions,
        base: Pose | None = None,
    ):
        ats = (
            (0.0, 0.0, 0.0),
            (size.ahead, 0.0, size.height),
            (0.0, 0.0, size.upper),
            (0.0, 0.0, size.lower),
            (0.0, 0.0, size.wrist),
        )
        axes = (UP, LEFT, LEFT, LEFT, UP)
        joints = [
            ChainJoint(name, at, axis, low, high)
            for name, at, axis, (low, high) in zip(
                names, ats, axes, limits, strict=True
            )
        ]
        super().__init__(joints, base=base, tool=Pose.of((0.0, 0.0, size.tool)))
        self.size = size

    def guesses(self, target: Target, start: Array) -> Iterator[list[float]]:
        """Yield up to four solutions: ahead or over its back, elbow up or down."""
        if target.rotation is None:
            return
        size, inward = self.size, transposed(nine(self.base.rotation))
        goal = product(inward, nine(target.rotation))
        x, y, z = turned(inward, three(target.position - self.base.position))
        ax, ay, az = goal[2::3]
        hand = size.wrist + size.tool
        x, y, z = x - hand * ax, y - hand * ay, z - hand * az  # the fourth axis
        # On the first axis, any turn of it will do: keep the present one, or turn back.
        ahead = atan2(y, x) if x * x + y * y > 1e-18 else float(start[0])
        for turn in (ahead, wrapped(ahead + pi)):
            s, c = sincos(turn)
            out, up = x * c + y * s - size.ahead, z - size.height
            lean = atan2(ax * c + ay * s, az)
            a, b = size.upper, size.lower
            bend = (out * out + up * up - a * a - b * b) / (2 * a * b)
            bend = min(max(bend, -1.0), 1.0)
            for elbow in (1.0, -1.0):
                third = elbow * atan2(sqrt(1.0 - bend * bend), bend)
                s3, c3 = sincos(third)
                second = wrapped(atan2(out, up) - atan2(b * s3, a + b * c3))
                fourth = wrapped(lean - second - third)
                fifth = float(start[4])
                if not target.rolls:
                    # The goal's x axis, in the frame of a hand that does not roll.
                    (s4, c4), (gx, gy, gz) = sincos(lean), goal[0::3]
                    along = c4 * (c * gx + s * gy) - s4 * gz
                    fifth = atan2(c * gy - s * gx, along)
                yield [turn, second, third, fourth, fifth]
