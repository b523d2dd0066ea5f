"""The CDR codec of a schema: the bytes of a ROS 2 message, compiled as msgpack's are.

CDR is little-endian here, and each number is aligned to its own size. Fields are in
the order of their paths: schemas with one digest may have theirs in different orders,
and so have the same bytes all the same. A float is a float64, a whole number an int64,
text and choices are strings, bytes a sequence of uint8, arrays have a fixed length, and
a group or an item of a list is a message of its own.
"""

import struct
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property, lru_cache
from operator import attrgetter
from typing import Any

import numpy as np

from rems_net.defdict.fields.accept import accept
from rems_net.defdict.fields.field import Field
from rems_net.defdict.trees.tree import Tree
from rems_net.defdict.wire.codec import Code, decoder, targets
from rems_net.defdict.wire.reader import Reader
from rems_net.errors import FieldValueError, WireError, uncoded

#: the representation "CDR, little-endian", and two bytes of options: none
HEADER = b"\0\1\0\0"
_SCALARS = {"float": ("d", 8), "int": ("q", 8), "bool": ("?", 1)}
_LENGTH = struct.Struct("<I")
_BAD = (struct.error, UnicodeDecodeError, FieldValueError, OverflowError)

Put = Callable[[bytearray, list[Any]], None]
Take = Callable[[Any, int], tuple[list[Any], int]]
#: consecutive fields of fixed size, or one field of another kind, each with its leaf
Run = list[tuple[int, Field]]


@lru_cache(maxsize=2048)
def canonical(tree: Tree) -> Any:
    """Return the schema of the same digest that all of that digest share.

    Its fields are in the order of their paths, and have no docs.
    """
    fields = {
        path: replace(one, doc="", item=one.item and canonical(one.item))
        for path, one in sorted(tree.rows())
    }
    return type(tree)(f"x{tree.digest}", fields)


class Cdr:
    """Values of one schema as CDR, and back."""

    def __init__(self, schema: Any) -> None:
        self.schema = schema
        #: return the message of a value
        self.encode: Callable[[Any], bytes] = _encoder(schema)

    @cached_property
    def transcode(self) -> Callable[[bytes], bytes]:
        """Return the message of a msgpack payload; raise WireError if it can't be."""
        reader = Reader(self.schema)
        code = decoder(self.schema, reader)
        _write(self.schema, code)
        return code.compile("def transcode(payload):", f"cdr of {self.schema.name}")

    def decode(self, message: bytes) -> Any:
        """Return the value in a message; raise WireError if it does not fit."""
        name = self.schema.name
        if bytes(message[:4]) != HEADER:
            raise WireError(f"{name}: this is no message in little-endian CDR. (R0124)")
        data = bytes(message[4:])
        try:
            leaves, end = _taker(self.schema)(data, 0)
        except _BAD as why:
            raise WireError(
                f"{name}: the message does not fit: {uncoded(why)} (R0124)"
            ) from why
        if end != len(data):
            raise WireError(f"{name}: {len(data)} bytes came; expected {end}. (R0124)")
        return self.schema.around(leaves)

    @cached_property
    def layout(self) -> np.dtype[Any] | None:
        """Return the message as a type of numpy; None if its length varies."""
        found = list(_runs(self.schema))
        if len(found) != 1 or not found[0] or _open(found[0][0][1]):
            return None
        names, formats, offsets, at = [], [], [], 0
        for leaf, one in found[0]:
            at += -at % _align(one)
            names.append(self.schema.paths[leaf])
            kind = one.element if one.shape else {"d": "<f8", "q": "<i8", "?": "?"}
            scalar = kind if one.shape else kind[_SCALARS[one.dtype][0]]
            formats.append((scalar, one.shape))
            offsets.append(len(HEADER) + at)
            at += _size(one)
        form: Any = {"names": names, "formats": formats, "offsets": offsets}
        made: np.dtype[Any] = np.dtype(form | {"itemsize": len(HEADER) + at})
        return made


@lru_cache(maxsize=2048)
def cdr(schema: Any) -> Cdr:
    """Return the codec of a schema, compiled once."""
    return Cdr(schema)


class ToCdr:
    """Turns values of one schema, or their payloads, into messages.

    It stands where a Converter does, for what takes messages and no values.
    """

    def __init__(self, schema: Any) -> None:
        self._codec = cdr(schema)

    def __call__(self, value: Any) -> bytes:
        """Return the message of a value."""
        return self._codec.encode(value)

    @cached_property
    def decode(self) -> Callable[[bytes], bytes]:
        """Return the message of a payload; raise WireError if it does not fit."""
        return self._codec.transcode


def _open(one: Field) -> bool:
    return not one.shape and one.dtype not in _SCALARS


def _align(one: Field) -> int:
    return one.element.itemsize if one.shape else _SCALARS[one.dtype][1]


def _size(one: Field) -> int:
    return one.size * one.element.itemsize if one.shape else _SCALARS[one.dtype][1]


def _runs(tree: Tree) -> Iterator[Run]:
    """Yield the fields in the order of their paths, in runs."""
    run: Run = []
    places = sorted(range(len(tree.paths)), key=tree.paths.__getitem__)
    for leaf in places:
        one = tree.fields[leaf]
        if _open(one):
            if run:
                yield run
            yield [(leaf, one)]
            run = []
        else:
            run.append((leaf, one))
    if run or not places:
        yield run


def _struct(run: Run, at: int, before: str = "") -> struct.Struct:
    """Return the layout of a run that begins at a place, counted from its header."""
    form = f"<{before}"
    for _, one in run:
        gap = -at % _align(one)
        form += "x" * gap
        form += f"{_size(one)}s" if one.shape else _SCALARS[one.dtype][0]
        at += gap + _size(one)
    # A message of ROS 2 without fields has one byte all the same.
    return struct.Struct(form if run else f"{form}x")


def _encoder(tree: Tree) -> Callable[[Any], bytes]:
    code = Code([f"{targets(len(tree.fields))} = value._leaves"])
    _write(tree, code)
    return code.compile("def encode(value):", f"cdr of {tree.name}")


@lru_cache(maxsize=2048)
def _putter(tree: Tree) -> Put:
    """Compile what appends the leaves of an item to a message."""
    code = Code([f"{targets(len(tree.fields))} = leaves"])
    code.lines += _appended(tree, code.names)
    return code.compile("def put(out, leaves):", f"cdr of {tree.name}")


def _write(tree: Tree, code: Code) -> None:
    """Add the lines that return the message of the leaves v0, v1 and so on."""
    runs = list(_runs(tree))
    if len(runs) == 1 and not (runs[0] and _open(runs[0][0][1])):
        code.names |= {"cdr": _struct(runs[0], 0, "4s").pack, "HEADER": HEADER}
        code.lines.append(f"return cdr({', '.join(['HEADER', *_arguments(runs[0])])})")
    else:
        code.names["HEADER"] = HEADER
        code.lines.append("out = bytearray(HEADER)")
        code.lines += _appended(tree, code.names)
        code.lines.append("return bytes(out)")


def _appended(tree: Tree, names: dict[str, Any]) -> list[str]:
    names |= {"put_bytes": _put_bytes, "put_list": _put_list}
    lines = []
    for run in _runs(tree):
        if not run or not _open(run[0][1]):
            name = f"run{run[0][0] if run else 0}"
            names[name] = [_struct(run, at).pack for at in range(8)]
            lines.append(
                f"out += {name}[len(out) + 4 & 7]({', '.join(_arguments(run))})"
            )
            continue
        (leaf, one) = run[0]
        if one.item is not None:
            names[f"item{leaf}"] = _putter(one.item)
            lines.append(f"put_list(out, v{leaf}, item{leaf})")
        elif one.dtype == "bytes":
            lines.append(f"put_bytes(out, v{leaf})")
        else:
            lines.append(f"put_bytes(out, v{leaf}.encode() + b'\\0')")
    return lines


def _arguments(run: Run) -> list[str]:
    return [f"v{i}.tobytes()" if one.shape else f"v{i}" for i, one in run]


def _put_bytes(out: bytearray, data: bytes) -> None:
    out += bytes(-len(out) & 3) + _LENGTH.pack(len(data)) + data


_leaves = attrgetter("_leaves")


def _put_list(out: bytearray, items: tuple[Any, ...], put: Put) -> None:
    out += bytes(-len(out) & 3) + _LENGTH.pack(len(items))
    for leaves in map(_leaves, items):
        put(out, leaves)


@lru_cache(maxsize=2048)
def _taker(tree: Tree) -> Take:
    """Return a function that reads leaves from a place, and returns the next place."""
    runs = list(_runs(tree))
    fixed = [
        None if run and _open(run[0][1]) else [_struct(run, at) for at in range(8)]
        for run in runs
    ]

    def take(data: bytes, at: int) -> tuple[list[Any], int]:
        leaves: list[Any] = [None] * len(tree.fields)
        for run, structs in zip(runs, fixed, strict=True):
            if structs is None:
                (leaf, one) = run[0]
                leaves[leaf], at = _take_open(one, data, at)
            else:
                form = structs[at & 7]
                for (leaf, one), found in zip(
                    run, form.unpack_from(data, at), strict=True
                ):
                    if one.shape:
                        found = np.frombuffer(found, one.element).reshape(one.shape)
                    leaves[leaf] = found
                at += form.size
        for leaf, (path, one) in enumerate(tree.rows()):
            if one.item is None:
                leaves[leaf] = accept(one, leaves[leaf], f"{tree.name}: {path!r}")
        return leaves, at

    return take


def _take_open(one: Field, data: bytes, at: int) -> tuple[Any, int]:
    at += -at & 3
    (length,) = _LENGTH.unpack_from(data, at)
    at += _LENGTH.size
    if one.item is not None:
        if length > one.max_len:
            raise FieldValueError(
                f"a list has {length} items; at most {one.max_len}. (R0124)"
            )
        items = []
        for _ in range(length):
            leaves, at = _taker(one.item)(data, at)
            items.append(one.item.around(leaves))
        return tuple(items), at
    if length > len(data) - at:
        raise FieldValueError(
            f"it ends {length - len(data) + at} bytes too early. (R0124)"
        )
    found = data[at : at + length]
    at += length
    if one.dtype == "bytes":
        return found, at
    if found[-1:] != b"\0":
        raise FieldValueError("a string does not end with a zero. (R0124)")
    return found[:-1].decode(), at
