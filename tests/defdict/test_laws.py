"""Laws that hold for any schema and any value."""

import importlib
import math
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from rems_net.defdict import DefDict, Field, Schema
from rems_net.defdict.values.classes import reader
from rems_net.errors import FieldValueError, RemsError, WireError
from tests.defdict.strategies import floats, names, plain_schemas, schemas, values

msgpack: Any = importlib.import_module("msgpack")
settings.register_profile(
    "laws",
    max_examples=60,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
relaxed = settings.get_profile("laws")


@relaxed
@given(st.data(), schemas)
def test_decoding_undoes_encoding(data: st.DataObject, schema: Schema) -> None:
    value = schema(data.draw(values(schema)))
    payload = value.encode()
    assert schema.decode(payload) == value
    assert schema.decode(payload).encode() == payload
    assert payload == msgpack.packb(value.to_wire_map())
    assert len(payload) <= reader(schema).max_size


@relaxed
@given(st.data(), schemas)
def test_the_compiled_decoder_agrees_with_the_slow_one(
    data: st.DataObject, schema: Schema
) -> None:
    value = schema(data.draw(values(schema)))
    slow = reader(schema).read(value.encode())
    assert schema.around(slow) == value


@relaxed
@given(schemas)
def test_schemas_travel_unchanged(schema: Schema) -> None:
    found = Schema.from_wire(schema.to_wire())
    assert found == schema
    assert hash(found) == hash(schema)
    assert found.digest == schema.digest
    assert str(found) == str(schema)


@relaxed
@given(st.data(), plain_schemas)
def test_order_does_not_change_the_digest(data: st.DataObject, schema: Schema) -> None:
    rows = list(zip(schema.paths, schema.fields, strict=True))
    other = Schema("other", dict(data.draw(st.permutations(rows))))
    assert other.digest == schema.digest
    value = schema(data.draw(values(schema)))
    assert other.decode(value.encode()) == value


@relaxed
@given(st.data(), schemas)
def test_a_value_is_a_mapping(data: st.DataObject, schema: Schema) -> None:
    value = schema(data.draw(values(schema)))
    assert set(value) == set(value.keys()) == set(schema)
    assert all(key in value for key in value)
    assert value == value.copy() == value | {} == schema(value)
    assert value == value.to_dict()
    assert list(value.describe()) == list(schema.paths)
    assert list(value["**"]) == list(schema.paths)
    assert len(repr(value)) > 0
    other = schema()
    other["**"] = value.flat()
    assert other == value


@relaxed
@given(st.data(), st.dictionaries(names, floats(), min_size=1))
def test_arrays_go_there_and_back(
    data: st.DataObject, entries: dict[str, Field]
) -> None:
    schema = Schema("numbers", entries)
    value = schema(data.draw(values(schema)))
    other = schema()
    other.from_array(value.to_array(column=True))
    assert other == value


@relaxed
@given(st.data(), schemas)
def test_anything_assigned_is_taken_or_refused(
    data: st.DataObject, schema: Schema
) -> None:
    junk: st.SearchStrategy[Any] = st.none() | st.booleans() | st.integers()
    junk = st.one_of(junk, st.floats(), st.text(), st.binary(), st.builds(object))
    junk = st.one_of(junk, st.lists(st.integers(), max_size=3))
    value = schema()
    path = data.draw(st.sampled_from([*schema.paths, *schema]) | st.text(max_size=5))
    given_value = data.draw(junk)
    try:
        value[path] = given_value
    except RemsError:
        assert value == schema()
    assert schema.decode(value.encode()) == value


@relaxed
@given(st.data(), floats(), st.floats())
def test_clip_keeps_the_nearest(data: st.DataObject, field: Field, x: float) -> None:
    schema = Schema("s", {"x": field})
    if math.isnan(x):
        with pytest.raises(FieldValueError):
            schema().clip(x=x)
        return
    low, high = field.limits
    assert schema().clip(x=x)["x"] == min(max(x, low), high)


RANGES = st.tuples(
    st.floats(-1e6, 1e6).filter(lambda x: x == 0 or abs(x) > 1e-6),
    st.floats(1e-3, 1e6),
).map(lambda t: (t[0], t[0] + t[1]))
KINDS = [("m", "inch"), ("rad/s", "rpm"), ("percent", "rad/s"), ("ratio", "percent")]
KINDS += [("percent", "m"), ("N*m", "mN*mm"), ("count", "deg"), ("km/hr", "m/s")]


@relaxed
@given(st.sampled_from(KINDS), RANGES, RANGES, st.floats(0, 1))
def test_conversions_come_back(
    units: tuple[str, str],
    near: tuple[float, float],
    far: tuple[float, float],
    at: float,
) -> None:
    relative = units[0] in ("percent", "count")
    a = Schema("a", {"x": Field("float", units[0], near)})
    b = Schema("b", {"x": Field("float", units[1], far if relative else None)})
    if units == ("ratio", "percent"):
        a = Schema("a", {"x": Field("float", "ratio", near)})
    x = min(max(near[0] + at * (near[1] - near[0]), near[0]), near[1])
    value = a(x=x)
    there = value.to(b)
    back = there.to(a)
    scale = max(abs(near[0]), abs(near[1]))
    if relative:
        # The other range may lie far from zero, where its numbers are coarse.
        scale *= 1 + max(map(abs, far)) / (far[1] - far[0])
        scale += max(map(abs, near)) / (near[1] - near[0])
    assert abs(back.x - x) <= 1e-9 * scale


@relaxed
@given(st.data(), schemas, st.binary(max_size=200))
def test_random_bytes_decode_or_are_refused(
    data: st.DataObject, schema: Schema, noise: bytes
) -> None:
    payload = schema(data.draw(values(schema))).encode()
    cut = data.draw(st.integers(0, len(payload)))
    for bad in (noise, payload[:cut] + noise, payload + noise):
        try:
            found = schema.decode(bad)
        except WireError:
            continue
        assert isinstance(found, DefDict)
        assert schema.decode(found.encode()) == found


@relaxed
@given(st.binary(max_size=300))
def test_random_bytes_are_no_schema(noise: bytes) -> None:
    with pytest.raises(WireError):
        Schema.from_wire(noise)
