"""Articulated: a robot that is asked for its kinematics, whatever it has of them."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any

from rems_net.errors import FieldValueError, nearest
from rems_net.kinematics.mechanism import Mechanism


class Articulated:
    """Forward and inverse kinematics, and Jacobians, of the mechanisms that it names.

    All of it is computed; nothing moves. See docs/kinematics.md.
    """

    def mechanisms(self) -> Mapping[str, Mechanism]:
        """Return what it has whose kinematics are known, by name: an arm, a base."""
        return {}

    def motor_command(self, command: Any) -> Any:
        """Return what its motors are told, by path: the command, unless it says more.

        A base that is told how to go says here how fast its wheels turn for it; what
        it returns has all fields of the command, too.
        """
        return command

    def fk(self, joints: Mapping[str, Any] | None = None, *, of: str = "") -> Any:
        """Forward kinematics: where its joints bring it.

        joints: some or all fields of the state; of a base, the speeds of its wheels.
            The others are as they are now, or as they are told.
        of: name of the mechanism; may be left out where there is one

        Returns, in the robot's frame, of an arm the Pose of its tool, of a base its
        Twist. Raises FieldValueError for what does not fit.
        """
        mechanism = self._mechanism(of)
        return mechanism.fk(self._joints(mechanism, joints))

    def jacobian(self, joints: Mapping[str, Any] | None = None, *, of: str = "") -> Any:
        """How it moves by each joint: (6, n) of an arm, (3, n) of a base.

        Arguments as of `fk`. Rows: velocity x, y, z and angular velocity x, y, z in the
        robot's frame; of a base x, y and turn. Columns: the joints, in order.
        """
        mechanism = self._mechanism(of)
        return mechanism.jacobian(self._joints(mechanism, joints))

    def ik(self, goal: Any, *, of: str = "", **more: Any) -> Any:
        """Inverse kinematics: joints that bring it to `goal`.

        Of an arm a Solution, for a Pose or a position (and `pitch=`, `roll=`), the
        nearest to where it is now, or to `start=`, fields of the state. Of a base the
        speeds of its wheels by path, for a Twist. Raises UnreachableError, with what
        comes nearest.
        """
        mechanism = self._mechanism(of)
        if mechanism.poses:
            more["start"] = self._joints(mechanism, more.get("start"))
        return mechanism.ik(goal, **more)

    @cached_property
    def _mechanisms(self) -> Mapping[str, Mechanism]:
        return self.mechanisms()

    def _mechanism(self, name: str) -> Mechanism:
        have = self._mechanisms
        if not name and len(have) == 1:
            return next(iter(have.values()))
        if name not in have:
            names = ", ".join(map(repr, have)) or "no mechanism"
            raise FieldValueError(
                f"{type(self).__name__} has {names}; got of={name!r}; expected "
                f"the name of one.{nearest(name, have)}"
            )
        return have[name]

    def _joints(
        self, mechanism: Mechanism, given: Mapping[str, Any] | None
    ) -> list[float]:
        """The joints of a mechanism: those of now, or as given, in whatever unit."""
        own = self.__dict__
        now = own["state"] if mechanism.poses else self.motor_command(own["command"])
        if given:
            now = now.copy()
            now.update(given)
        return [now[path] for path in mechanism.joints]
