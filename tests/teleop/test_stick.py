"""A stick becomes the command of robots of all kinds, within their limits."""

import pytest
from hypothesis import given, strategies as st

from rems_net import Experiment, Schema
from rems_net.agents.rules import by_hand, connect, given_paths
from rems_net.defdict import angle, angular_velocity, percent, velocity
from rems_net.errors import ExperimentError
from rems_net.teleop.keys import KEYBOARD, KEYS, MOTIONS, stick_of
from rems_net.teleop.stick import STICK, check_drivable, stick_rule

AXIS = st.floats(-100, 100)
DRIVEN = {
    "woodbot": ("wheel/left", "wheel/right"),
    "create2": ("wheel/left", "wheel/right"),
    "pioneer3at": ("wheel/left", "wheel/right"),
    "moose": ("wheel/left", "wheel/right"),
    "youbot_base": ("linear/x", "linear/y", "angular/z"),
    "youbot": ("linear/x", "linear/y", "angular/z"),
}


def command(definition: str) -> Schema:
    lab = Experiment("lab")
    lab.robot("r", definition, "kinematic")
    return lab.check()["robot/r"].schemas()["command"]


@pytest.mark.parametrize("definition", DRIVEN)
def test_robots_of_all_kinds(definition: str) -> None:
    schema = command(definition)
    convert = connect(STICK, schema, (), "input/stick", "robot/r")
    assert given_paths(STICK, schema, ()) == {*DRIVEN[definition]}
    ahead, turn = convert(STICK({"ahead": 50})), convert(STICK({"turn": 50}))
    first, *_, last = DRIVEN[definition]
    top = dict(schema.rows())
    assert ahead[first] == pytest.approx(top[first].limits[1] / 2)
    # Counter-clockwise: the right side goes ahead, and the left one back.
    assert turn[last] == pytest.approx(top[last].limits[1] / 2)
    if first == "wheel/left":
        assert ahead[first] == ahead[last]
        assert turn[first] == -turn[last]
    assert convert(STICK()) == schema()


@given(AXIS, AXIS, AXIS)
def test_no_motion_leaves_the_limits_and_a_curve_stays(
    ahead: float, left: float, turn: float
) -> None:
    top = angular_velocity(range=(-7, 7))
    schema = Schema("wheels", {"wheel/left": top, "wheel/right": top})
    value = connect(STICK, schema, (), "a", "b")(
        STICK({"ahead": ahead, "left": left, "turn": turn})
    )
    one, other = value["wheel/left"], value["wheel/right"]
    assert max(abs(one), abs(other)) <= 7
    # The ratio of the sides is that of ahead - turn and ahead + turn.
    assert one * (ahead + turn) == pytest.approx(other * (ahead - turn), abs=1e-6)


def test_two_arms_called_left_and_right_are_no_wheels() -> None:
    arm = angle(range=(-1, 1))
    assert stick_rule(Schema("arms", {"left": arm, "right": arm})) is None
    with pytest.raises(ExperimentError, match="a stick cannot drive robot/arm: it mo"):
        check_drivable(command("scaler"), "robot/arm")


def test_a_speed_without_limits_is_not_driven() -> None:
    """100 % of it is no number."""
    assert stick_rule(Schema("cart", {"speed": velocity()})) is None
    one_way = Schema("cart", {"speed": velocity(range=(0, 1))})
    assert stick_rule(one_way) is None


def test_keys_of_a_keyboard() -> None:
    assert stick_of(set()) == {"ahead": 0, "left": 0, "turn": 0}
    assert stick_of({"up"}) == {"ahead": 60, "left": 0, "turn": 0}
    assert stick_of({"w", "up"}) == stick_of({"up"})
    assert stick_of({"up", "down", "q"}) == {"ahead": 0, "left": 60, "turn": 0}
    assert stick_of({"up", "right", "shift"}) == {"ahead": 20, "left": 0, "turn": -20}
    assert stick_of({"up", "space"}) == stick_of(set())


@given(st.sets(st.sampled_from(KEYS)))
def test_keys_in_a_connection_are_the_same_stick(held: set[str]) -> None:
    top = percent(range=(-100, 100))
    schema = Schema("wheels", {"wheel/left": top, "wheel/right": top})
    keys = KEYBOARD({name: name in held for name in KEYS})
    by_keys = connect(KEYBOARD, schema, (), "a", "b")(keys)
    by_stick = connect(STICK, schema, (), "a", "b")(STICK(stick_of(held)))
    assert by_keys == by_stick
    assert held & MOTIONS.keys() or by_keys == schema()


def test_other_connections_have_no_rule_of_their_own() -> None:
    plain = Schema("plain", {"ahead": percent()})
    assert by_hand(plain, command("woodbot")) == ()
    assert by_hand(STICK, STICK) == ()
