"""Mechanism: what has kinematics, whichever way its joints are connected."""

from collections.abc import Sequence
from typing import Any, Protocol


class Mechanism(Protocol):
    """An arm, whose joints bring its tool to a pose, or a base, whose wheels drive it.

    joints: paths of them, in order: of an arm in the state, of a base in what its
        motors are told
    poses: whether it is an arm
    """

    @property
    def joints(self) -> tuple[str, ...]:
        """Their paths."""

    @property
    def poses(self) -> bool:
        """Whether it is an arm."""

    def fk(self, q: Sequence[float], /) -> Any:
        """Return the Pose of the tool, or the Twist of the base."""

    def jacobian(self, q: Sequence[float], /) -> Any:
        """Return how that changes by each joint, (6, n) or (3, n)."""

    def ik(self, goal: Any, /, *args: Any, **kwargs: Any) -> Any:
        """Return the joints for it. Raises UnreachableError."""
