"""A robot whose motors are told what its definition makes of the command."""

from typing import Any

import pytest

from rems_net.agents.ports import In
from rems_net.agents.robot import Driver, combine
from rems_net.defdict import DefDict, Schema, angular_velocity, velocity
from rems_net.errors import SchemaError
from rems_net.robots.woodbot import Woodbot
from tests.drivers.physics.test_physics import ENGINES
from tests.robots.moving import running

pytestmark = pytest.mark.parametrize("engine", ENGINES)
WHEELS = Schema(
    "wheels", {"wheel/left": angular_velocity(), "wheel/right": angular_velocity()}
)


class Told(Woodbot):
    """A Woodbot that is told how fast to go ahead."""

    command = In(Schema("told.command", {"speed": velocity(range=(-0.1, 0.1))}))

    def motor_command(self, command: DefDict) -> DefDict:
        rim = command["speed"] / self.parameters.wheel_radius
        both = {"wheel/left": rim, "wheel/right": rim}
        return command.schema.merge(WHEELS)(command.flat() | both)

    def measure(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        return super().measure(state, self.motor_command(command))


def test_motors_obey_what_is_made_of_the_command(engine: type[Driver]) -> None:
    with running(Told, engine) as robot:
        robot.command = {"speed": "5 cm/s"}
        for _ in range(10):
            robot.drive(robot.command, 0.1)
        robot.sense()
        assert robot.state["x"] == pytest.approx(0.05, rel=0.05)
        assert abs(robot.state["y"]) < 1e-3
        assert robot.published()["command"].paths == ("speed",)


def test_what_is_no_value_of_a_schema_is_refused(engine: type[Driver]) -> None:
    class Wrong(Told):
        def motor_command(self, command: DefDict) -> Any:
            return {"wheel/left": 1.0, "wheel/right": 1.0}

    with pytest.raises(SchemaError, match=r"motor_command\(\) returned \{'wheel/left'"):
        combine(Wrong, engine)("w").prepare()
