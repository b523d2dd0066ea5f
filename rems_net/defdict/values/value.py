"""A DefDict: live values of one schema, behaving like a dict whose keys are fixed.

    value = command()
    value["wheel/left"] = 1.0          # a number in the field's unit
    value.wheel.left = "250 deg/s"     # or any other unit, as text or from unyt
    value["wheel"]                     # a live view on the group

`mapping.py` is how it is a mapping; here is the rest: attributes, bytes, conversion,
arrays, quantities of unyt, and text that shows units.
"""

import importlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from rems_net.defdict.fields.accept import in_unit, to_unit, unit_text
from rems_net.defdict.fields.descriptions import is_quantity, show
from rems_net.defdict.fields.field import Field
from rems_net.defdict.fields.kind import Kind
from rems_net.defdict.trees.paths import matching
from rems_net.defdict.trees.tree import Tree
from rems_net.defdict.values.arithmetic import Arithmetic
from rems_net.defdict.values.mapping import FixedMapping
from rems_net.errors import FieldValueError, UnknownAttributeError, UnknownFieldError

if TYPE_CHECKING:
    from rems_net.defdict.conversion.rule import Rule
    from rems_net.defdict.schema import Schema


class DefDict(FixedMapping, Arithmetic):
    """Live values of one schema. Made by calling the schema, never directly."""

    __slots__ = ()

    def __setattr__(self, key: str, value: Any) -> None:
        if key not in self._schema.entries:
            raise UnknownAttributeError(str(self._unknown(key)))
        if taken(key):
            raise UnknownAttributeError(
                f"{self._where(key)} has the name of a method of every DefDict. "
                f"Write value[{key!r}] = ... (R0105)"
            )
        self._set(key, value)

    def __getattr__(self, key: str) -> Any:
        if key.startswith("__"):
            raise AttributeError(key)
        raise UnknownAttributeError(str(self._unknown(key)))

    def encode(self) -> bytes:
        """Return the payload: one msgpack map in schema order."""
        return self.copy().encode()  # of a group; a whole value has its own, compiled

    def to(
        self,
        target: "Schema",
        rules: "Iterable[Rule]" = (),
        *,
        missing: str = "error",
        surplus: str = "drop",
    ) -> "DefDict":
        """Return this value converted into another schema."""
        convert = self._schema.converter(
            target, rules, missing=missing, surplus=surplus
        )
        return convert(self)

    def __reduce_ex__(self, protocol: object) -> NoReturn:
        raise TypeError(
            f"a DefDict is not pickled: send payload = value.encode(), and read it "
            f"with the schema of {self._schema.name}: value = "
            "schema.decode(payload). (R0108)"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return a plain nested dict."""
        return self._nested(np.asarray)

    def to_wire_map(self) -> dict[str, Any]:
        """Return the nested dict that is packed: arrays as bytes."""
        return self._nested(np.ndarray.tobytes)

    def _nested(self, array: Callable[[Any], Any]) -> dict[str, Any]:
        return {
            key: value._nested(array)
            if isinstance(value, DefDict)
            else [item._nested(array) for item in value]
            if type(value) is tuple
            else array(value)
            if isinstance(value, np.ndarray)
            else value
            for key, value in self.items()
        }

    def clip(
        self, values: Mapping[str, Any] | None = None, /, **fields: Any
    ) -> dict[str, Any]:
        """Set fields limited to their ranges; return path to what was kept."""
        asked = dict(_spread(self._schema, {**(values or {}), **fields}, ""))
        for path, number in asked.items():
            field = self._field(path)
            if field.numeric:
                asked[path] = _limited(field, number, f"{self._schema.name}: {path!r}")
        self.update(asked)
        return {path: self[path] for path in asked}

    def from_array(self, numbers: Any) -> None:
        """Set all fields from a vector or a column of numbers; all or none."""
        found = np.asarray(numbers)
        size = sum(field.size for field in self._schema.fields)
        if found.shape not in ((size,), (size, 1)):
            raise FieldValueError(
                f"{self._schema.name} has {size} numbers: it takes an array of shape "
                f"({size},) or ({size}, 1), not {found.shape}. (R0107)"
            )
        flat, first, given = found.ravel(), 0, {}
        for path, field, _ in self._rows():
            given[path] = _back(field, flat[first : first + field.size])
            first += field.size
        self.update(given)

    def quantity(self, path: str) -> Any:
        """Return a field as a quantity of unyt."""
        field = self._field(path)
        if not field.numeric:
            raise FieldValueError(
                f"{self._schema.name}: {path!r} is {field.dtype}, not a number; read "
                f"it as value[{path!r}]. (R0109)"
            )
        unyt = importlib.import_module("unyt")
        unit = field.unit if field.unit not in ("", "ratio") else "dimensionless"
        make = unyt.unyt_array if field.shape else unyt.unyt_quantity
        return make(self[path], unit)

    def describe(self) -> dict[str, dict[str, Any]]:
        """Return {path: {"value": ..., "unit": ...}} of what JSON can hold."""
        found = {}
        for path, field, leaf in self._rows():
            shown: Any = leaf
            if field.shape:
                shown = leaf.tolist()
            elif field.dtype == "bytes":
                shown = leaf.hex()
            elif field.dtype == "list":
                shown = [item.describe() for item in leaf]
            found[path] = {"value": shown, "unit": field.unit}
        return found

    def __repr__(self) -> str:
        rows = self._rows()
        inside = ", ".join(f"{path}={_text(field, x)}" for path, field, x in rows)
        return f"{self._schema.name}({inside})"

    def __str__(self) -> str:
        rows = self._rows()
        width = max((len(path) for path, _, _ in rows), default=0)
        texts = (f"  {path:{width}}  {_text(field, x)}" for path, field, x in rows)
        return "\n".join([self._schema.name, *texts])

    def _rows(self) -> list[tuple[str, Field, Any]]:
        schema = self._schema
        return list(zip(schema.paths, schema.fields, self.leaves(), strict=True))

    def _named(self) -> tuple[str, Iterable[tuple[str, Field, Any]]]:
        return self._place(), self._rows()

    def _field(self, path: str) -> Field:
        found = self._schema[path]
        if not isinstance(found, Field):
            raise UnknownFieldError(
                f"{self._schema.name}: {path!r} is a group of fields; name one of "
                "them. (R0104)"
            )
        return found


def taken(name: str) -> bool:
    """Return whether DefDict itself needs the attribute of that name."""
    return hasattr(DefDict, name) or name in FixedMapping.__annotations__


def _back(field: Field, part: np.ndarray[Any, Any]) -> Any:
    if field.dtype == "bool" or field.whole:
        rounded = np.rint(part)
        if np.array_equal(rounded, part):
            kind = bool if field.dtype == "bool" and set(part) <= {0, 1} else int
            part = rounded.astype(kind)
    return part.reshape(field.shape) if field.shape else part[0].item()


def _text(field: Field, leaf: Any) -> str:
    if field.dtype == "list":
        return f"[{', '.join(map(repr, leaf))}]"
    unit = f" {field.unit}" if field.unit else ""
    if field.shape:
        return f"{show(leaf.tolist())}{unit}"
    return f"{leaf!r}{unit}" if field.numeric else show(leaf)


def _spread(
    tree: Tree, given: Mapping[str, Any], prefix: str
) -> Iterator[tuple[str, Any]]:
    """Yield path and value of groups and globs, field by field."""
    for key, number in given.items():
        path = prefix + key
        if "*" in path:
            found = matching(path, tree.paths)
            if not found:
                raise tree.unknown(path)
            yield from ((one, number) for one in found)
        elif isinstance(tree[path], Tree) and isinstance(number, Mapping):
            yield from _spread(tree, number, f"{path}/")
        else:
            yield path, number


def _limited(field: Kind, number: Any, where: str) -> Any:
    """Return a number in the field's unit, limited; arrays element by element."""
    low, high = field.limits
    if not field.shape:
        number = in_unit(field, number, where)
    elif is_quantity(number):
        number = to_unit(field, unit_text(number.units), where, number)(number.value)
    found = np.asarray(number)
    if found.dtype.kind == "f" and np.isnan(found).any():
        raise FieldValueError(
            f"{where} has no nearest value to NaN; look for a division by 0. (R0101)"
        )
    if field.shape:
        return np.clip(found, low, high)
    number = min(max(number, low), high)
    return round(number) if field.whole else number
