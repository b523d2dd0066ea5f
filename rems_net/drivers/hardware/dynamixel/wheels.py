"""Wheels: a robot on two wheels, each turned by a servo: the Dynabot."""

from collections.abc import Mapping
from typing import Any

from rems_net.agents.ports import Settings
from rems_net.defdict import DefDict, Field, boolean, choice, integer
from rems_net.drivers.hardware.dynamixel import table
from rems_net.drivers.hardware.dynamixel.bus import Said
from rems_net.drivers.hardware.dynamixel.servos import Servos
from rems_net.drivers.hardware.odometry import Rolling
from rems_net.errors import SchemaError

SIDES = ("left", "right")


class Wheels(Rolling, Servos):
    """Driver of two wheels on DYNAMIXEL servos in velocity mode, with odometry.

    A servo turns its horn counter-clockwise at a positive speed. Seen from outside,
    that drives a left wheel ahead, and a right wheel back: so the right one is
    reversed. No wheel goes faster than the Velocity Limit that is set in its servo.
    """

    options = Settings(
        Servos.options.fields,
        left=integer(default=2, range=(0, 252), doc="ID of the servo on the left"),
        right=integer(default=1, range=(0, 252), doc="ID of the servo on the right"),
        model=choice(
            *table.MODELS.values(),
            default="XL430-W250",
            doc="of both; another one may be a joint of another robot",
        ),
        reversed_left=boolean(doc="whether a positive speed drives it back"),
        reversed_right=boolean(default=True, doc="the same, on the right"),
    )
    mode = table.VELOCITY_MODE
    goal = table.GOAL_VELOCITY
    holds = False
    counts, wrap, fits = table.TURN, 1 << 32, "dynabot"

    def prepare(self) -> None:
        if self.options.left == self.options.right:
            raise SchemaError(
                f"Both wheels of {self.key} have the servo {self.options.left}; each "
                "needs one of its own, such as options = "
                "{ left = 2, right = 1 }. (R0309)"
            )
        super().prepare()

    def names(self) -> Mapping[int, str]:
        return {self.options[side]: f"wheel/{side}" for side in SIDES}

    def models(self) -> Mapping[int, str]:
        model = self.options.model
        return {i: name for i, name in table.MODELS.items() if name == model}

    def still(self, said: Said) -> int:
        return 0

    def found(self, said: Mapping[int, Said]) -> None:
        self._limits = {servo: say(table.VELOCITY_LIMIT) for servo, say in said.items()}
        for servo, path in self.names().items():
            self._check_speed(servo, path)
            # Another program may have left one: wheels would start slowly.
            self.bus.write(servo, table.PROFILE_ACCELERATION, 0, "no acceleration")
        # A servo that kept its torque has kept its count; others begin within a turn.
        if not all(say(table.TORQUE) for say in said.values()):
            self._path.forget()

    def _check_speed(self, servo: int, path: str) -> None:
        """Warn if the servo's limit is below 100 % of its wheel's speed."""
        field = self.command.schema.find(path)
        top = field.range[1] if isinstance(field, Field) and field.range else 0.0
        limit = self._limits[servo] * table.VELOCITY
        if limit < 0.99 * top and not self._seen_all:
            self.note(
                f"turns {path} at {limit:.2f} rad/s at most, and 100 % is {top:.2f} "
                f"rad/s: the Velocity Limit of servo {servo}"
            )

    def goals(self, command: DefDict) -> Mapping[int, int]:
        goals = {}
        for side in SIDES:
            servo = self.options[side]
            counts = round(self._sign(side) * command[f"wheel/{side}"] / table.VELOCITY)
            limit = self._limits[servo]
            goals[servo] = max(-limit, min(limit, counts))
        return goals

    def readings(self, said: Mapping[int, Said]) -> dict[str, Mapping[str, Any]]:
        path, at = self._path, table.PRESENT_POSITION
        path.feed(*(self._sign(s) * said[self.options[s]](at) for s in SIDES))
        return self.rolled({"encoder/left": path.left, "encoder/right": path.right})

    def _sign(self, side: str) -> int:
        return -1 if self.options[f"reversed_{side}"] else 1
