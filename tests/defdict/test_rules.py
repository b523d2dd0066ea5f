"""Rules: found by the fields they need, composed, and run backwards."""

import math
from typing import Any, cast

import pytest

from rems_net.defdict import (
    DefDict,
    Schema,
    angle,
    angular_velocity,
    boolean,
    count,
    merge_schemas,
    percent,
    rule,
)
from rems_net.errors import (
    ConversionError,
    DimensionError,
    FieldValueError,
    SchemaError,
)

KEYS = Schema("keys", {key: boolean() for key in ("up", "down", "left", "right")})
WHEELS = {side: angular_velocity("rad/s", range=(-8, 8)) for side in ("left", "right")}
WOODBOT = Schema("woodbot.command", {"wheel": WHEELS})
SIDES = {"wheel": {"left": percent(), "right": percent()}}


@rule(needs=KEYS, gives=SIDES)
def drive(keys: DefDict) -> dict[str, float]:
    ahead, turn = keys.up - keys.down, keys.right - keys.left
    return {
        "wheel/left": max(-100.0, min(100.0, 60.0 * ahead + 40.0 * turn)),
        "wheel/right": max(-100.0, min(100.0, 60.0 * ahead - 40.0 * turn)),
    }


MOTORS = {"motor": {str(n): angular_velocity("rpm", range=(-80, 80)) for n in range(8)}}


@rule(needs={"wheel": WHEELS}, gives=MOTORS)
def two_to_eight(command: DefDict) -> list[str]:
    left, right = command.wheel.left, command.wheel.right
    return [f"{left} rad/s"] * 4 + [f"{right} rad/s"] * 4


def test_keyboard_to_wheels() -> None:
    convert = KEYS.converter(WOODBOT, [drive])
    assert convert({"up": True}) == {"wheel": {"left": 4.8, "right": 4.8}}
    assert convert({"up": True, "right": True}).wheel == {"left": 8.0, "right": 1.6}
    table = convert.explain()
    assert "wheel/left         percent -100..100  rad/s -8..8  x * 8.0" in table
    assert "up (for drive)" in table
    assert drive({"down": True}) == {"wheel": {"left": -60.0, "right": -60.0}}


def test_two_wheels_to_eight_motors_and_rules_compose() -> None:
    moose = Schema("moose.motors", MOTORS)
    found = WOODBOT.converter(moose, [two_to_eight])({"wheel/left": 1})
    assert found["motor/0"] == pytest.approx(30 / math.pi)
    assert found["motor/7"] == 0.0
    keys = KEYS.converter(moose, [two_to_eight, drive])({"down": True})
    assert keys["motor/5"] == pytest.approx(-4.8 * 30 / math.pi)
    with pytest.raises(ConversionError, match=r"'motor/0'.* needs 'wheel/left'"):
        KEYS.converter(moose, [two_to_eight])


def test_slave_joints_next_to_ordinary_fields() -> None:
    arm = Schema("arm", {"joint": {"1": angle("deg"), "2": angle("deg")}})
    motors = Schema(
        "motors", {"joint": {"1": angle(), "2": angle()}, "slave": {"2": angle()}}
    )

    @rule(needs={"joint/2": angle("rad")}, gives={"slave/2": angle("rad")})
    def mirror(joint: DefDict) -> dict[str, float]:
        return {"slave/2": -joint["joint/2"]}

    found = arm.converter(motors, [mirror])({"joint/1": 90, "joint/2": 180})
    assert found["joint/1"] == pytest.approx(math.pi / 2)
    assert found["slave/2"] == pytest.approx(-math.pi)


def test_a_rule_with_an_inverse_converts_back() -> None:
    model = Schema("model", {"joint": angle("rad", range=(-1.5, 1.5))})
    servo = Schema("servo", {"horn": count(range=(0, 180))})

    def to_joint(servo: DefDict) -> dict[str, Any]:
        return {"joint": math.radians(servo.horn - 90)}

    @rule(needs={"joint": angle()}, gives=servo, inverse=to_joint)
    def to_horn(model: DefDict) -> dict[str, int]:
        return {"horn": round(math.degrees(model.joint)) + 90}

    out = model(joint=math.radians(30)).to(servo, [to_horn])
    assert out == {"horn": 120}
    back = out.to(model, [to_horn])
    assert back.joint == pytest.approx(math.radians(30))
    assert "to_horn (inverse)" in servo.converter(model, [to_horn]).explain()
    assert to_horn.back() is not None
    assert drive.back() is None


def test_a_rule_wins_over_a_field_of_the_same_name() -> None:
    @rule(needs={"wheel/left": percent()}, gives={"wheel/left": percent()})
    def dead_band(command: DefDict) -> dict[str, float]:
        left = command["wheel/left"]
        return {"wheel/left": 0.0 if abs(left) < 5 else left}

    sides = Schema("sides", SIDES)
    convert = sides.converter(WOODBOT, [dead_band])
    assert convert({"wheel/left": 4, "wheel/right": 4}).wheel == {
        "left": 0.0,
        "right": 0.32,
    }


def test_ambiguous_rules_are_refused() -> None:
    @rule(needs=KEYS, gives=SIDES)
    def race(keys: DefDict) -> list[float]:
        return [100.0 * keys.up, 100.0 * keys.up]

    with pytest.raises(
        ConversionError, match="rules drive and race both give 'wheel/l"
    ):
        KEYS.converter(WOODBOT, [drive, race])


def test_a_rule_that_needs_what_it_gives_does_not_turn_in_circles() -> None:
    @rule(needs={"a": percent()}, gives={"b": percent()})
    def to_b(x: DefDict) -> dict[str, float]:
        return {"b": x.a}

    @rule(needs={"b": percent()}, gives={"a": percent()})
    def to_a(x: DefDict) -> dict[str, float]:
        return {"a": x.b}

    c, a = Schema("c", {"c": percent()}), Schema("a", {"a": percent()})
    with pytest.raises(ConversionError, match="nothing gives 'a'"):
        c.converter(a, [to_a, to_b])
    b = Schema("b", {"b": percent()})
    assert b(b=5).to(a, [to_a, to_b]) == {"a": 5.0}


@pytest.mark.parametrize(
    ("returned", "says"),
    [
        ({"wheel/left": 1}, "rule bad gives 'wheel/right', but its function returned"),
        (None, "rule bad returned nothing"),
        ([1], "rule bad: bad.gives has 2 fields"),
        ({"wheel/left": 101, "wheel/right": 0}, "rule bad: bad.gives: 'wheel/left' ex"),
        (["a", 0], "rule bad: bad.gives: 'wheel/left' expects a number in percent"),
    ],
)
def test_what_a_rule_returns_is_checked(returned: Any, says: str) -> None:
    @rule(needs=KEYS, gives=SIDES, name="bad")
    def bad(keys: DefDict) -> Any:
        return returned

    with pytest.raises(FieldValueError) as caught:
        KEYS.converter(WOODBOT, [bad])({})
    assert str(caught.value).startswith(says)


def test_a_rule_may_return_a_defdict_or_nested_dicts() -> None:
    sides = Schema("sides", SIDES)
    for returned in (sides([1, 2]), {"wheel": {"left": 1, "right": 2}}, (1, 2)):

        @rule(needs=KEYS, gives=sides)
        def give(keys: DefDict, returned: Any = returned) -> Any:
            return returned

        assert KEYS.converter(sides, [give])({}).wheel.right == 2.0

    rpm = Schema("rpm", {"speed": angular_velocity("rpm")})

    @rule(needs=KEYS, gives={"speed": angular_velocity("rad/s")})
    def other_unit(keys: DefDict) -> DefDict:
        return rpm(speed=60)

    assert other_unit({})["speed"] == pytest.approx(2 * math.pi)


def test_needs_of_another_dimension_are_refused() -> None:
    wrong = Schema("wrong", dict.fromkeys(KEYS, angle()))
    with pytest.raises(ConversionError, match="'up': float cannot become bool"):
        wrong.converter(WOODBOT, [drive])
    joint = Schema("j", {"wheel/left": angle(), "wheel/right": angle()})
    with pytest.raises(DimensionError, match=r"rad \(angle\) cannot become rad/s"):
        joint.converter(Schema("m", MOTORS), [two_to_eight])


def test_rules_are_checked_when_made() -> None:
    with pytest.raises(SchemaError, match="at least one field"):
        rule(needs={}, gives=SIDES)(lambda x: x)
    with pytest.raises(SchemaError, match="stands above a function"):
        rule(needs=KEYS, gives=SIDES)(cast("Any", 3))


# -- composition of schemas ---------------------------------------------------

BASE = Schema("base", {"x": angle(), "wheel": WHEELS})
ARM = Schema("arm", {"joint": {"1": angle("deg"), "2": angle("deg")}})


def test_schemas_add() -> None:
    both = BASE + ARM
    assert both.name == "base+arm"
    assert both.paths == (*BASE.paths, *ARM.paths)
    assert BASE.merge(ARM, name="youbot").name == "youbot"
    assert BASE + BASE == BASE
    with pytest.raises(TypeError):
        BASE + cast("Any", 3)


def test_a_clash_names_both_origins() -> None:
    other = Schema("arm", {"x": angle("deg", range=(0, 90))})
    with pytest.raises(SchemaError) as caught:
        merge_schemas([(BASE, "YoubotBase"), (other, "YoubotArm")])
    assert str(caught.value) == (
        "'x' is defined twice: rad by YoubotBase, and deg from 0 to 90 by YoubotArm. "
        "Rename one of them, or give one a prefix. (R0114)"
    )
    for first, second in ((0, 1), (1, 0)):
        pair = [(BASE, "Base"), (Schema("w", {"wheel": angle()}), "Arm")]
        with pytest.raises(SchemaError) as caught:
            merge_schemas([pair[first], pair[second]])
        assert str(caught.value) == (
            "'wheel' is a field in Arm, but a group in Base ('wheel/left'). "
            "Rename one of them. (R0114)"
        )


def test_rename_prefix_slice() -> None:
    assert BASE.rename({"wheel/left": "motor/1"}).paths == (
        "x",
        "motor/1",
        "wheel/right",
    )
    assert BASE.rename({"wheel": "w"}).paths == ("x", "w/left", "w/right")
    assert BASE.rename(name="b").name == "b"
    with pytest.raises(SchemaError, match="two fields would be named 'x'"):
        BASE.rename({"wheel/left": "x"})
    with pytest.raises(KeyError, match="no field 'wheels'"):
        BASE.rename({"wheels": "w"})
    assert ARM.prefix("arm").paths == ("arm/joint/1", "arm/joint/2")
    assert BASE.slice("wheel").paths == ("wheel/left", "wheel/right")
    assert BASE.slice("*/left", "x").paths == ("x", "wheel/left")
    assert (BASE + ARM).slice("**/1").paths == ("joint/1",)
    with pytest.raises(KeyError, match=r"no field '\*/up'"):
        BASE.slice("*/up")


def test_docs_do_not_clash_but_defaults_do() -> None:
    a, b = (Schema("s", {"x": angle(doc=doc)}) for doc in ("north", "heading"))
    assert a.merge(b) == a
    c = Schema("c", {"x": angle(default=1, max_age=0.5)})
    with pytest.raises(
        SchemaError, match=r"rad \(default 1.0\) \(max_age 0.5 s\) by c"
    ):
        a + c


def test_composed_schemas_keep_their_fields() -> None:
    moved = BASE.rename({"wheel": "w"}).prefix("base")
    assert moved["base/w/left"] == BASE["wheel/left"]
