"""Arithmetic: numbers with units, computed with and written back.

    value["wheel/*"] *= 2                # each field, in its own unit
    value.wheel += "0.1 rad/s"
    way = value["speed/*"] * (2 * s)     # a unyt_array, in m

Operators take a number, an array, a quantity, a text or another such value. A number
that is added is in the field's own unit. A result that is written back is checked
like any other value: one in another unit is refused, and then nothing changes.
"""

import importlib
import operator
from collections.abc import Callable, Iterable
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from rems_net.defdict.fields.accept import split_text
from rems_net.defdict.fields.descriptions import is_quantity, show
from rems_net.defdict.fields.field import Field
from rems_net.errors import FieldValueError, UnitError

Floats = NDArray[np.float64]
Operator = Callable[[Any, Any], Any]
#: Operators of two numbers in one unit.
SUMS = (operator.add, operator.sub)


class Arithmetic:
    """Operators of a value, of a group and of a glob: one element for each field."""

    __slots__ = ()
    # Above that of arrays and quantities: `array * value` asks this class first.
    __array_priority__ = 1e6

    def _named(self) -> tuple[str, Iterable[tuple[str, Field, Any]]]:
        """Return a name for errors, and path, field and leaf of each field."""
        raise NotImplementedError

    def _assign(self, values: Any) -> None:
        raise NotImplementedError

    def to_array(self, *, column: bool = False) -> Floats:
        """Return the numbers of all fields as a vector, or as a column (float64)."""
        name, rows = self._named()
        parts = [np.empty(0)]
        for path, field, leaf in rows:
            if not (field.numeric or field.dtype == "bool"):
                raise FieldValueError(
                    f"{name}: {path!r} is {field.dtype}, not a number; take numbers "
                    "only: a group or a glob of them, or schema.slice(...). (R0109)"
                )
            parts.append(np.ravel(np.asarray(leaf, dtype=np.float64)))
        flat = np.concatenate(parts)
        return flat.reshape(-1, 1) if column else flat

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        """Return the numbers of all its fields, for `np.asarray(value["wheel/*"])`."""
        if copy is False:
            raise ValueError(
                f"the numbers of {self._named()[0]} are copied into an array; leave "
                "out copy=False. (R0109)"
            )
        return self.to_array().astype(dtype or np.float64)

    def __add__(self, other: Any) -> Any:
        return _result(operator.add, self, other)

    def __radd__(self, other: Any) -> Any:
        return _result(operator.add, self, other, turned=True)

    def __sub__(self, other: Any) -> Any:
        return _result(operator.sub, self, other)

    def __rsub__(self, other: Any) -> Any:
        return _result(operator.sub, self, other, turned=True)

    def __mul__(self, other: Any) -> Any:
        return _result(operator.mul, self, other)

    def __rmul__(self, other: Any) -> Any:
        return _result(operator.mul, self, other, turned=True)

    def __truediv__(self, other: Any) -> Any:
        return _result(operator.truediv, self, other)

    def __rtruediv__(self, other: Any) -> Any:
        return _result(operator.truediv, self, other, turned=True)

    def __neg__(self) -> Any:
        return _result(operator.mul, self, -1)

    def __iadd__(self, other: Any) -> Self:
        return self._change(operator.add, other)

    def __isub__(self, other: Any) -> Self:
        return self._change(operator.sub, other)

    def __imul__(self, other: Any) -> Self:
        return self._change(operator.mul, other)

    def __itruediv__(self, other: Any) -> Self:
        return self._change(operator.truediv, other)

    def _change(self, function: Operator, other: Any) -> Self:
        """Write the result back into this value, all of its fields or none."""
        if isinstance(other, int | float | np.number) and type(other) is not bool:
            plain = {path: function(leaf, other) for path, _, leaf in _numbers(self)}
            self._assign(plain)  # without unyt, which takes 0.8 s to import
        else:
            self._assign(_result(function, self, other))
        return self


def _result(
    function: Operator, value: Arithmetic, other: Any, *, turned: bool = False
) -> Any:
    unyt: Any = importlib.import_module("unyt")
    mine = _quantities(value, unyt)
    if isinstance(other, Arithmetic):
        theirs = _quantities(other, unyt)
    elif isinstance(other, str):
        theirs = _read(other, value, unyt)
    else:
        theirs = other
    if function in SUMS and not _has_units(theirs):
        theirs = np.asarray(theirs) * _units(value, unyt)
    if np.dtype("O") in (mine.dtype, getattr(theirs, "dtype", None)):
        mine = _row([*mine], plain=False)
        each = theirs if np.ndim(theirs) else [theirs] * len(mine)
        theirs = _row([*each], plain=False)
    wrong = unyt.exceptions
    try:
        return function(theirs, mine) if turned else function(mine, theirs)
    except (wrong.UnitOperationError, wrong.InvalidUnitOperation) as error:
        units = ", ".join(dict.fromkeys(f.unit or "1" for _, f, _ in _numbers(value)))
        raise UnitError(
            f"{value._named()[0]} is in {units}, and cannot be computed with "
            f"{show(other)} so ({error}). Convert one of them first, or take fields "
            "of one unit. (R0102)"
        ) from error
    except (TypeError, ValueError) as error:
        name, count = value._named()[0], len(mine)
        raise FieldValueError(
            f"{name} has {count} fields, and is computed with a number, a quantity, or "
            f"one for each of its fields; got {show(other)}. (R0107)"
        ) from error


def _numbers(value: Arithmetic) -> list[tuple[str, Field, Any]]:
    name, rows = value._named()
    found = list(rows)
    for path, field, _ in found:
        if not field.numeric:
            raise FieldValueError(
                f"{name}: {path!r} is {field.dtype}, not a number; compute with a "
                "group or a glob that has only numbers. (R0109)"
            )
    return found


def _quantities(value: Arithmetic, unyt: Any) -> Any:
    """Return an array of unyt; of quantities if fields differ in unit or shape."""
    return _row([leaf for _, _, leaf in _numbers(value)]) * _units(value, unyt)


def _units(value: Arithmetic, unyt: Any) -> Any:
    """Return the unit of all fields, or an array with that of each."""
    rows = _numbers(value)
    made = [_unit(field, unyt) for _, field, _ in rows]
    if len({field.unit for _, field, _ in rows}) == 1 and not any(
        field.shape for _, field, _ in rows
    ):
        return made[0]
    return _row(made, plain=False)


def _unit(field: Field, unyt: Any) -> Any:
    return unyt.Unit(field.unit if field.unit not in ("", "ratio") else "dimensionless")


def _row(values: list[Any], *, plain: bool = True) -> Any:
    """Return values as an array, one element for each, also for an array."""
    if plain and not any(np.ndim(value) for value in values):
        return np.array(values, np.float64)
    row = np.empty(len(values), object)
    row[:] = [*values]
    return row


def _has_units(other: Any) -> bool:
    return is_quantity(other) or getattr(other, "dtype", None) == np.dtype("O")


def _read(text: str, value: Arithmetic, unyt: Any) -> Any:
    found = split_text(text)
    if found is None:
        raise FieldValueError(
            f"{value._named()[0]} is computed with a number or a quantity, but got "
            f'{text!r}. Type such as "0.1 m". (R0101)'
        )
    number, unit = found
    return unyt.unyt_quantity(number, unit) if unit else number
