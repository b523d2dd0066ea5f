"""What other languages may write, and payloads that do not fit."""

import importlib
import math
import struct
import tracemalloc
from typing import Any

import pytest

from rems_net.defdict import (
    Schema,
    array,
    blob,
    boolean,
    choice,
    integer,
    length,
    many,
    number,
    text,
)
from rems_net.errors import FieldValueError, WireError

msgpack: Any = importlib.import_module("msgpack")

POSE = Schema("pose", {"x": length("m", range=(-2, 2)), "p": {"on": boolean()}})


MIXED = Schema(
    "mixed",
    {"n": integer(range=(0, 9)), "p": {"x": number()}, "mode": choice("a", "b")},
)


def packed(value: Any) -> bytes:
    made: bytes = msgpack.packb(value)
    return made


def test_whole_numbers_and_short_floats_are_numbers() -> None:
    good = msgpack.packb({"x": 1, "p": {"on": True}})
    assert POSE.decode(good) == {"x": 1.0, "p": {"on": True}}
    assert type(POSE.decode(good).x) is float
    short = msgpack.packb({"x": 0.5, "p": {"on": False}}, use_single_float=True)
    assert POSE.decode(short).x == 0.5
    mixed = msgpack.packb({"n": 1, "p": {"x": 2}, "mode": "b"})
    assert MIXED.decode(mixed) == {"n": 1, "p": {"x": 2.0}, "mode": "b"}


def test_any_order_and_any_header_is_read() -> None:
    assert POSE.decode(msgpack.packb({"p": {"on": True}, "x": 1.5})).x == 1.5
    map16 = b"\xde\x00\x02\xa1x\xcb" + struct.pack(">d", 1.5) + b"\xa1p\x81\xa2on\xc3"
    assert POSE.decode(map16).x == 1.5


def test_bytes_like_payloads() -> None:
    payload = POSE().encode()
    decode: Any = POSE.decode
    assert decode(bytearray(payload)) == POSE()
    assert decode(memoryview(payload)) == POSE()
    with pytest.raises(WireError, match="a payload is bytes, not"):
        decode("x" * len(payload))


@pytest.mark.parametrize(
    ("payload", "says"),
    [
        (b"", "pose: the payload is not one msgpack map: "),
        (b"\xc1", "pose: the payload is not one msgpack map: "),
        (packed([1, 2]), "pose: the payload is not one msgpack map: "),
        (packed(1.5), "pose expects a map of fields, but got 1.5. (R0123)"),
        (packed({"x": 1.0}), "pose: 'p' is missing from the payload: "),
        (
            packed({"x": 1.0, "p": {}}),
            "pose: 'p/on' is missing from the payload: ",
        ),
        (
            packed({"x": 1.0, "p": 2}),
            "pose: 'p' expects a map of fields, but got 2. (R0123)",
        ),
        (packed({"x": "1", "p": {"on": True}}), "pose: 'x' expects a number, but got"),
        (packed({"x": "1 m", "p": {"on": True}}), "pose: 'x' expects a number, but go"),
        (packed({"x": True, "p": {"on": True}}), "pose: 'x' expects a number, but got"),
        (packed({"x": None, "p": {"on": True}}), "pose: 'x' expects a number, but got"),
        (
            packed({"x": 3.0, "p": {"on": True}}),
            "pose: 'x' expects a number in m from ",
        ),
        (
            packed({"x": math.nan, "p": {"on": True}}),
            "pose: 'x' expects a number in m ",
        ),
        (
            packed({"x": math.inf, "p": {"on": True}}),
            "pose: 'x' expects a number in m ",
        ),
        (packed({"x": 1.0, "p": {"on": 1}}), "pose: 'p/on' expects True or False, but"),
        (
            packed({"X": 1.0, "p": {"on": True}}),
            "pose has no field 'X'. Did you mean 'x",
        ),
        (
            packed({"x": 1.0, "p": {"of": True}}),
            "pose has no field 'p/of'. It has 'on'. (R0123)",
        ),
        (
            packed({"x": 1.0, "p": {"on": True}}) + b"\x00",
            "pose: the payload is not one",
        ),
        (
            packed({"x": 1.0, "p": {"on": True}})[:-1],
            "pose: the payload is not one msg",
        ),
        (b"\x83\xa1x\x01\xa1x\x02\xa1p\x81\xa2on\xc3", "pose: the payload is not one "),
        (b"\x82\xa1x\x01\xa1x\x02", "pose: the payload is not one msgpack map: a key "),
        (b"\xc7\x00\x01", "pose expects a map of fields, but got ExtType"),
        (b"\xd6\xff\x00\x00\x00\x00", "pose: the payload is not one msgpack map: "),
        (b"\x82" + b"\x00" * 99, "pose: 100 bytes came; its longest payload has "),
    ],
)
def test_a_payload_that_does_not_fit(payload: bytes, says: str) -> None:
    with pytest.raises(WireError) as caught:
        POSE.decode(payload)
    assert str(caught.value).startswith(says)


@pytest.mark.parametrize(
    "found",
    [
        {"n": 1.0, "p": {"x": 1.0}, "mode": "a"},
        {"n": 10, "p": {"x": 1.0}, "mode": "a"},
        {"n": True, "p": {"x": 1.0}, "mode": "a"},
        {"n": 1, "p": {"x": 1.0}, "mode": "c"},
        {"n": 1, "p": {"x": 1.0}, "mode": ["a"]},
        {"n": 1, "p": {"x": 1.0}, "mode": {"a": 1}},
        {"n": 1, "p": {"x": math.nan}, "mode": "a"},
        {"n": 1, "p": {"x": 1.0, "y": 1.0}, "mode": "a"},
        {"n": 1, "p": "x", "mode": "a"},
        {"n": 1, "p": [1.0], "mode": "a"},
        {"n": 2**64 - 1, "p": {"x": 1.0}, "mode": "a"},
        {"n": 1, "p": {"x": 1.0}},
        {},
        None,
        "x",
    ],
)
def test_the_compiled_check_is_as_strict_as_the_slow_one(found: Any) -> None:
    with pytest.raises(WireError):
        MIXED.decode(packed(found))


@pytest.mark.parametrize(
    "payload",
    [
        b"\x84\xa1n\x01\xa1n\x02\xa1p\x81\xa1x\x01\xa4mode\xa1a",
        b"\x83\xa1n\x01\xa1p\x82\xa1x\x01\xa1x\x02\xa4mode\xa1a",
    ],
)
def test_a_key_that_comes_twice_is_refused(payload: bytes) -> None:
    with pytest.raises(WireError, match=r"a key comes twice|exceeds max_map_len"):
        MIXED.decode(payload)


def test_other_spellings_of_a_mixed_payload_are_read() -> None:
    value = MIXED({"n": 3, "p/x": 0.5, "mode": "b"})
    long_int = value.encode().replace(b"\xa1n\x03", b"\xa1n\xd1\x00\x03")
    str8 = value.encode().replace(b"\xa4mode", b"\xd9\x04mode")
    short = msgpack.packb(value.to_wire_map(), use_single_float=True)
    backwards = msgpack.packb(dict(reversed(value.to_wire_map().items())))
    assert len({value.encode(), long_int, str8, short, backwards}) == 5
    for payload in (value.encode(), long_int, str8, short, backwards):
        assert MIXED.decode(payload) == value
        assert MIXED.decode(payload).encode() == value.encode()


def test_lists_are_packed_in_the_order_of_their_own_schema() -> None:
    one = Schema("spot", {"x": length("m"), "id": integer()})
    two = Schema("spot", {"id": integer(), "x": length("m")})
    a, b = (
        Schema("s", {"in": {"l": many(item)}, "n": number()}) for item in (one, two)
    )
    other = Schema("s", {"n": number(), "in": {"l": many(two)}})
    value = a({"in/l": [{"x": 1, "id": 2}, {}]})
    assert a.digest == other.digest
    assert value.encode() == msgpack.packb(value.to_wire_map())
    swapped = other.encode(value)
    assert swapped == msgpack.packb(other.decode(swapped).to_wire_map())
    assert list(msgpack.unpackb(swapped)["in"]["l"][0]) == ["id", "x"]
    for schema in (a, b, other):
        assert schema.decode(swapped) == value
    empty = Schema("e", {"l": many(Schema("none"), max_len=2)})
    assert (
        empty.decode(empty({"l": [{}, {}]}).encode()).encode()
        == b"\x81\xa1l\x92\x80\x80"
    )


def test_arrays_and_bytes_are_bounded() -> None:
    schema = Schema("s", {"a": array(2, dtype="u2"), "b": blob(max_len=2), "t": text()})
    good = {"a": b"\1\0\2\0", "b": b"", "t": ""}
    assert schema.decode(packed(good)).a.tolist() == [1, 2]
    bad: list[dict[str, Any]] = [
        {"a": b"\1\0\2"},
        {"a": "abcd"},
        {"a": [1, 2]},
        {"b": b"123"},
        {"b": "1"},
        {"t": "x" * 257},
        {"t": b"x"},
    ]
    for one in bad:
        with pytest.raises(WireError, match=r"^s: "):
            schema.decode(packed({**good, **one}))
    bits = Schema("s", {"a": array(2, dtype="bool")})
    assert bits.decode(packed({"a": b"\0\1"})).a.tolist() == [False, True]
    with pytest.raises(WireError, match="bytes of 0 and 1"):
        bits.decode(packed({"a": b"\0\2"}))
    near = Schema("s", {"a": array(2, range=(0, 1))})
    with pytest.raises(WireError, match=r"s: 'a'\[1\] expects a number from 0 to 1"):
        near.decode(packed({"a": struct.pack("<dd", 0.5, math.nan)}))


def test_lists_are_bounded() -> None:
    spot = Schema("spot", {"x": length("m")})
    schema = Schema("s", {"p": {"spots": many(spot, max_len=2)}})
    assert schema.decode(packed({"p": {"spots": [{"x": 1}]}})).p.spots[0].x == 1.0
    for spots, says in (
        ([{"x": 1.0}] * 3, "not one msgpack map"),
        ([{"x": "a"}], r"s/p: 'spots'\[0\]: 'x' expects a number"),
        ([5], r"'spots'\[0\] expects a map"),
        ({"x": 1}, "expects a list of at most 2"),
    ):
        with pytest.raises(WireError, match=says):
            schema.decode(packed({"p": {"spots": spots}}))


@pytest.mark.parametrize(
    "payload",
    [
        b"\xdd\xff\xff\xff\xff" * 8,  # lists of four thousand million
        b"\x91" * 60,
        b"\x81\xa1x" * 20,
        b"\xdf\xff\xff\xff\xff" * 8,
        b"\xc6\xff\xff\xff\xff",
        b"\xdb\xff\xff\xff\xff",
    ],
)
def test_headers_that_promise_too_much_cost_nothing(payload: bytes) -> None:
    spot = Schema("spot", {"x": length("m")})
    for schema in (POSE, MIXED, Schema("s", {"p": many(spot, max_len=64)})):
        with pytest.raises(WireError):  # the first one compiles what reads it
            schema.decode(payload)
        tracemalloc.start()
        with pytest.raises(WireError):
            schema.decode(payload)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak < 200_000


def test_encode_takes_only_its_own() -> None:
    other = Schema("other", {"x": length("mm")})
    with pytest.raises(FieldValueError, match="cannot encode a value of other"):
        POSE.encode(other())
    assert POSE.encode({"x": 1, "p": {"on": True}}) == POSE([1, True]).encode()
    with pytest.raises(FieldValueError):
        POSE.encode({"x": "far"})
