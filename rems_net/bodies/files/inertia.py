"""Inertia: mass and moments of rigid parts, and of all parts together."""

from dataclasses import dataclass, field

import numpy as np

from rems_net.bodies.parts import Array
from rems_net.errors import SchemaError
from rems_net.kinematics.pose import Pose

#: Share. The largest moment of inertia may exceed the sum of the other two by this,
#: as from rounding in a file.
ROUNDING = 0.01
#: Share. It is then set to this much less than the sum, since engines round, too.
LESS = 1e-6
#: m. Radius of the ball whose inertia replaces an impossible one of zero.
BALL = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class Inertia:
    """Mass kg, moment (3,) kg m about a frame's origin, and inertia (3, 3) about it."""

    mass: float = 0.0
    moment: Array = field(default_factory=lambda: np.zeros(3))
    about: Array = field(default_factory=lambda: np.zeros((3, 3)))

    @classmethod
    def of(cls, mass: float, inertia: Array, at: Pose) -> "Inertia":
        """Return the inertia of a mass: `inertia` (3, 3) in a frame with the pose."""
        turn, centre = at.rotation, at.position
        return cls(
            mass, mass * centre, turn @ inertia @ turn.T + _steiner(mass, centre)
        )

    def seen(self, at: Pose) -> "Inertia":
        """Return the inertia seen from outside, if its frame has the pose `at`."""
        if not self.mass:
            return self
        inertia, centre = self.central()
        return Inertia.of(
            self.mass, inertia, Pose(at.position + at.rotation @ centre, at.rotation)
        )

    def __add__(self, other: "Inertia") -> "Inertia":
        return Inertia(
            self.mass + other.mass, self.moment + other.moment, self.about + other.about
        )

    def central(self) -> tuple[Array, Array]:
        """Return the inertia (3, 3) about the centre of mass, and the centre (3,)."""
        centre = self.moment / self.mass
        return self.about - _steiner(self.mass, centre), centre


def balanced(inertia: Array, mass: float, what: str, mend: bool) -> Array:
    """Return the inertia if it is possible, else the nearest, or a ball's.

    what: the link's name, for the message      mend: replace an impossible inertia
    """
    moments, axes = np.linalg.eigh(inertia)
    most = float(moments[0] + moments[1]) * (1 - LESS)
    if moments[0] > 0 and moments[2] <= most:
        return inertia
    if moments[0] > 0 and moments[2] <= most * (1 + ROUNDING):
        moments[2] = most
        return np.asarray(axes @ np.diag(moments) @ axes.T)
    if mend:
        return np.eye(3) * max(float(moments.mean()), 0.4 * mass * BALL**2)
    told = ", ".join(f"{one:.3g}" for one in moments)
    raise SchemaError(
        f"{what} has the moments of inertia {told} kg m2, which no body can have: each "
        "is above 0, and none is more than the other two together. Correct the file, "
        "or give the Model mend=True for those of a ball. (R0210)"
    )


def _steiner(mass: float, centre: Array) -> Array:
    return np.asarray(mass * (centre @ centre * np.eye(3) - np.outer(centre, centre)))
