"""Robots: definitions that merge, drivers that are joined to them."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest

from rems_net import Definition, Driver, In, Out, Schema, Settings
from rems_net.agents.robot import join
from rems_net.defdict import DefDict, angle, angular_velocity, length, velocity
from rems_net.errors import SchemaError, UnknownFieldError


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
    robot = join(Mobile, Still)("m", parameters={"top": "50 cm/s", "reach": 0.7})
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


def test_a_slot_of_its_own_wins() -> None:
    class Own(Base, Arm):
        state = Out(Schema("own.state", {"z": length()}))

    robot = join(Own, Still)("o")
    robot.prepare()
    assert robot.state.schema.paths == ("z",)


def test_each_init_runs_once() -> None:
    """REMS ran a driver's __init__ twice when it was bound to a definition."""
    Still.made.clear()
    join(Mobile, Still)("once")
    assert Still.made == ["once"]


def test_an_unknown_parameter_is_refused() -> None:
    with pytest.raises(UnknownFieldError, match="Did you mean 'track'"):
        join(Mobile, Still)("m", parameters={"trak": 0.1})
