"""CDR: what is encoded decodes to the same, and another implementation agrees."""

import importlib
import re
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from rems_net.defdict import Field, Schema, length, many, number
from rems_net.defdict.wire.cdr import HEADER, canonical, cdr
from rems_net.defdict.wire.ros2msg import members, ros2msg, type_name
from rems_net.errors import WireError
from tests.defdict.golden import CASES, FOLDER
from tests.defdict.strategies import schemas, values

FEW = settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
drawn = schemas.flatmap(lambda one: st.tuples(st.just(one), values(one)))


class Rosbags:
    """A schema as the library rosbags has it."""

    def __init__(self, schema: Schema):
        types: Any = importlib.import_module("rosbags.typesys")
        self.name = type_name("state", schema)
        self.store = types.get_typestore(types.Stores.EMPTY)
        text = ros2msg("state", schema)
        self.store.register(types.get_types_from_msg(text, self.name))

    def decode(self, message: bytes) -> Any:
        return self.store.deserialize_cdr(message, self.name)

    def encode(self, value: Any) -> bytes:
        return bytes(self.store.serialize_cdr(value, self.name))


def same(schema: Any, value: Any, found: Any) -> None:
    """Every field of a value is in what rosbags has found."""
    for key, plain in members(schema.entries).items():
        entry, ours, theirs = schema.entries[key], value[key], getattr(found, plain)
        if isinstance(entry, Schema):
            same(entry, ours, theirs)
        elif entry.item is not None:
            assert len(ours) == len(theirs)
            for one, other in zip(ours, theirs, strict=True):
                same(canonical(entry.item), one, other)
        elif entry.shape:
            assert np.array_equal(ours.ravel(), theirs), key
        elif entry.dtype == "bytes":
            assert ours == bytes(theirs), key
        else:
            assert ours == theirs, key


@given(drawn)
@FEW
def test_what_is_encoded_decodes_to_the_same(case: tuple[Schema, Any]) -> None:
    schema, given_values = case
    value, codec = schema(given_values), cdr(schema)
    message = codec.encode(value)
    assert codec.decode(message) == value
    assert codec.decode(message).encode() == value.encode()


@given(drawn)
@FEW
def test_a_payload_becomes_the_same_message(case: tuple[Schema, Any]) -> None:
    schema, given_values = case
    value, codec = schema(given_values), cdr(schema)
    assert codec.transcode(value.encode()) == codec.encode(value)


@given(drawn)
@FEW
def test_rosbags_reads_every_field_and_writes_the_same_bytes(
    case: tuple[Schema, Any],
) -> None:
    schema, given_values = case
    value, theirs = schema(given_values), Rosbags(schema)
    message = cdr(schema).encode(value)
    found = theirs.decode(message)
    same(canonical(schema), value, found)
    assert theirs.encode(found) == message


@given(drawn, st.randoms(use_true_random=False))
@FEW
def test_one_digest_has_one_message(case: tuple[Schema, Any], random: Any) -> None:
    """However its schema is ordered and called."""
    schema, given_values = case
    rows = list(schema.rows())
    random.shuffle(rows)
    other = Schema("other", dict(rows))
    assert other.digest == schema.digest
    message = cdr(schema).encode(schema(given_values))
    assert cdr(other).encode(other(given_values)) == message
    assert ros2msg("state", other) == ros2msg("state", schema)


@given(drawn, st.data())
@FEW
def test_a_message_that_is_damaged_is_refused(
    case: tuple[Schema, Any], data: st.DataObject
) -> None:
    """Cut, or with a byte changed: it decodes to a value, or raises WireError."""
    schema, given_values = case
    codec = cdr(schema)
    message = codec.encode(schema(given_values))
    cut = data.draw(st.integers(0, len(message) - 1))
    with pytest.raises(WireError):
        codec.decode(message[:cut])
    changed = bytearray(message)
    changed[cut] ^= data.draw(st.integers(1, 255))
    with suppress(WireError):
        codec.decode(bytes(changed)).encode()


@pytest.mark.parametrize("name", CASES)
def test_golden(name: str) -> None:
    """These bytes are in recordings, and stay readable."""
    schema, given_values = CASES[name]
    message = (FOLDER / f"{name}.cdr").read_bytes()
    assert cdr(schema).encode(schema(given_values)) == message
    assert cdr(schema).decode(message) == schema(given_values)
    text = (FOLDER / f"{name}.msg").read_text(encoding="utf-8")
    assert ros2msg("state", schema) == text


def test_numpy_reads_messages_of_one_length() -> None:
    schema, given_values = CASES["woodbot_sensors"]
    message = cdr(schema).encode(schema(given_values))
    layout = cdr(schema).layout
    assert layout is not None
    row = np.frombuffer(message, layout)[0]
    value = schema(given_values)
    assert {path: row[path] for path in schema.paths} == value.flat()
    assert cdr(CASES["every_kind"][0]).layout is None


def test_names_that_ros_does_not_have() -> None:
    names = ["joint/1", "1", "Left", "left", "a__b", "grün", "from", "string", "_x_"]
    schema = Schema("odd", {name: number() for name in names})
    plain = [name for entry in (schema, schema["joint"]) for name in
             members(entry.entries).values()]  # type: ignore[union-attr]  # fmt: skip
    assert all(re.fullmatch("[a-z](_?[a-z0-9]+)*", name) for name in plain)
    assert len(set(members(schema.entries).values())) == len(schema.entries)
    value = schema({name: float(i) for i, name in enumerate(names)})
    message = cdr(schema).encode(value)
    found = Rosbags(schema).decode(message)
    same(canonical(schema), value, found)
    assert cdr(schema).decode(message) == value


def test_groups_whose_names_would_be_one() -> None:
    schema = Schema("odd", {"a/bc/x": number(), "a_bc/x": length(), "a-bc/x": length()})
    value = schema({"a/bc/x": 1.0, "a_bc/x": 2.0, "a-bc/x": 3.0})
    same(canonical(schema), value, Rosbags(schema).decode(cdr(schema).encode(value)))


def test_a_schema_without_fields() -> None:
    for schema in (Schema("none", {}), Schema("s", {"list": many(Schema("n", {}))})):
        value = schema({"list": [{}, {}]} if len(schema) else {})
        message = cdr(schema).encode(value)
        found = Rosbags(schema).decode(message)
        assert Rosbags(schema).encode(found) == message
        assert cdr(schema).decode(message) == value


def test_units_and_ranges_are_comments() -> None:
    field: Field = length("mm", range=(0, 8190))
    text = ros2msg("sensors", Schema("s", {"front": field}))
    assert text == "float64 front  # mm 0..8190"


def test_what_is_no_message_says_so() -> None:
    schema = Schema("s", {"x": number()})
    with pytest.raises(WireError, match="s: this is no message in little-endian CDR"):
        cdr(schema).decode(b"\0\0\0\0" + bytes(8))
    with pytest.raises(WireError, match="9 bytes came; expected 8"):
        cdr(schema).decode(HEADER + bytes(9))
