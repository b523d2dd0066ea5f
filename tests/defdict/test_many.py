"""Many values at once: the same numbers as one by one."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rems_net.defdict import Schema, gather, length, number, scatter, text
from rems_net.errors import FieldValueError

SCHEMA = Schema("cart", {"x": length("m"), "arm": {"a": number(), "b": number()}})
floats = st.floats(allow_nan=False, allow_infinity=False)


@given(st.lists(st.tuples(floats, floats, floats), min_size=1, max_size=9))
def test_a_table_is_what_the_values_are(rows: list[tuple[float, float, float]]) -> None:
    values = [SCHEMA(row) for row in rows]
    assert gather(values).tolist() == [value.leaves() for value in values]
    others = [SCHEMA() for _ in rows]
    arm = others[0].arm
    scatter([list(row) for row in rows], others)
    assert others == values
    assert arm == values[0].arm, "a view on a group shows what came"


def test_numpy_takes_the_numbers() -> None:
    value = SCHEMA({"x": 1.0, "arm": {"a": 2.0, "b": 3.0}})
    assert np.asarray(value).tolist() == [1.0, 2.0, 3.0]
    assert np.array(value.arm, dtype="f4").tolist() == [2.0, 3.0]
    assert np.array([value, value]).shape == (2, 3)
    with pytest.raises(FieldValueError, match="'tag' is str, not a number; take n"):
        np.asarray(Schema("named", {"tag": text()})())
