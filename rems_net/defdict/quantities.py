"""The ready-made quantities: functions that make fields.

    length("mm", range=(0, 500), default=20, doc="how far the tail reaches")
    angular_velocity("rad/s", range=(-8, 8))

Each takes a unit of its own kind and refuses any other. To specialise one, write
one line: `wheel_speed = partial(angular_velocity, "rad/s", range=(-6.8, 6.8))`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Protocol

from rems_net.defdict.field import Field, Function, check_measures
from rems_net.defdict.unit import DIMENSIONS
from rems_net.errors import SchemaError

if TYPE_CHECKING:
    from rems_net.defdict.schema import Schema

Range = tuple[Any, Any] | None


class Quantity(Protocol):
    """A function that makes a field of one kind of quantity."""

    def __call__(
        self,
        unit: str = ...,
        *,
        range: Range = None,
        default: Any = None,
        shape: tuple[int, ...] = (),
        dtype: str = "f8",
        max_age: float | None = None,
        doc: str = "",
    ) -> Field: ...


def quantity(measures: str, si: str) -> Quantity:
    """Return a function that makes fields of one quantity, SI unless told."""
    name = measures.replace(" ", "_")

    def make(
        unit: str = si,
        *,
        range: Range = None,
        default: Any = None,
        shape: tuple[int, ...] = (),
        dtype: str = "f8",
        max_age: float | None = None,
        doc: str = "",
    ) -> Field:
        check_measures(name, unit, DIMENSIONS[measures], si)
        kind = dtype if shape else "float"
        return Field(kind, unit, range, default, shape, max_age, doc=doc)

    make.__name__ = make.__qualname__ = name
    make.__doc__ = f"Make a field that holds {measures}, in {si} unless told."
    return make


length = quantity("length", "m")
angle = quantity("angle", "rad")
velocity = quantity("velocity", "m/s")
angular_velocity = quantity("angular velocity", "rad/s")
acceleration = quantity("acceleration", "m/s**2")
angular_acceleration = quantity("angular acceleration", "rad/s**2")
mass = quantity("mass", "kg")
time = quantity("time", "s")
frequency = quantity("frequency", "Hz")
force = quantity("force", "N")
torque = quantity("torque", "N*m")
power = quantity("power", "W")
voltage = quantity("voltage", "V")
current = quantity("current", "A")
resistance = quantity("resistance", "ohm")
temperature = quantity("temperature", "degC")
pressure = quantity("pressure", "Pa")
magnetic_field = quantity("magnetic field", "T")
charge = quantity("charge", "A*s")


def number(
    unit: str = "",
    *,
    range: Range = None,
    default: Any = None,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds a float: a plain number, or in any unit at all."""
    return Field("float", unit, range, default, (), max_age, doc=doc)


def percent(
    *,
    range: Range = (-100, 100),
    default: Any = None,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds a percentage of the range it is converted to."""
    return Field("float", "percent", range, default, (), max_age, doc=doc)


def ratio(
    *,
    range: Range = (-1, 1),
    default: Any = None,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds a share (-1 to 1, or 0 to 1) of another range."""
    return Field("float", "ratio", range, default, (), max_age, doc=doc)


def count(
    *,
    range: Range = None,
    table: Iterable[tuple[float, float]] = (),
    functions: tuple[Function, Function] | None = None,
    unit: str = "",
    default: Any = None,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds what a device counts: whole numbers.

    Alone, its range stands for the range of the other end. With a `table` of
    (count, value) pairs, or two `functions` (count to value, value to count), a
    count stands for a value in `unit`. Between the points of a table the map is
    straight; beyond its ends it is refused.
    """
    pairs = tuple(table)
    if unit and not (pairs or functions):
        raise SchemaError(
            f"count(unit={unit!r}) needs table= or functions= to say what a count is."
        )
    if pairs and functions:
        raise SchemaError("a count has a table or functions, not both.")
    return Field(
        "int",
        "count",
        range,
        default,
        (),
        max_age,
        table=pairs,
        functions=functions,
        means=unit,
        doc=doc,
    )


def integer(
    *,
    range: Range = None,
    default: int | None = None,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds a whole number of 64 bits."""
    return Field("int", "", range, default, (), max_age, doc=doc)


def boolean(
    *, default: bool = False, max_age: float | None = None, doc: str = ""
) -> Field:
    """Make a field that holds True or False."""
    return Field("bool", default=default, max_age=max_age, doc=doc)


def text(
    *,
    default: str = "",
    max_len: int = 256,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds text of at most `max_len` bytes of UTF-8."""
    return Field("str", default=default, max_len=max_len, max_age=max_age, doc=doc)


def blob(
    *,
    default: bytes = b"",
    max_len: int = 65536,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds bytes."""
    return Field("bytes", default=default, max_len=max_len, max_age=max_age, doc=doc)


def choice(
    *names: str,
    default: str | None = None,
    max_age: float | None = None,
    doc: str = "",
) -> Field:
    """Make a field that holds one of a few names; the name is what is sent."""
    return Field("choice", default=default, choices=names, max_age=max_age, doc=doc)


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
    size = (shape,) if isinstance(shape, int) else tuple(shape)
    return Field(dtype, unit, range, default, size, max_age, doc=doc)


def many(item: Schema, *, max_len: int = 64, doc: str = "") -> Field:
    """Make a field that holds a list of values of one schema, `max_len` at most."""
    return Field("list", item=item, max_len=max_len, doc=doc)
