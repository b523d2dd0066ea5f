"""Articulated: a robot with kinematics, under the names of its mechanisms."""

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

from rems_net.errors import FieldValueError, nearest

if TYPE_CHECKING:  # definitions without a mechanism do not need it
    from rems_net.kinematics.arm import Mechanism


class Articulated:
    """Forward and inverse kinematics, and Jacobians, of a robot's named mechanisms.

    The functions only compute; nothing moves. See docs/kinematics.md.
    """

    def mechanisms(self) -> "Mapping[str, Mechanism]":
        """Return the mechanisms with known kinematics, by name: an arm, a base."""
        return {}

    def motor_command(self, command: Any) -> Any:
        """Return the motors' commands, by path: by default, the command itself.

        A base whose command is its velocity adds the speeds of its wheels here; the
        result has all fields of the command, too.
        """
        return command

    def fk(self, joints: Mapping[str, Any] | None = None, *, of: str = "") -> Any:
        """Return the forward kinematics: a mechanism's pose or velocity.

        joints: some or all fields of the state; for a base, the speeds of its wheels.
            Missing fields have their present values: the state, or the command.
        of: name of the mechanism; not needed if there is only one

        Returns, in the robot's frame, an arm's Pose of the tool, or a base's Twist.
        Raises FieldValueError for a wrong name or value.
        """
        mechanism = self._mechanism(of)
        return mechanism.fk(self._joints(mechanism, joints))

    def jacobian(self, joints: Mapping[str, Any] | None = None, *, of: str = "") -> Any:
        """Return the motion per joint: (6, n) for an arm, (3, n) for a base.

        Arguments as of `fk`. Rows: velocity x, y, z and angular velocity x, y, z in the
        robot's frame; for a base x, y and turn. Columns: the joints, in order.
        """
        mechanism = self._mechanism(of)
        return mechanism.jacobian(self._joints(mechanism, joints))

    def ik(self, goal: Any, *, of: str = "", **more: Any) -> Any:
        """Return the inverse kinematics: joints that bring the mechanism to `goal`.

        An arm returns a Solution for a Pose or a position (and `pitch=`, `roll=`): the
        nearest to its present joints, or to `start=`, fields of the state. A base
        returns the speeds of its wheels by path, for a Twist. Raises
        UnreachableError with the nearest result that is possible.
        """
        mechanism = self._mechanism(of)
        if mechanism.poses:
            more["start"] = self._joints(mechanism, more.get("start"))
        return mechanism.ik(goal, **more)

    @cached_property
    def _mechanisms(self) -> "Mapping[str, Mechanism]":
        return self.mechanisms()

    def _mechanism(self, name: str) -> "Mechanism":
        have = self._mechanisms
        if not name and len(have) == 1:
            return next(iter(have.values()))
        if name not in have:
            names = ", ".join(map(repr, have)) or "no mechanism"
            raise FieldValueError(
                f"{type(self).__name__} has {names}; got of={name!r}; expected "
                f"the name of one.{nearest(name, have)} (R0220)"
            )
        return have[name]

    def _joints(
        self, mechanism: "Mechanism", given: Mapping[str, Any] | None
    ) -> list[float]:
        """Return a mechanism's joints: the present ones, or as given, in any unit."""
        own = self.__dict__
        now = own["state"] if mechanism.poses else self.motor_command(own["command"])
        if given:
            now = now.copy()
            now.update(given)
        return [now[path] for path in mechanism.joints]
