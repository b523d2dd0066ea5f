"""Wheels: a base's velocity from the speeds of its wheels, and the other way round."""

from collections.abc import Sequence
from math import inf
from typing import Any, NamedTuple

import numpy as np

from rems_net.errors import FieldValueError, UnreachableError
from rems_net.kinematics.rotation import Array

#: m. A radian of turning counts as this many metres, to find the nearest twist.
TURN = 0.1
#: m/s. A twist that differs by more than this is not the one asked for.
EXACT = 1e-9


class Twist(NamedTuple):
    """Velocity of a base, in its own frame.

    x: ahead, m/s      y: to the left, m/s      turn: counter-clockwise, rad/s
    """

    x: Any = 0.0
    y: Any = 0.0
    turn: Any = 0.0


class Wheels:
    """Wheels that roll without slip: a matrix gives the base's velocity.

    joints: paths of their speeds in the motors' command, rad/s
    matrix: x, y and turn per wheel, (3, n)      top: greatest speed of a wheel, rad/s
    """

    poses = False

    def __init__(
        self, joints: Sequence[str], matrix: Sequence[Sequence[float]], top: float = inf
    ):
        self.joints = tuple(joints)
        self.rows = tuple(tuple(map(float, row)) for row in matrix)
        self.top = top

    def fk(self, speeds: Sequence[Any]) -> Twist:
        """Return the base's velocity for these wheel speeds; for arrays, arrays."""
        sums = []
        for row in self.rows:
            total = row[0] * speeds[0]
            for share, speed in zip(row[1:], speeds[1:], strict=True):
                total = total + share * speed
            sums.append(total)
        return Twist(*sums)

    def jacobian(self, speeds: Sequence[float] = ()) -> Array:
        """Return the base's motion per wheel, (3, n): m and rad, per rad.

        It is the same at all speeds.
        """
        return np.array(self.rows)

    def ik(self, twist: Sequence[float]) -> dict[str, float]:
        """Return the wheel speeds, rad/s by path, for x, y (m/s) and turn (rad/s).

        Of several solutions, the smallest. Raises UnreachableError with the nearest
        twist if it is too fast, or not possible (a differential drive sideways).
        """
        asked = np.array(twist, float)
        if asked.shape != (3,) or not np.isfinite(asked).all():
            raise FieldValueError(
                f"A base is asked to go {twist!r:.80}; expected x, y and turn, in m/s, "
                "m/s and rad/s, such as (0.2, 0, 0.5). (R0220)"
            )
        matrix, scale = self.jacobian(), np.array([1.0, 1.0, TURN])
        speeds = np.linalg.pinv(matrix * scale[:, None]) @ (asked * scale)
        self._hold(asked, matrix @ speeds, "these wheels cannot do that")
        fastest = float(np.abs(speeds).max())
        if fastest > self.top * (1 + 1e-12):
            slower = matrix @ (speeds * (self.top / fastest))
            why = f"a wheel would turn at {fastest:.3g} rad/s, and has {self.top:.3g}"
            self._hold(asked, slower, why)
        limited = np.clip(speeds, -self.top, self.top).tolist()
        return dict(zip(self.joints, limited, strict=True))

    def _hold(self, asked: Array, found: Array, why: str) -> None:
        away = float(np.hypot(*(asked - found)[:2]))
        off = abs(float(asked[2] - found[2]))
        if away > EXACT or off > EXACT / TURN:
            raise UnreachableError(
                f"The base cannot go at {_told(asked)}: {why}. The nearest it can do "
                f"is {_told(found)}. (R0221)",
                Twist(*found.tolist()),
                away,
                off,
            )


def differential(
    joints: Sequence[str], radius: float, track: float, top: float = inf
) -> Wheels:
    """Return the wheels of a differential drive: left, right.

    radius: of a wheel, m      track: between the wheels, m      top: rad/s
    """
    half, turn = radius / 2, radius / track
    return Wheels(joints, [(half, half), (0.0, 0.0), (-turn, turn)], top)


def mecanum(
    joints: Sequence[str],
    radius: float,
    wheelbase: float,
    track: float,
    top: float = inf,
) -> Wheels:
    """Return four mecanum wheels: front left, front right, rear left, rear right.

    Seen from above, the rollers on top of the wheels make an X. Source: Webots' youBot,
    and Taheri, Qiao and Ghaeminezhad 2015, "Kinematic Model of a Four Mecanum Wheeled
    Mobile Robot".
    radius: of a wheel, m wheelbase,
    track: between front and rear, left and right
    """
    r, t = radius / 4, radius / (2 * (wheelbase + track))
    return Wheels(joints, [(r, r, r, r), (-r, r, r, -r), (-t, t, -t, t)], top)


def mecanum_speeds(
    twist: Twist, radius: float, wheelbase: float, track: float
) -> tuple[Any, ...]:
    """Return four mecanum wheels' speeds for a twist, rad/s; for arrays, arrays.

    The order of wheels and the arguments are as in `mecanum`; this is its inverse.
    """
    x, y, around = twist.x, twist.y, twist.turn * ((wheelbase + track) / 2)
    rims = (x - y - around, x + y + around, x + y - around, x - y + around)
    return tuple(rim / radius for rim in rims)


def slowed(twist: Twist, fastest: Any, top: float) -> Twist:
    """Return a twist along the same curve, slower if a wheel would be too fast.

    fastest: the fastest wheel's speed for the twist,
    top: its limit, in the same unit Arrays give arrays.
    """
    most = max(fastest, top) if isinstance(fastest, float) else np.maximum(fastest, top)
    share = top / most
    return Twist(twist.x * share, twist.y * share, twist.turn * share)


def _told(twist: Array) -> str:
    x, y, turn = (twist.round(3) + 0.0).tolist()
    return f"({x:.3f} m/s, {y:.3f} m/s, {turn:.3f} rad/s)"
