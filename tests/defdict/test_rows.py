"""RowCodec: the messages of a crowd at once, as they are made one by one."""

import numpy as np
from hypothesis import given, strategies as st

from rems_net import Schema
from rems_net.defdict import Batch, Rows, boolean, cdr, number, row_codec
from rems_net.packing import pack

STATE = Schema("state", {"y": number("m"), "b": {"x": number("m", range=(-1, 1))}})
NUMBERS = st.tuples(st.floats(allow_nan=False, allow_infinity=False), st.floats(-1, 1))


@given(st.lists(NUMBERS, min_size=1, max_size=5))
def test_rows_are_the_messages_of_their_values(
    numbers: list[tuple[float, float]],
) -> None:
    values = [STATE({"y": y, "b": {"x": x}}) for y, x in numbers]
    codec, one = row_codec(STATE), cdr(STATE)
    assert codec is not None
    made = [one.encode(value) for value in values]
    assert [*map(bytes, codec.of_values(values))] == made
    rows = codec.of_payloads([value.encode() for value in values])
    assert rows is not None
    assert [*map(bytes, rows)] == made


def test_a_payload_that_is_unusual_or_wrong_is_left_to_the_slow_way() -> None:
    codec, right = row_codec(STATE), STATE({"y": 1.0, "b": {"x": 0.5}}).encode()
    assert codec is not None
    whole = pack({"y": 1, "b": {"x": 0.5}})  # right, too: another language wrote it
    far = right[:-8] + np.array(2.0, ">f8").tobytes()
    none = right[:-8] + np.array(np.nan, ">f8").tobytes()
    other = right.replace(b"x", b"z")
    for payload in (whole, far, none, other, b""):
        assert codec.of_payloads([right, payload]) is None


def test_other_fields_than_floats_have_no_rows() -> None:
    assert row_codec(Schema("s", {"on": boolean()})) is None
    assert row_codec(Schema("s", {})) is None


def test_a_table_is_the_same_from_rows_and_from_single_messages() -> None:
    layout, one = cdr(STATE).layout, cdr(STATE)
    values = [STATE({"y": float(i), "b": {"x": 0.0}}) for i in range(3)]
    codec = row_codec(STATE)
    assert codec is not None
    assert layout is not None
    keys = ("a", "b", "c")
    crowd, single = Batch(), Batch()
    crowd.rows.append(Rows(keys, codec.of_values(values)))
    single.update(zip(keys, map(one.encode, values), strict=True))
    for batch in (crowd, single):
        assert batch.table(keys, layout)["y"].tolist() == [0.0, 1.0, 2.0]
        assert batch.table(("c", "a"), layout)["y"].tolist() == [2.0, 0.0]
    assert crowd == single
