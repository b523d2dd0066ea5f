"""Kind: properties of a value: its type, unit, range and shape. Nothing is checked.

A `Field` is a Kind that was checked, with a default that it accepts itself.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rems_net.defdict.units.table import RELATIVE

if TYPE_CHECKING:
    from rems_net.defdict.schema import Schema  # the items of a list have a schema

Table = tuple[tuple[float, float], ...]
Function = Callable[[float], float]

SCALARS = ("float", "int", "bool", "str", "bytes", "choice", "list")
ARRAYS = ("f8", "f4", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "bool")
INT_MIN, INT_MAX = -(2**63), 2**63 - 1
FLOAT_MAX, FLOAT32_MAX = 1.7976931348623157e308, 3.4028234663852886e38
MAX_BYTES = 1 << 20


@dataclass(frozen=True, slots=True, eq=False)
class Kind:
    """Properties of a field.

    `dtype` is float, int, bool, str, bytes, choice or list; for an array (`shape` is
    not empty) it is the numpy type of its elements, such as f8 or u1. `range` is
    inclusive and in `unit`. `max_age` is in seconds. `table` and `functions` map a
    count to a value in the unit `means`.
    """

    dtype: str = "float"
    unit: str = ""
    range: tuple[float, float] | None = None
    default: Any = None
    shape: tuple[int, ...] = ()
    max_age: float | None = None
    choices: tuple[str, ...] = ()
    table: Table = ()
    means: str = ""
    functions: tuple[Function, Function] | None = None
    max_len: int = 256
    item: "Schema | None" = None
    doc: str = ""

    @property
    def numeric(self) -> bool:
        """Whether the field holds numbers (that may have a unit and a range)."""
        return self.dtype in ("float", "int") or (
            bool(self.shape) and self.dtype != "bool"
        )

    @property
    def whole(self) -> bool:
        """Whether the field holds whole numbers."""
        return self.dtype == "int" or self.dtype[0] in "iu"

    @property
    def size(self) -> int:
        """The number of elements: 1 for a scalar."""
        return math.prod(self.shape)

    @property
    def limits(self) -> tuple[float, float]:
        """The range, or the limits of the type itself."""
        return self.type_limits if self.range is None else self.range

    @property
    def type_limits(self) -> tuple[float, float]:
        """The smallest and the largest value of the type."""
        if self.shape and self.whole:
            info = np.iinfo(self.dtype)
            return int(info.min), int(info.max)
        if self.dtype == "int":
            return INT_MIN, INT_MAX
        most = FLOAT32_MAX if self.dtype == "f4" else FLOAT_MAX
        return -most, most

    @property
    def relative(self) -> bool:
        """Whether a value stands for a place in a range (and has no table)."""
        return self.unit in RELATIVE and not self.table and self.functions is None

    def describe_type(self) -> str:
        """Return the type in a few words: "float", "f8[3]", "choice"."""
        if self.shape:
            return f"{self.dtype}[{', '.join(map(str, self.shape))}]"
        return self.dtype

    @property
    def element(self) -> np.dtype[Any]:
        """The type of an array's elements, as they are stored and sent."""
        return np.dtype(self.dtype).newbyteorder("<")

    @property
    def zero(self) -> Any:
        """The default if none is given: the value nearest to 0, or the first choice."""
        if self.numeric or self.shape:
            low, high = self.limits if self.numeric else (0, 0)
            value = min(max(0, low), high)
            return np.full(self.shape, value, dtype=self.dtype) if self.shape else value
        if self.dtype == "choice":
            return self.choices[0]
        return {"bool": False, "str": "", "bytes": b"", "list": ()}[self.dtype]
