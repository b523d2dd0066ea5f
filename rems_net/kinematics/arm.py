"""Arm: any mechanism with joints that carries a tool.

Three functions differ from arm to arm: the tool's pose (`tip`), its motion
(`jacobian`) and, if there is a closed form, joints to try (`guesses`).
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import pi
from typing import Any, TypeAlias

import numpy as np

from rems_net.errors import FieldValueError, UnreachableError
from rems_net.kinematics.pose import Pose
from rems_net.kinematics.rotation import UNTURNED, Array, Nine, Three
from rems_net.kinematics.solver import Fit, fit
from rems_net.kinematics.target import RADIAN, Target
from rems_net.kinematics.wheels import Wheels
from rems_net.maths import atan2

#: m. A target is reached if the error is at most this; a radian counts as `RADIAN`.
REACHED = 1e-9
#: A pose is singular if its least singular value is below this share of the largest.
SINGULAR = 1e-3
#: starts of a search, besides the given one: without, and with a closed form
STARTS, FEW = 60, 10
#: steps of the search from each start
ROUGH = 20
#: number of results that are searched further, and for how many steps
BEST, FINE = 4, 200
#: a pose, or a position (3,) in m
Goal = Pose | Sequence[float] | Array


@dataclass(frozen=True, slots=True)
class Solution:
    """Result of `ik`.

    joints: by path, rad (m for a slide), ready for a command
    pose: of the tool, with these joints
    singular: a sentence if the tool cannot move in some direction there, else ""
    """

    joints: dict[str, float]
    pose: Pose
    singular: str = ""


class Arm(ABC):
    """Mechanism of joints with stops, and the tool that they move.

    joints: their paths      low, high: (n,) rad
    """

    #: whether it is an arm, and no base
    poses = True

    def __init__(self, joints: Sequence[str], limits: Sequence[tuple[float, float]]):
        self.joints = tuple(joints)
        self.low = np.array([low for low, _ in limits])
        self.high = np.array([high for _, high in limits])
        #: where searches begin; a joint without stops: within half a turn
        self._from = np.where(np.isfinite(self.low), self.low, -pi)
        self._span = np.where(np.isfinite(self.high), self.high, pi) - self._from

    @abstractmethod
    def tip(self, q: Sequence[Any]) -> tuple[Three, Nine]:
        """Return the tool's position and rotation; for arrays of joints, arrays."""

    @abstractmethod
    def jacobian(self, q: Sequence[float]) -> Array:
        """Return the tool's motion per joint, (6, n): m and rad, per rad (or per m).

        Three rows of velocity and three of angular velocity, in the robot's frame.
        """

    def guesses(self, target: Target, start: Array) -> Iterable[Sequence[float]]:
        """Return joints that may reach it, by a closed form; none if not overridden."""
        return ()

    def fk(self, q: Sequence[float]) -> Pose:
        """Return the pose of the tool, in the robot's frame."""
        return Pose.at(*self.tip([float(angle) for angle in q]))

    def aim(
        self, position: Sequence[float] | Array, pitch: float, roll: float = 0.0
    ) -> Pose:
        """Return the pose of a tool that is seen straight from the arm's first axis.

        An arm of five joints has no others.
        pitch: of the tool's z axis, 0 is level and outward, pi/2 straight down, rad;
        roll: about that axis, rad.
        """
        foot = self.foot
        yaw = atan2(float(position[1]) - foot[1], float(position[0]) - foot[0])
        level = Pose.of(yaw=yaw) @ Pose.of(pitch=float(pitch) + pi / 2)
        return Pose(np.array(position), (level @ Pose.of(yaw=float(roll))).rotation)

    @property
    @abstractmethod
    def foot(self) -> tuple[float, float]:
        """Point where the first axis, which is upright, meets the ground, m."""

    def target(self, goal: Goal, pitch: float | None, roll: float | None) -> Target:
        """Return the target for the arguments of `ik`. Raises FieldValueError."""
        if isinstance(goal, Pose):
            if pitch is not None or roll is not None:
                raise FieldValueError(
                    "A pose has the turn of the tool in it; leave out pitch and "
                    "roll. (R0220)"
                )
            return Target(goal.position, goal.rotation)
        place: Any = goal
        position = Pose(place, np.eye(3)).position
        if pitch is None:
            if roll is not None:
                raise FieldValueError(
                    "A roll is about a direction: give a pitch, too. (R0220)"
                )
            return Target(position)
        rotation = self.aim(position, pitch, roll or 0.0).rotation
        return Target(position, rotation, rolls=roll is None)

    def ik(
        self,
        goal: Goal,
        *,
        pitch: float | None = None,
        roll: float | None = None,
        start: Sequence[float] | None = None,
    ) -> Solution:
        """Return joints that bring the tool to `goal`, the nearest to `start`.

        goal: a pose, or a position (3,) in m with any turn; with `pitch` (see `aim`)
            the tool points that way with any roll; with `roll`, its pose is complete
        start: the arm's joints now, (n,); by default the middle between its stops

        Raises UnreachableError, with the nearest pose that can be reached.
        """
        target = self.target(goal, pitch, roll)
        q = self._inside(self._from + self._span / 2 if start is None else start)
        found = self._exact(target, q) or self._search(target, q)
        if found.miss > REACHED:
            raise self._unreachable(target, found)
        return self._solution(found.q)

    def _exact(self, target: Target, start: Array) -> Fit | None:
        """Return the start, or the closed form's nearest joints within the stops."""
        if (miss := target.miss(*self.tip(start.tolist()))) <= REACHED:
            return Fit(start, miss)
        best: Fit | None = None
        for guess in self.guesses(target, start):
            q = np.array(guess, float)
            if (q < self.low - 1e-12).any() or (q > self.high + 1e-12).any():
                continue
            q = self._inside(q)
            nearer = best is None or _way(q, start) < _way(best.q, start)
            if nearer and (miss := target.miss(*self.tip(q.tolist()))) <= REACHED:
                best = Fit(q, miss)
        return best

    def _search(self, target: Target, start: Array) -> Fit:
        """Return the best fit of searches from the start, guesses and elsewhere."""

        def residual(q: Array) -> Array:
            return target.error(*self.tip(q.tolist()))

        def slope(q: Array) -> Array:
            joints = q.tolist()
            turn = self.tip(joints)[1] if target.rolls else UNTURNED
            return target.rows(self.jacobian(joints), turn)

        def near(q: Array, steps: int) -> Fit:
            return fit(residual, slope, self.low, self.high, q, REACHED / 10, steps)

        guesses = [self._inside(q) for q in self.guesses(target, start)]
        others = self._elsewhere(FEW if guesses else STARTS)
        rough = []
        for q in (start, *guesses, *others):
            rough.append(near(q, ROUGH))
            if rough[-1].miss <= REACHED:
                return rough[-1]
        rough.sort(key=lambda found: found.miss)
        return min(
            (near(found.q, FINE) for found in rough[:BEST]),
            key=lambda found: found.miss,
        )

    def _elsewhere(self, count: int) -> Iterable[Array]:
        """Yield joints spread over the whole range, always the same ones.

        Additive recurrence: Roberts 2018, "The unreasonable effectiveness of
        quasirandom sequences".
        """
        n = len(self.joints)
        root = 2.0
        for _ in range(60):  # the root of x**(n + 1) = x + 1
            root = (1.0 + root) ** (1.0 / (n + 1))
        steps = np.array([root ** -(i + 1) for i in range(n)])
        for k in range(1, count + 1):
            yield self._from + self._span * ((0.5 + k * steps) % 1.0)

    def _inside(self, q: Sequence[float] | Array) -> Array:
        """Return the joints, clipped to the stops. Raises FieldValueError."""
        found = np.array(q, float)
        if found.shape != self.low.shape or not np.isfinite(found).all():
            raise FieldValueError(
                f"The joints are {q!r:.80}; expected {len(self.low)} finite numbers, "
                f"of {', '.join(self.joints)}. (R0220)"
            )
        clipped: Array = np.clip(found, self.low, self.high)
        return clipped

    def _solution(self, q: Array) -> Solution:
        joints = dict(zip(self.joints, q.tolist(), strict=True))
        return Solution(joints, self.fk(q.tolist()), self.singular(q.tolist()))

    def singular(self, q: Sequence[float]) -> str:
        """Return which joints move without moving the tool, as a sentence; else ""."""
        scaled = self.jacobian(q) * np.array([[1.0]] * 3 + [[RADIAN]] * 3)
        _, sizes, motions = np.linalg.svd(scaled)
        rank = min(scaled.shape)
        if sizes[rank - 1] > SINGULAR * sizes[0]:
            return ""
        share = np.abs(motions[rank - 1])
        moving = [n for n, s in zip(self.joints, share, strict=True) if s > 0.05]
        return (
            f"Singular: {' and '.join(moving)} can move here while the tool stays (to "
            "first order), so there is a direction in which it cannot go at once. "
            "Stay clear of it where you need straight lines or little speed."
        )

    def _unreachable(self, target: Target, found: Fit) -> UnreachableError:
        solution = self._solution(found.q)
        away, off = target.apart(solution.pose)
        where = ", ".join(f"{float(x):.3f}" for x in target.position)
        asked = "" if target.rotation is None else " turned like that"
        said = f"({where}) m{asked} is out of reach: the nearest is {solution.pose}"
        said += f", {1000 * away:.1f} mm away"
        if target.rotation is not None:
            said += f" and {np.degrees(off):.1f} deg off"
            free = self._search(Target(target.position), found.q)
            said += (
                ". The point itself is within reach: ask for it with another pitch, "
                "or with none"
                if free.miss <= REACHED
                else ". The point itself is out of reach, however the tool is turned"
            )
        stops = [
            name
            for name, x, low, high in zip(
                self.joints, found.q, self.low, self.high, strict=True
            )
            if x <= low or x >= high
        ]
        if stops:
            said += f". At its stop there: {', '.join(stops)}"
        return UnreachableError(
            f"{said}. The error's .nearest has those joints. (R0221)",
            solution,
            away,
            off,
        )


#: an arm, whose joints bring its tool to a pose, or a base, whose wheels drive it
Mechanism: TypeAlias = Arm | Wheels


def _way(q: Array, start: Array) -> float:
    return float(np.abs(q - start).max())
