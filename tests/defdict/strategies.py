"""Random fields, schemas and values for hypothesis."""

import math
from typing import Any

import numpy as np
from hypothesis import strategies as st

from rems_net.defdict import Field, Schema, array, blob, boolean, choice, many, text
from rems_net.defdict.fields.kind import ARRAYS

UNITS = ["", "m", "mm", "rad", "deg", "rad/s", "rpm", "N*m", "percent", "ratio", "uT"]
names = st.from_regex(r"[a-z_][a-z0-9_]{0,8}", fullmatch=True)
finite = st.floats(allow_nan=False, allow_infinity=False)


@st.composite
def floats(draw: st.DrawFn) -> Field:
    limits = draw(st.none() | st.tuples(finite, finite))
    if limits is not None and not math.isfinite(limits[1] - limits[0]):
        limits = None  # no range spans more than a float can say
    if limits is not None:
        limits = (min(limits), max(limits)) if limits[0] != limits[1] else None
    return Field("float", draw(st.sampled_from(UNITS)), limits)


@st.composite
def integers(draw: st.DrawFn) -> Field:
    ends = st.integers(-(2**63), 2**63 - 1)
    limits = draw(st.none() | st.tuples(ends, ends))
    if limits is not None:
        limits = (min(limits), max(limits)) if limits[0] != limits[1] else None
    return Field("int", range=limits)


@st.composite
def arrays(draw: st.DrawFn) -> Field:
    shape = draw(st.lists(st.integers(1, 3), min_size=1, max_size=3).map(tuple))
    return array(shape, dtype=draw(st.sampled_from(ARRAYS)))


words = st.lists(st.text(min_size=1, max_size=5), min_size=1, max_size=4, unique=True)
leaves = st.one_of(
    floats(),
    floats(),
    integers(),
    arrays(),
    st.builds(boolean),
    st.builds(text, max_len=st.integers(1, 40)),
    st.builds(blob, max_len=st.integers(1, 40)),
    words.filter(lambda one: all(w.isprintable() for w in one)).map(
        lambda one: choice(*one)
    ),
)
trees: st.SearchStrategy[Any] = st.recursive(
    st.dictionaries(names, leaves, min_size=1, max_size=5),
    lambda inner: st.dictionaries(names, leaves | inner, min_size=1, max_size=4),
    max_leaves=4,
)
plain_schemas = trees.map(lambda tree: Schema("random", tree))
schemas = st.one_of(
    plain_schemas,
    st.tuples(plain_schemas, plain_schemas, names).map(
        lambda t: Schema("random", {"it": t[0], "list": {t[2]: many(t[1], max_len=3)}})
    ),
)


def leaf_values(field: Field) -> st.SearchStrategy[Any]:
    low, high = field.limits if field.numeric else (0, 0)
    if field.shape:
        if field.dtype == "bool":
            one: st.SearchStrategy[Any] = st.booleans()
        elif field.whole:
            one = st.integers(int(low), int(high))
        else:
            one = st.floats(allow_nan=False, allow_infinity=False)
            if field.dtype == "f4":
                one = st.floats(allow_nan=False, allow_infinity=False, width=32)
        return st.lists(one, min_size=field.size, max_size=field.size).map(
            lambda xs: np.array(xs, dtype=field.dtype).reshape(field.shape)
        )
    if field.dtype == "float":
        return st.floats(low, high, allow_nan=False, allow_infinity=False)
    if field.dtype == "int":
        return st.integers(int(low), int(high))
    if field.dtype == "bool":
        return st.booleans()
    if field.dtype == "choice":
        return st.sampled_from(field.choices)
    if field.dtype == "str":
        return st.text(max_size=field.max_len).filter(
            lambda s: len(s.encode()) <= field.max_len
        )
    if field.dtype == "bytes":
        return st.binary(max_size=field.max_len)
    assert field.item is not None
    return st.lists(values(field.item), max_size=field.max_len)


def values(schema: Schema) -> st.SearchStrategy[dict[str, Any]]:
    rows = zip(schema.paths, schema.fields, strict=True)
    return st.fixed_dictionaries({path: leaf_values(field) for path, field in rows})
