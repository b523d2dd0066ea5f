"""Keys and numbers of the firmware, held against Zenoh's and Python's."""

import json
import math

import pytest
import zenoh
from hypothesis import example, given, settings, strategies as st

from tests.firmware.protocol.core import Core

laws = settings(max_examples=400)

CHUNKS = ["rems", "robot", "w7", "w-77", "state", "x", "@schema", "@call", "wheel"]
GLOBS = [*CHUNKS, "*", "**", "w$*", "$*7", "s$*t$*e", "$*a$*", "r$*m$*s"]


@laws
@given(
    glob=st.lists(st.sampled_from(GLOBS), min_size=1, max_size=6),
    key=st.lists(st.sampled_from(CHUNKS), min_size=1, max_size=6),
)
@example(glob=["rems", "**"], key=["rems"])
@example(glob=["rems", "**", "x"], key=["rems", "@call", "x"])
@example(glob=["**", "state", "**", "x"], key=["rems", "state", "x", "state", "x"])
def test_a_question_covers_what_zenoh_says(
    core: Core, glob: list[str], key: list[str]
) -> None:
    asked = zenoh.KeyExpr.autocanonize("/".join(glob))
    whole = zenoh.KeyExpr("/".join(key))
    assert core.covers(str(asked), str(whole)) == asked.intersects(whole)


@laws
@given(st.floats(allow_nan=False, allow_infinity=False))
@example(0.1)
@example(-0.0)
@example(9.9999999999)
@example(123456789012.0)
@example(5e-324)
@example(1.7976931348623157e308)
def test_numbers_of_nine_digits(core: Core, number: float) -> None:
    text = core.real(number)
    assert math.isclose(json.loads(text), number, rel_tol=5.1e-9, abs_tol=1e-300)


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (0.0, "0.0"),
        (1.0, "1.0"),
        (-7.3, "-7.3"),
        (0.02, "0.02"),
        (8.24, "8.24"),
        (1234.5, "1234.5"),
        (1e20, "1e20"),
        (1.5e-7, "1.5e-7"),
        (math.nan, "null"),
        (math.inf, "null"),
    ],
)
def test_numbers_as_people_write_them(core: Core, number: float, text: str) -> None:
    assert core.real(number) == text
