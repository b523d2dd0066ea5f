"""One schema becomes another: units, percent, counts, tables, policies."""

import math
from typing import Any

import numpy as np
import pytest

from rems_net.defdict import (
    Field,
    Schema,
    angle,
    angular_velocity,
    array,
    blob,
    boolean,
    choice,
    count,
    integer,
    length,
    many,
    number,
    percent,
    ratio,
    text,
    time,
    velocity,
)
from rems_net.errors import ConversionError, FieldValueError, SchemaError, UnitError


def one(field: Field, name: str = "s") -> Schema:
    return Schema(name, {"x": field})


def through(a: Field, b: Field, x: Any) -> Any:
    return one(a, "a").converter(one(b, "b"))({"x": x}).x


CREATE = 0.5 / 0.036  # rad/s: 500 mm/s at a wheel of 36 mm radius


def test_one_wheel_speed_through_five_representations_and_back() -> None:
    model = one(angular_velocity("rad/s", range=(-8, 8)), "model")
    simulator = one(angular_velocity("rad/s", range=(-10, 10)), "simulator")
    dynamixel = one(angular_velocity("rpm", range=("-8 rad/s", "8 rad/s")), "dynamixel")
    # Pulses of 1 to 2 ms in a period of 20 ms, across the speeds of the servo.
    servo = one(ratio(range=(0.05, 0.10)), "servo")
    counts = count(
        range=(-500, 500), table=[(-500, -CREATE), (500, CREATE)], means="rad/s"
    )
    create = one(counts, "create")
    chain = [model, simulator, dynamixel, servo]
    for speed in (-8.0, -3.3, 0.0, 1.0, 6.8, 8.0):
        value = model(x=speed)
        seen = []
        for schema in [*chain[1:], *chain[-2::-1]]:
            value = value.to(schema)
            seen.append(value.x)
        assert value.schema == model
        assert value.x == pytest.approx(speed, abs=1e-12)
        assert seen[0] == speed
        assert seen[1] == pytest.approx(speed * 30 / math.pi)
        assert seen[2] == pytest.approx(0.075 + speed / 8 * 0.025)
        told = value.to(create)
        assert type(told.x) is int
        assert told.x == round(speed * 36)  # 36 mm/s for each rad/s
        half_a_count = CREATE / 500 / 2
        assert told.to(model.converter(model).target).x == pytest.approx(
            speed, abs=half_a_count + 1e-12
        )


@pytest.mark.parametrize(
    ("a", "b", "x", "y"),
    [
        # units
        (length("mm"), length("m"), 7, 0.007),
        (length("m"), length("cm"), 0.07, 7.000000000000001),
        (angle("deg"), angle("rad"), 180, math.pi),
        (velocity("km/hr"), velocity("m/s"), 36, 10),
        # percent of the target's range
        (percent(), angular_velocity("rad/s", range=(-8, 8)), 50, 4.0),
        (percent(), angular_velocity("rad/s", range=(-8, 8)), -100, -8.0),
        (percent(range=(0, 100)), length("m", range=(0, 2)), 50, 1.0),
        (percent(), length("m", range=(0, 2)), 50, 1.5),
        (percent(), length("m", range=(1, 5)), 0, 3.0),
        (angular_velocity(range=(-8, 8)), percent(), 4, 50.0),
        (percent(), percent(range=(-50, 50)), 25, 25.0),
        # ratio, both scales
        (ratio(), angular_velocity(range=(-8, 8)), 0.5, 4.0),
        (ratio(range=(0, 1)), length(range=(0, 2)), 0.25, 0.5),
        (ratio(), percent(), 0.5, 50.0),
        (percent(), ratio(), -25, -0.25),
        # counts through ranges
        (count(range=(-500, 500)), percent(), 250, 50.0),
        (percent(), count(range=(-500, 500)), 33.35, 167),
        (count(range=(0, 1023)), count(range=(0, 255)), 1023, 255),
        (count(range=(0, 180)), angular_velocity(range=(-8, 8)), 90, 0.0),
        (count(), count(), 5, 5),
        # plain numbers
        (integer(), number(), 3, 3.0),
        (number(), integer(), 2.6, 3),
        (boolean(), integer(), True, 1),
        (boolean(), number(), True, 1.0),
        # words
        (choice("a", "b"), choice("c", "b", "a"), "b", "b"),
        (choice("a", "b"), text(), "b", "b"),
        (text(), choice("a", "b"), "b", "b"),
        (text(), text(max_len=3), "abc", "abc"),
        (blob(), blob(max_len=3), b"abc", b"abc"),
        (boolean(), boolean(), True, True),
    ],
)
def test_becomes(a: Field, b: Field, x: Any, y: Any) -> None:
    found = through(a, b, x)
    assert found == y
    assert type(found) is type(one(b)().x)


TABLE = [(0, 0.0), (100, 0.1), (200, 0.5), (1000, 1.0)]


@pytest.mark.parametrize(
    ("raw", "metres"), [(0, 0.0), (50, 0.05), (100, 0.1), (150, 0.3), (600, 0.75)]
)
def test_a_table_of_any_length_is_straight_between_points(
    raw: int, metres: float
) -> None:
    sonar = count(range=(0, 1000), table=TABLE, means="m")
    assert through(sonar, length("cm"), raw) == pytest.approx(metres * 100)
    assert through(length("m"), sonar, metres) == raw
    assert through(sonar, percent(range=(0, 100)), raw) == pytest.approx(metres * 100)


def test_a_falling_table_and_its_ends() -> None:
    lidar = count(range=(0, 5000), table=[(0, 0.2), (4095, 0.0)], means="m")
    assert through(lidar, length(), 4095) == 0.0
    assert through(length(), lidar, 0.2) == 0
    for a, b, x in ((lidar, length(), 4096), (length(), lidar, 0.21)):
        with pytest.raises(FieldValueError, match="is outside the table"):
            through(a, b, x)


def test_a_pair_of_functions() -> None:
    servo = count(
        range=(0, 180), functions=(lambda n: n - 90, lambda d: d + 90), means="deg"
    )
    assert through(servo, angle("rad"), 180) == pytest.approx(math.pi / 2)
    assert through(angle("rad"), servo, math.pi / 2) == 180
    with pytest.raises(FieldValueError, match="from 0 to 180"):
        through(angle("rad"), servo, math.pi)
    with pytest.raises(SchemaError, match=r"Python functions, which cannot be sent"):
        one(servo).to_wire()


def test_arrays_convert_as_a_whole() -> None:
    found = through(array(3, "mm"), array(3, "m", range=(0, 2)), [1, 10, 100])
    assert found.tolist() == [0.001, 0.01, 0.1]
    with pytest.raises(ValueError, match="read-only"):
        found[0] = 1
    assert through(array(2, dtype="u1"), array(2), [1, 2]).dtype == np.float64
    assert through(array(2), array(2, dtype="u1"), [1.2, 2.6]).tolist() == [1, 3]
    with pytest.raises(FieldValueError, match=r"b: 'x'\[1\] expects"):
        through(array(2), array(2, dtype="u1"), [1, 300])
    with pytest.raises(ConversionError, match="shape"):
        through(array(2), array(3), [1, 2])


def test_lists_convert_each_item() -> None:
    mm, m = (Schema("p", {"x": length(unit)}) for unit in ("mm", "m"))
    a, b = Schema("a", {"p": many(mm)}), Schema("b", {"p": many(m, max_len=2)})
    value = a(p=[{"x": 1}, {"x": 2}])
    assert value.to(b) == {"p": [{"x": 0.001}, {"x": 0.002}]}
    same = value.to(Schema("c", {"p": many(mm)}))
    value.p[0].x = 9
    assert same.p[0].x == 1
    with pytest.raises(FieldValueError, match="at most 2"):
        a(p=[{}, {}, {}]).to(b)


def test_only_rounding_snaps_to_a_limit() -> None:
    a, b = angular_velocity("rpm"), angular_velocity("rad/s", range=(-8, 8))
    full = 8 * 30 / math.pi
    assert through(a, b, full * (1 + 1e-11)) == 8.0
    assert through(a, b, -full * (1 + 1e-11)) == -8.0
    with pytest.raises(FieldValueError) as caught:
        through(a, b, full * (1 + 1e-7))
    assert str(caught.value).startswith(
        "b: 'x' expects a number in rad/s from -8 to 8, but got 8.0000008. "
        "It was converted from 76.39"
    )


@pytest.mark.parametrize(
    ("a", "b", "says"),
    [
        (length(), time(), "m (length) cannot become s (time)"),
        (length(), number(), "m (length) cannot become a plain number (plain number)"),
        (percent(), length(), "percent is a share of a range, and the second has none"),
        (length(), percent(), "percent is a share of a range, and the first has none"),
        (count(), length(range=(0, 1)), "count is a share of a range, and the first"),
        (boolean(), length(), "bool cannot become float"),
        (number(), boolean(), "float cannot become bool"),
        (text(), number(), "str cannot become float"),
        (choice("a", "b"), choice("a"), "'b' is not one of a"),
        (length(), array(3, "m"), "shape of one value against (3,)"),
    ],
)
def test_does_not_become(a: Field, b: Field, says: str) -> None:
    with pytest.raises(ConversionError) as caught:
        one(a, "a").converter(one(b, "b"))
    assert str(caught.value).startswith(f"a cannot become b:\n  - 'x': {says}")
    wrong_dimension = "cannot become s (" in says or "plain number" in says
    assert isinstance(caught.value, UnitError) == wrong_dimension
