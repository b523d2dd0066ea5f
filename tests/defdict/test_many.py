"""Many values at once: the same numbers as one by one."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rems_net.defdict import Schema, gather, length, number, scatter

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
