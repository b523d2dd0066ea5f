"""Shared: what every driver's world offers."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from rems_net.scenes.outline import Pose
from rems_net.scenes.scene import Scene


class Shared(Protocol):
    """World of a driver, with all the robots in it.

    before: called before each step, with its tick, to put ghosts to their poses.
    """

    scene: Scene
    before: Callable[[Any], None] | None

    def advance(self, dt: float) -> None:
        """Let the commands of all these robots act for `dt` seconds."""

    def reset(self, robots: Sequence[Any]) -> None:
        """Put robots back to their start; if all, everything else, too.

        Raises AgentError if another robot stands at the start of one.
        """

    def thing(self, number: int) -> tuple[Any, Any]:
        """Return where the scene's thing of that number is.

        Its position (3,) in m and its rotation (3, 3), thing to world.
        """

    def follow(self, number: int, pose: Pose | None) -> list[str]:
        """Put the scene's ghost of that number to a pose; None: it is not there.

        Returns the keys of the robots that it is inside of.
        """

    def look(self, number: int) -> Mapping[str, Any]:
        """Return the values of the rays and switches of a ghost, by sensor."""
