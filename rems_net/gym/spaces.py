"""Spaces: gymnasium's description of ports, and the way of their values there and back.

Ports whose fields are all numbers have one Box, in the order of the schemas, in the
fields' own units. Other ports have a Dict with a space for each field.
"""

from collections.abc import Mapping, Sequence
from itertools import accumulate, chain, pairwise
from math import inf, isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rems_net.defdict import DefDict, Field, Schema
from rems_net.errors import ExperimentError, FieldValueError
from rems_net.gym.library import Box, Dict, Discrete, Space

Floats = NDArray[np.float64]


class Column(NamedTuple):
    """One field of a port. name: its key on the fabric, `robot/sim/state/x`."""

    name: str
    field: Field

    @property
    def is_real(self) -> bool:
        """Whether it is a number, or a row of numbers, that a Box of all may hold."""
        field = self.field
        return field.dtype in ("float", "f8", "f4") and len(field.shape) < 2

    @property
    def limits(self) -> tuple[float, float]:
        """The range; infinite without one."""
        return (-inf, inf) if self.field.range is None else self.field.range


class Layout:
    """The order of the fields of some ports, and their space.

    schemas: by key of the port.  normalise: numbers that have a range go from -1 to 1.
    acts: whether values go to the ports, so that every number needs a range then.
    """

    def __init__(
        self, schemas: Mapping[str, Schema], *, normalise: bool = False, acts: bool
    ):
        self.schemas, self.normalise = schemas, normalise
        self.columns = [
            Column(f"{key}/{path}", field)
            for key, schema in schemas.items()
            for path, field in schema.rows()
        ]
        for column in self.columns:
            _check(column, normalise and acts)
        self.units = {one.name: one.field.unit for one in self.columns}
        #: whether all of it is one Box
        self.flat = all(one.is_real for one in self.columns)
        counts = [len(schema.fields) for schema in schemas.values()]
        ends = [0, *accumulate(counts)]
        self.parts = [slice(a, b) for a, b in pairwise(ends)]
        self._around = [schema.around for schema in schemas.values()]
        self.plain = self.flat and not any(one.field.shape for one in self.columns)
        low, high = self._bounds()
        self._low, self._high = low.tolist(), high.tolist()
        ranged = np.isfinite(low) & np.isfinite(high) & normalise
        #: value = middle + half * what the space has
        least, most = np.where(ranged, low, -1.0), np.where(ranged, high, 1.0)
        self.middle, self.half = least / 2 + most / 2, most / 2 - least / 2
        self.ends, self._shape = (low, high), low.shape
        #: numbers of the default values, if all are numbers
        rest = [one.field.default for one in self.columns if self.flat]
        self.rest = np.hstack([np.zeros(0), *rest])
        self.space: Space[Any] = self._space(ranged)

    def _bounds(self) -> tuple[Floats, Floats]:
        real = [one for one in self.columns if one.is_real and self.flat]
        sizes = [one.field.size for one in real]
        low = np.repeat([float(one.limits[0]) for one in real], sizes)
        high = np.repeat([float(one.limits[1]) for one in real], sizes)
        return low, high

    def _space(self, ranged: NDArray[np.bool_]) -> Space[Any]:
        if self.flat:
            low, high = self.ends
            one = np.ones(len(low))
            return Box(
                np.where(ranged, -one, low),
                np.where(ranged, one, high),
                dtype=np.float64,
            )
        spaces = {one.name: self._own(one) for one in self.columns}
        return Dict(spaces) if len(spaces) > 1 else next(iter(spaces.values()))

    def _own(self, column: Column) -> Space[Any]:
        field = column.field
        if field.dtype == "choice":
            return Discrete(len(field.choices))
        if field.dtype == "bool" and not field.shape:
            return Discrete(2)
        if field.dtype == "bool":
            return Box(0, 1, field.shape, np.int8)
        if field.whole:
            kind: Any = field.dtype if field.shape else np.int64
            low, high = field.limits
            return Box(low, high, field.shape, kind)
        if self.normalise and field.range is not None:
            return Box(-1.0, 1.0, field.shape, np.float64)
        return Box(*column.limits, field.shape, np.float64)

    # -- from ports to the space ---------------------------------------------------

    def read(self, values: Sequence[list[Any]]) -> Any:
        """Return what the space has of the leaves of each port."""
        leaves = values[0] if len(values) == 1 else [*chain.from_iterable(values)]
        if self.plain:
            return self.scaled(np.array(leaves))
        if self.flat:
            return self.scaled(np.concatenate([np.ravel(one) for one in leaves]))
        pairs = zip(self.columns, leaves, strict=True)
        shown = {one.name: self._shown(one, leaf) for one, leaf in pairs}
        return shown if isinstance(self.space, Dict) else next(iter(shown.values()))

    def scaled(self, numbers: Floats) -> Floats:
        """Return numbers of all columns, the last axis, as the space has them."""
        return (numbers - self.middle) / self.half if self.normalise else numbers

    def _shown(self, column: Column, leaf: Any) -> Any:
        field = column.field
        if field.dtype == "choice":
            return np.int64(field.choices.index(leaf))
        if field.dtype == "bool":
            return np.asarray(leaf, np.int8) if field.shape else np.int64(leaf)
        if field.whole:
            return np.asarray(leaf, None if field.shape else np.int64)
        number = np.asarray(leaf, np.float64)
        if self.normalise and field.range is not None:
            low, high = field.range
            number = (number - (low + high) / 2) / ((high - low) / 2)
        return np.asarray(number)

    # -- from the space to ports ---------------------------------------------------

    def take(self, action: Any, *, clip: bool = False) -> list[DefDict]:
        """Return a value of each port. Raises FieldValueError for what does not fit."""
        if not self.flat:
            return self._parted(self._taken(action, clip))
        numbers: list[float] = self._array(action, self._shape, clip).tolist()
        for number, low, high in zip(numbers, self._low, self._high, strict=True):
            if not low <= number <= high:
                raise self._outside(numbers)
        return self.grouped(numbers)

    def many(self, actions: Any, count: int, *, clip: bool = False) -> Floats:
        """Return the numbers of many actions: (count, numbers), in the fields' units.

        Raises FieldValueError for one that does not fit.
        """
        array = self._array(actions, (count, *self._shape), clip)
        low, high = self.ends
        fits = (array >= low) & (array <= high)
        if not fits.all():
            raise self._outside(array[int(np.argmin(fits.all(axis=1)))].tolist())
        return array

    def grouped(self, numbers: list[float]) -> list[DefDict]:
        """Return a value of each port from the numbers of one Box, in their range."""
        return self._parted(numbers if self.plain else self._shaped(numbers))

    def _parted(self, leaves: list[Any]) -> list[DefDict]:
        if len(self.parts) == 1:
            return [self._around[0](leaves)]
        made = zip(self._around, self.parts, strict=True)
        return [around(leaves[part]) for around, part in made]

    def _array(self, action: Any, shape: tuple[int, ...], clip: bool) -> Floats:
        """Return numbers in the fields' units. Raises FieldValueError for a shape."""
        try:
            array = np.asarray(action, np.float64)
        except (ArithmeticError, TypeError, ValueError):  # a text, a ragged list
            array = np.empty(())
        if array.shape != shape:
            names = [one.name for one in self.columns]
            raise FieldValueError(
                f"the action has the shape {array.shape}; expected {shape}, a number "
                f"for each of {', '.join(names)}. (R0922)"
            )
        if self.normalise:
            array = self.middle + self.half * array
        return array.clip(*self.ends) if clip else array

    def _shaped(self, numbers: list[float]) -> list[Any]:
        leaves, place = list[Any](), 0
        for column in self.columns:
            size, shape = column.field.size, column.field.shape
            part = numbers[place : place + size]
            leaf = np.array(part, column.field.element).reshape(shape)
            leaf.flags.writeable = False
            leaves.append(leaf if shape else part[0])
            place += size
        return leaves

    def _taken(self, action: Any, clip: bool) -> list[Any]:
        one = not isinstance(self.space, Dict)
        given = {self.columns[0].name: action} if one else action
        names = [column.name for column in self.columns]
        if not isinstance(given, Mapping) or {*given} != {*names}:
            raise FieldValueError(
                f"the action is {action!r:.80}; expected a dict with a value for each "
                f"of {', '.join(names)}. (R0924)"
            )
        return [self._leaf(column, given[column.name], clip) for column in self.columns]

    def _leaf(self, column: Column, given: Any, clip: bool) -> Any:
        field, name = column.field, column.name
        given = given.item() if getattr(given, "shape", None) == () else given
        if field.dtype in ("choice", "bool") and not field.shape:
            names = field.choices or ("False", "True")
            if type(given) not in (int, bool) or not 0 <= given < len(names):
                raise FieldValueError(
                    f"{name} of the action is {given!r:.40}; expected a whole number "
                    f"from 0 to {len(names) - 1}, which stands for {', '.join(names)}."
                    " (R0924)"
                )
            return field.choices[given] if field.choices else bool(given)
        if self.normalise and not field.whole and field.range is not None:
            low, high = field.range
            given = (low + high) / 2 + (high - low) / 2 * np.asarray(given)
            given = given.item() if given.shape == () else given
        schema = Schema("action", {name: field})
        value = schema()
        if clip:
            value.clip({name: given})
        else:
            value[name] = given
        return value.leaves()[0]

    def _outside(self, numbers: list[float]) -> FieldValueError:
        names = [one.name for one in self.columns for _ in range(one.field.size)]
        rows = zip(names, numbers, self._low, self._high, strict=True)
        name, number, low, high = next(
            row for row in rows if not row[2] <= row[1] <= row[3]
        )
        unit = self.units.get(name, "")
        came = f"{number:g} {unit}".strip()
        more = "To limit it, make the environment with clip=True."
        if not isfinite(number):
            more = "Does the policy divide by 0, or learn too fast?"
        wanted = f"{low:g} to {high:g} {unit}".strip()
        return FieldValueError(
            f"{name} of the action is {came}; expected {wanted}. {more} (R0923)"
        )


def _check(column: Column, needs_range: bool) -> None:
    """Raise ExperimentError for a field that no space can hold."""
    name, field = column
    if field.dtype in ("str", "bytes", "list"):
        kind = {"str": "text", "bytes": "bytes", "list": "a list"}[field.dtype]
        raise ExperimentError(
            f"{name} is {kind}, and an environment takes numbers, choices and "
            "booleans: leave its port out, or write a process that makes numbers of "
            "it. (R0921)"
        )
    if needs_range and field.numeric and field.range is None and not field.whole:
        raise ExperimentError(
            f"{name} has no range, so normalise=True cannot make -1 to 1 of it: give "
            "the field a range in the definition, or leave normalise out. (R0921)"
        )
