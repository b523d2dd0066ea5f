"""Makers: functions that make fields, one for each quantity.

    length("mm", range=(0, 500), default=20, doc="how far the tail reaches")
    angular_velocity("rad/s", range=(-8, 8))

Each takes a unit of its own kind and refuses any other. To specialise one, write one
line: `wheel_speed = partial(angular_velocity, "rad/s", range=(-6.8, 6.8))`.
"""

from collections.abc import Callable, Iterable
from functools import update_wrapper
from typing import TYPE_CHECKING, Any, Generic, NoReturn, ParamSpec, Protocol

from rems_net.arguments import taught
from rems_net.defdict.fields.field import Field
from rems_net.defdict.fields.kind import Function
from rems_net.defdict.units.table import DIMENSIONS
from rems_net.defdict.units.unit import find_unit
from rems_net.errors import SchemaError, UnitError
from rems_net.packing import pack

if TYPE_CHECKING:
    from rems_net.defdict.schema import Schema  # the items of a list have a schema

Range = tuple[Any, Any] | None
P = ParamSpec("P")
_MOST = 4096  # fields that a maker remembers
#: Frequent wrong names of arguments, and the right ones.
_MEANT = {
    "min": "range=(0, 10)",
    "max": "range=(0, 10)",
    "limits": "range=(0, 10)",
    "value": "default=",
    "initial": "default=",
    "units": "unit=",
    "description": "doc=",
    "size": "shape=",
}


class Maker(Generic[P]):
    """A function that makes fields; the same arguments give the same field."""

    __name__: str

    def __init__(self, function: Callable[P, Field]) -> None:
        self._function = taught(SchemaError, **_MEANT)(function)
        self._made: dict[bytes, Field] = {}
        update_wrapper(self, function)

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> Field:
        try:
            # Equal bytes are equal arguments: 1 and True differ, and 0.0 and -0.0.
            key = pack((args, kwargs))
            found = self._made.get(key)
        except (TypeError, ValueError, OverflowError):
            key, found = b"", None  # a schema, a function, a quantity: not remembered
        if found is None:
            found = self._function(*args, **kwargs)
            if 0 < len(key) < 256 and len(self._made) < _MOST:
                self._made[key] = found
        return found

    def __mul__(self, other: object) -> NoReturn:
        unit = self.__name__ if self.__name__ in ("percent", "count") else "cm"
        raise UnitError(
            f"{self.__name__}() makes a field. To calculate with a unit, take one "
            f"of rems_net.units: from rems_net.units import {unit} (R0112)"
        )

    __rmul__ = __truediv__ = __rtruediv__ = __mul__

    def __get__(self, owner: object, kind: object = None) -> "Maker[P]":
        return self  # functions have it, too: so help() shows the arguments

    def __repr__(self) -> str:
        return f"<{self.__name__}(), which makes a field>"


class Measure(Protocol):
    """A maker of fields that measure one quantity."""

    def __call__(
        self,
        unit: str = ...,
        *,
        range: Range = None,
        default: Any = None,
        shape: int | tuple[int, ...] = (),
        dtype: str | None = None,
        max_age: float | None = None,
        doc: str = "",
    ) -> Field: ...


def measure(measures: str, si: str) -> Measure:
    """Return the maker of fields for one quantity; the default unit is SI."""
    name = measures.replace(" ", "_")

    def make(
        unit: str = si,
        *,
        range: Range = None,
        default: Any = None,
        shape: int | tuple[int, ...] = (),
        dtype: str | None = None,
        max_age: float | None = None,
        doc: str = "",
    ) -> Field:
        found = find_unit(unit)
        if found.dimension != DIMENSIONS[measures] or found.relative:
            raise UnitError(
                f"{name}() takes a unit such as {si!r}; "
                f"{unit!r} is a unit of {found.measures}. (R0102)"
            )
        size = _shape(shape)
        if dtype and not size:
            raise SchemaError(
                f"{name}(dtype={dtype!r}) is one float of any dtype; for an "
                f"array of them give shape=. (R0112)"
            )
        kind = (dtype or "f8") if size else "float"
        return Field(kind, unit, range, default, size, max_age, doc=doc)

    make.__name__ = make.__qualname__ = name
    make.__doc__ = f"Make a field that holds {measures}, by default in {si}."
    return Maker(make)


def _shape(shape: int | tuple[int, ...]) -> tuple[int, ...]:
    return (shape,) if isinstance(shape, int) else tuple(shape)


length = measure("length", "m")
angle = measure("angle", "rad")
velocity = measure("velocity", "m/s")
angular_velocity = measure("angular velocity", "rad/s")
acceleration = measure("acceleration", "m/s**2")
angular_acceleration = measure("angular acceleration", "rad/s**2")
mass = measure("mass", "kg")
time = measure("time", "s")
frequency = measure("frequency", "Hz")
force = measure("force", "N")
torque = measure("torque", "N*m")
power = measure("power", "W")
voltage = measure("voltage", "V")
current = measure("current", "A")
resistance = measure("resistance", "ohm")
temperature = measure("temperature", "degC")
pressure = measure("pressure", "Pa")
magnetic_field = measure("magnetic field", "T")
charge = measure("charge", "A*s")


@Maker
def number(
    unit: str = "",
    *,
    range: Range = None,
    default: Any = None,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds a float: a plain number, or a number in any unit."""
    return Field("float", unit, range, default, (), max_age, doc=doc)


@Maker
def percent(
    *,
    range: Range = (-100, 100),
    default: Any = None,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds a percentage of the range it is converted to."""
    return Field("float", "percent", range, default, (), max_age, doc=doc)


@Maker
def ratio(
    *,
    range: Range = (-1, 1),
    default: Any = None,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds a share (-1 to 1, or 0 to 1) of another range."""
    return Field("float", "ratio", range, default, (), max_age, doc=doc)


@Maker
def count(
    *,
    range: Range = None,
    table: Iterable[tuple[float, float]] = (),
    functions: tuple[Function, Function] | None = None,
    means: str = "",
    default: Any = None,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds the count of a device: a whole number.

    Without a map, its range stands for the range of the other end. A `table` of (count,
    value) pairs, or two `functions` (count to value, value to count), map a count to a
    value in the unit `means`. Between the points of a table the map is linear; a count
    beyond its ends is refused.
    """
    pairs = tuple(table)
    if means and not (pairs or functions):
        raise SchemaError(
            f"count(means={means!r}) needs table= or functions= to name what a count "
            "is. (R0111)"
        )
    if pairs and functions:
        raise SchemaError("a count has a table or functions, not both. (R0111)")
    return Field(
        "int",
        "count",
        range,
        default,
        (),
        max_age,
        table=pairs,
        functions=functions,
        means=means,
        doc=doc,
    )


@Maker
def integer(
    *,
    range: Range = None,
    default: int | None = None,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds a whole number of 64 bits."""
    return Field("int", "", range, default, (), max_age, doc=doc)


@Maker
def boolean(
    *, default: bool = False, max_age: float | None = None, doc: str = ""
) -> Field:
    """Make a field that holds True or False."""
    return Field("bool", default=default, max_age=max_age, doc=doc)


@Maker
def text(
    *,
    default: str = "",
    max_len: int = 256,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds text of at most `max_len` bytes of UTF-8."""
    return Field("str", default=default, max_len=max_len, max_age=max_age, doc=doc)


@Maker
def blob(
    *,
    default: bytes = b"",
    max_len: int = 65536,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds bytes."""
    return Field("bytes", default=default, max_len=max_len, max_age=max_age, doc=doc)


@Maker
def choice(
    *names: str,
    default: str | None = None,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds one of a few names; the name itself is sent."""
    return Field("choice", default=default, choices=names, max_age=max_age, doc=doc)


@Maker
def array(
    shape: int | tuple[int, ...],
    unit: str = "",
    *,
    dtype: str = "f8",
    range: Range = None,
    default: Any = None,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds a numpy array of fixed shape.

    `dtype` is f8, f4, i1, i2, i4, i8, u1, u2, u4, u8 or bool.
    """
    return Field(dtype, unit, range, default, _shape(shape), max_age, doc=doc)


@Maker
def many(item: "Schema", *, max_len: int = 64, doc: str = "") -> Field:
    """Make a field that holds a list of values of one schema, `max_len` at most."""
    return Field("list", item=item, max_len=max_len, doc=doc)
