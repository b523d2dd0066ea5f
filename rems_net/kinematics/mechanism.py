"""Mechanism: interface of everything with kinematics, arms and bases."""

from collections.abc import Sequence
from typing import Any, Protocol


class Mechanism(Protocol):
    """An arm, whose joints bring its tool to a pose, or a base, whose wheels drive it.

    joints: their paths, in order: for an arm in the state, for a base in the motors'
        command
    poses: whether it is an arm
    """

    @property
    def joints(self) -> tuple[str, ...]:
        """Paths of the joints."""

    @property
    def poses(self) -> bool:
        """Whether it is an arm."""

    def fk(self, q: Sequence[float], /) -> Any:
        """Return the Pose of the tool, or the Twist of the base."""

    def jacobian(self, q: Sequence[float], /) -> Any:
        """Return that result's change per joint, (6, n) or (3, n)."""

    def ik(self, goal: Any, /, *args: Any, **kwargs: Any) -> Any:
        """Return the joints for a goal. Raises UnreachableError."""
