"""The compiled codec of a schema: the same bytes as msgpack, without its detours.

A schema of floats, booleans and arrays always has the same length, and between the
values always the same bytes; its codec is one `struct` call each way, measured at a
third of the time of msgpack. Any other schema goes through msgpack, and the compiled
part checks all its types and limits in one expression; that the keys are those of the
schema, in order, once each, is seen by packing again. A payload that fails goes to
the `Reader`, which accepts it after all or reports exactly what is wrong.

Both are written as Python. `encoder` is a method that reads its value's leaves itself;
`decoder` is the lines that take the leaves out of a payload, for a function that then
makes a value of them, or converts them first. Text of a schema enters them as `repr`.
"""

import itertools
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any

import numpy as np

from rems_net.defdict.fields.field import Field
from rems_net.defdict.trees.tree import Tree
from rems_net.defdict.wire.reader import Reader, read_leaf
from rems_net.errors import WireError
from rems_net.packing import UNPACK_ERRORS, map_header, pack


@dataclass
class Code:
    """The lines of a function, and the names that they need."""

    lines: list[str]
    names: dict[str, Any] = field(default_factory=dict)

    def source(self, head: str) -> str:
        """Return the text of the function whose first line is `head`."""
        return f"{head}\n" + "".join(f"    {line}\n" for line in self.lines)

    def compile(self, head: str, title: str) -> Callable[..., Any]:
        """Return the function whose first line is `head`."""
        names = dict(self.names)
        exec(compile(self.source(head), f"<{title}>", "exec"), names)
        made: Callable[..., Any] = names[head[4 : head.index("(")]]
        return made


def targets(count: int) -> str:
    """Return the left side of an assignment to so many leaves."""
    return "".join(f"v{i}, " for i in range(count)) or "[]"


def encoder(tree: Tree) -> Callable[[Any], bytes]:
    """Compile the method of a value that returns its payload."""
    if _is_fixed(tree):
        parts = payload_parts(tree)
        code = Code([], {"pack": struct.Struct(_format(parts)).pack})
        packed = []
        for i, (constant, one) in enumerate(parts):
            code.names[f"K{i}"] = constant
            packed += [f"K{i}", _put(one, f"v{i}")]
        result = f"pack({', '.join(packed)})"
    else:
        code = Code([], {"pack": pack, "leaves": attrgetter("_leaves")})
        result = f"pack({_dict(tree)})"
    code.lines = [f"{targets(len(tree.fields))} = self._leaves", f"return {result}"]
    return code.compile("def encode(self):", f"encoder of {tree.name}")


def decoder(tree: Tree, reader: Reader) -> Code:
    """Write the lines that put the leaves of `payload` into v0, v1 and so on."""
    code = _decode_fixed(tree) if _is_fixed(tree) else _decode_open(tree, reader)
    code.names["slow"] = reader.read
    return code


def _is_fixed(tree: Tree) -> bool:
    return bool(tree.fields) and all(
        one.shape or one.dtype in ("float", "bool") for one in tree.fields
    )


def payload_parts(tree: Tree) -> list[tuple[bytes, Field]]:
    """Return the fields of a payload, each with the constant bytes before it."""
    parts: list[tuple[bytes, Field]] = []
    constant = map_header(len(tree))
    for key, entry in tree.entries.items():
        constant += pack(key)
        if isinstance(entry, Tree):
            inner = payload_parts(entry)
            parts += [(constant + inner[0][0], inner[0][1]), *inner[1:]]
        else:
            if entry.shape:
                size = _size(entry)
                constant += pack(bytes(size))[:-size]
            elif entry.dtype == "float":
                constant += b"\xcb"
            parts.append((constant, entry))
        constant = b""
    return parts


def _size(one: Field) -> int:
    return one.size * one.element.itemsize


def _format(parts: list[tuple[bytes, Field]]) -> str:
    codes = {"float": "d", "bool": "B"}
    return ">" + "".join(
        f"{len(constant)}s{f'{_size(one)}s' if one.shape else codes[one.dtype]}"
        for constant, one in parts
    )


def _put(one: Field, v: str) -> str:
    if one.shape:
        return f"{v}.tobytes()"
    return f"0xC3 if {v} else 0xC2" if one.dtype == "bool" else v


def _decode_fixed(tree: Tree) -> Code:
    parts = payload_parts(tree)
    layout = struct.Struct(_format(parts))
    names: dict[str, Any] = {"unpack": layout.unpack}
    unpacked, tests, after = [], [], []
    for i, (constant, one) in enumerate(parts):
        names[f"K{i}"] = constant
        unpacked += [f"k{i}", f"v{i}"]
        test = f"{one.limits[0]!r} <= v{i} <= {one.limits[1]!r}"
        if one.shape:
            names[f"read{i}"] = _array(one)
            test = f"(v{i} := read{i}(v{i})) is not None"
        elif one.dtype == "bool":
            test = f"0xC2 <= v{i} <= 0xC3"
            after.append(f"        v{i} = v{i} == 0xC3")
        tests += [f"k{i} == K{i}", test]
    slow = f"{targets(len(parts))} = slow(payload)"
    return Code(
        [
            f"if len(payload) == {layout.size} and type(payload) is bytes:",
            f"    {', '.join(unpacked)} = unpack(payload)",
            f"    if {' and '.join(tests)}:",
            *(after or ["        pass"]),
            "    else:",
            f"        {slow}",
            "else:",
            f"    {slow}",
        ],
        names,
    )


def _array(one: Field) -> Callable[[bytes], Any]:
    """Return the reader of an array: the array, or None if it is not acceptable."""
    shape, element = one.shape, one.element
    bounds = one.limits if one.dtype != "bool" else None
    open_ended = one.range is None and one.whole

    def read(data: bytes) -> Any:
        found = np.frombuffer(data, element).reshape(shape)
        if open_ended:
            return found
        if bounds is None:
            return None if data.strip(b"\0\1") else found
        low, high = bounds
        return found if ((found >= low) & (found <= high)).all() else None

    return read


def _decode_open(tree: Tree, reader: Reader) -> Code:
    """Unpack, take the values out, and pack again: the same bytes, so the same form."""
    names: dict[str, Any] = {"pack": pack, "leaf": read_leaf}
    names |= {"unpack": reader.plain, "bad": UNPACK_ERRORS, "WireError": WireError}
    taken, tests = [], []
    for i, (path, one) in enumerate(tree.rows()):
        *groups, key = path.split("/")
        taken.append(
            f"v{i} = found{''.join(f'[{chunk!r}]' for chunk in (*groups, key))}"
        )
        where = f"{'/'.join((tree.name, *groups))}: {key!r}"
        tests.append(_test(one, i, where, names))
    tests.append(f"pack({_dict(tree, raw=True)}) == payload")
    return Code(
        [
            f"fits = type(payload) is bytes and len(payload) <= {reader.max_size}",
            "if fits:",
            "    try:",
            *(f"        {line}" for line in ["found = unpack(payload)", *taken]),
            f"        fits = {' and '.join(tests)}",
            "    except WireError:",
            "        raise",
            "    except (KeyError, *bad):",
            "        fits = False",
            "if not fits:",
            f"    {targets(len(tree.fields))} = slow(payload)",
        ],
        names,
    )


def _test(one: Field, i: int, where: str, names: dict[str, Any]) -> str:
    v = f"v{i}"
    if one.shape:
        names[f"read{i}"] = _array(one)
        return (
            f"type({v}) is bytes and len({v}) == {_size(one)} "
            f"and ({v} := read{i}({v})) is not None"
        )
    if one.dtype in ("float", "int"):
        low, high = one.limits
        return f"type({v}) is {one.dtype} and {low!r} <= {v} <= {high!r}"
    if one.dtype == "choice":
        names[f"names{i}"] = frozenset(one.choices)
        return f"type({v}) is str and {v} in names{i}"
    if one.dtype == "str":
        return f"type({v}) is str and len({v}) <= {one.max_len // 4}"
    if one.dtype == "bytes":
        return f"type({v}) is bytes and len({v}) <= {one.max_len}"
    if one.dtype == "list":
        names[f"field{i}"] = one
        return f"({v} := leaf(field{i}, r{i} := {v}, {where!r})) is not None"
    return f"type({v}) is bool"


def _dict(tree: Tree, places: Iterator[int] | None = None, raw: bool = False) -> str:
    """Write the dict that is packed; `raw` if lists are still as they came, in r0."""
    rows = []
    places = places or itertools.count()
    for key, entry in tree.entries.items():
        if isinstance(entry, Tree):
            rows.append(f"{key!r}: {_dict(entry, places, raw)}")
            continue
        i = next(places)
        value = f"v{i}.tobytes()" if entry.shape else f"v{i}"
        if entry.item is not None and raw:
            value = f"r{i}"
        elif entry.item is not None:
            each = targets(len(entry.item.fields))
            value = f"[{_dict(entry.item)} for {each} in map(leaves, v{i})]"
        rows.append(f"{key!r}: {value}")
    return f"{{{', '.join(rows)}}}"
