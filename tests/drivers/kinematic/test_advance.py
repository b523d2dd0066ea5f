"""`advance`: fields that go to a target and halt there, beside those with rates."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rems_net.agents.ports import In, Out
from rems_net.agents.robot import Definition, combine
from rems_net.defdict import DefDict, Schema, angle, velocity
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.errors import SchemaError, UnknownFieldError
from rems_net.kinematics.servo import speed_toward, toward


class Gate(Definition):
    """A bar that is lowered and raised; nothing of it has a rate."""

    command = In(Schema("gate.command", {"bar": angle(range=(0, 1.5))}))
    state = Out(Schema("gate.state", {"bar": angle()}))

    def advance(self, state: DefDict, command: DefDict, dt: float) -> Any:
        return {"bar": toward(state["bar"], command["bar"], 0.5 * dt)}


class Cart(Gate):
    """A gate on wheels, whose bar sees where the cart was before the step."""

    command = In(
        Schema("cart.command", {"bar": angle(range=(0, 1.5)), "speed": velocity()})
    )
    state = Out(Schema("cart.state", {"bar": angle(), "x": angle(), "seen": angle()}))

    def derivative(self, state: DefDict, command: DefDict) -> Any:
        return {"x": command["speed"]}

    def advance(self, state: DefDict, command: DefDict, dt: float) -> Any:
        return super().advance(state, command, dt) | {"seen": state["x"]}


def made(kind: type[Definition], **more: Any) -> Kinematic:
    robot = combine(kind, Kinematic)("bot", **more)
    robot.prepare()
    assert isinstance(robot, Kinematic)
    return robot


def test_what_only_goes_to_targets_needs_no_rates() -> None:
    gate = made(Gate)
    gate.command = {"bar": 1.2}
    gate.drive(gate.command, 1.0)
    assert gate.state["bar"] == 0.5
    gate.drive(gate.command, 10.0)
    assert gate.state["bar"] == 1.2


def test_both_begin_at_the_same_state() -> None:
    cart = made(Cart, options={"substeps": 2})
    cart.command = {"bar": 1.0, "speed": 2.0}
    cart.drive(cart.command, 1.0)
    assert cart.state == {"bar": 0.5, "x": 2.0, "seen": 1.0}


def test_a_field_that_the_state_has_not_is_refused_before_anything_moves() -> None:
    class Odd(Gate):
        def advance(self, state: DefDict, command: DefDict, dt: float) -> Any:
            return {"bra": 0.0}

    with pytest.raises(UnknownFieldError, match=r"'bra'.* Did you mean 'bar'"):
        made(Odd)


def test_what_it_takes_and_gives_is_said() -> None:
    class Short(Definition):
        command, state = In(Gate.command), Out(Gate.state)

        def advance(self, state: DefDict, command: DefDict) -> Any:
            return {}

    with pytest.raises(SchemaError, match=r"expected `def advance\(self, state, comm"):
        made(Short)

    class Silent(Gate):
        def advance(self, state: DefDict, command: DefDict, dt: float) -> Any:
            state["bar"] = 1.0

    with pytest.raises(SchemaError, match=r"Silent\.advance .* sets state\['bar'\]"):
        made(Silent)


some = st.floats(-10, 10)


@given(some, some, st.floats(0, 5))
def test_towards_a_target(position: float, target: float, most: float) -> None:
    gone = toward(position, target, most)
    assert min(position, target) <= gone <= max(position, target)
    assert abs(gone - position) <= most * (1 + 1e-12) + 1e-12
    if abs(target - position) <= most:
        assert gone == target
    speed = speed_toward(gone, target, most)
    assert speed == 0 if gone == target else speed * (target - gone) >= 0
    wide = toward(np.array([position]), np.array([target]), np.array([most]))
    assert wide[0] == gone
    assert speed_toward(np.array([gone]), np.array([target]), most)[0] == speed
