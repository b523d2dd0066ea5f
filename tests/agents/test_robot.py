"""Robots: definitions that merge, drivers that are joined to them."""

from typing import Any, ClassVar

import pytest

from rems_net import (
    Create2,
    Definition,
    Driver,
    In,
    Out,
    Process,
    Schema,
    Settings,
    Woodbot,
)
from rems_net.agents.robot import combine
from rems_net.defdict import DefDict, angle, angular_velocity, length, velocity
from rems_net.drivers.kinematic.correction import limits
from rems_net.errors import FieldValueError, SchemaError, UnknownFieldError


class Base(Definition):
    parameters = Settings(top=velocity("m/s", default=0.8), track=length(default=0.3))
    command = In(
        lambda p: Schema("base.command", {"speed": velocity(range=(-p.top, p.top))})
    )
    state = Out(Schema("base.state", {"x": length(), "y": length()}))


class Arm(Definition):
    parameters = Settings(reach=length("m", default=0.6))
    command = In(Schema("arm.command", {"joint": {"1": angular_velocity()}}))
    state = Out(Schema("arm.state", {"joint": {"1": angle()}}))
    sensors = Out(Schema("arm.sensors", {"grip": length()}))


class Mobile(Base, Arm):
    """Both, as it is: nothing to write."""


class Still(Driver):
    made: ClassVar[list[str]] = []

    def __init__(self, *args: Any, **more: Any):
        super().__init__(*args, **more)
        self.made.append(self.name)

    def drive(self, command: DefDict, dt: float) -> None:
        pass

    def sense(self) -> None:
        pass


def test_definitions_merge() -> None:
    robot = combine(Mobile, Still)("m", parameters={"top": "50 cm/s", "reach": 0.7})
    robot.prepare()
    assert robot.parameters == {"top": 0.5, "track": 0.3, "reach": 0.7}
    assert robot.command.schema.paths == ("speed", "joint/1")
    assert robot.state.schema.paths == ("x", "y", "joint/1")
    assert robot.sensors.schema.paths == ("grip",)
    robot.command.speed = 0.5
    with pytest.raises(ValueError, match=r"from -0\.5 to 0\.5"):
        robot.command.speed = 0.6


def test_a_clash_names_both_origins() -> None:
    class Tall(Definition):
        state = Out(Schema("tall.state", {"x": length("mm"), "z": length()}))

    with pytest.raises(SchemaError) as caught:

        class Both(Base, Tall):
            pass

    assert str(caught.value).startswith("'x' is defined twice: ")
    assert " by Base, and " in str(caught.value)
    assert " by Tall. " in str(caught.value)


class Rolls(Base):
    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        return {"x": command["speed"]}

    def measure(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        return {"seen": 1.0}


class Bends(Arm):
    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        return {"joint/1": command["joint/1"]}


def test_mathematics_merge() -> None:
    class Whole(Rolls, Bends):
        pass

    robot: Any = combine(Whole, Still)("w")
    robot.prepare()
    robot.command = {"speed": 0.2, "joint/1": 0.3}
    rates = robot.derivative(robot.state, robot.command)
    assert rates == {"x": 0.2, "joint/1": 0.3}
    assert robot.measure(robot.state, robot.command) == {"seen": 1.0}


def test_mathematics_of_its_own_win() -> None:
    class Own(Rolls, Bends):
        def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
            return {}

    robot: Any = Own("s")
    assert robot.derivative(None, None) == {}


def test_of_two_that_say_how_a_field_moves_the_first_counts() -> None:
    class Slows(Base):
        """Goes on top of another, which it asks."""

        def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
            above: Any = super()
            return {p: r / 2 for p, r in above.derivative(state, command).items()}

    class Slow(Slows, Rolls, Bends):
        pass

    robot: Any = combine(Slow, Still)("s")
    robot.prepare()
    robot.command = {"speed": 0.2, "joint/1": 0.3}
    rates = robot.derivative(robot.state, robot.command)
    assert rates == {"x": 0.1, "joint/1": 0.3}


def test_a_robot_without_mechanisms_says_so() -> None:
    robot: Any = combine(Mobile, Still)("m")
    robot.prepare()
    with pytest.raises(FieldValueError, match="has no mechanism; got of=''"):
        robot.fk()


def test_a_slot_of_its_own_wins() -> None:
    class Own(Base, Arm):
        state = Out(Schema("own.state", {"z": length()}))

    robot = combine(Own, Still)("o")
    robot.prepare()
    assert robot.state.schema.paths == ("z",)


def test_each_init_runs_once() -> None:
    """REMS ran a driver's __init__ twice when it was bound to a definition."""
    Still.made.clear()
    combine(Mobile, Still)("once")
    assert Still.made == ["once"]


def test_an_unknown_parameter_is_refused() -> None:
    with pytest.raises(UnknownFieldError, match="Did you mean 'track'"):
        combine(Mobile, Still)("m", parameters={"trak": 0.1})


def test_a_port_of_a_robot_in_another_agent() -> None:
    """Its range depends on the robot's parameters; the other agent has none."""

    class Copy(Process):
        options = Settings(gain=length())
        read = In(Woodbot.command)
        made = Out(Woodbot.command)
        inherited = In(Create2.command)
        place = Out(Create2.state)

    agent = Copy("copy")
    agent.prepare()
    for value in (agent.read, agent.made):
        assert limits(value.schema)["wheel/left"] == 7.3
    top = limits(agent.inherited.schema)["wheel/left"]
    assert top == pytest.approx(0.5 / 0.036)  # m/s, m: Create 2's own, by its wheels
    assert Create2.command is Create2.command
    assert Create2.command is not Woodbot.command
    assert "heading" in agent.place


def test_a_port_whose_robot_leaves_its_parameters_to_others() -> None:
    from rems_net.robots.differential import Differential

    class Watch(Process):
        wheels = In(Differential.command)

    with pytest.raises(SchemaError) as found:
        Watch("watch").prepare()
    assert str(found.value) == (
        "Watch.wheels takes the schema of Differential.command, which depends on "
        "parameters that Differential does not have. Name a robot that has them, such "
        "as In(Woodbot.command). (R0509)"
    )
