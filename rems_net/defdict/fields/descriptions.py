"""Descriptions: a field, and a value for it, in error messages."""

import sys

import numpy as np

from rems_net.defdict.fields.kind import Kind
from rems_net.defdict.units.maps import unit_map
from rems_net.errors import FieldValueError

_KINDS = {
    "float": "a number",
    "int": "a whole number",
    "bool": "True or False",
    "str": "text",
    "bytes": "bytes",
}


#: Unit -> other units that people use for the same.
_OTHERS = {
    "m": ("mm", "cm"),
    "m/s": ("mm/s", "cm/s"),
    "rad": ("deg",),
    "rad/s": ("deg/s", "rpm"),
    "s": ("ms",),
    "kg": ("g",),
    "V": ("mV",),
    "A": ("mA",),
    "N": ("mN",),
    "N*m": ("mN*m",),
    "T": ("mT", "uT"),
}


def perhaps(field: Kind, number: float) -> str:
    """Return a hint at a unit in which a number far out of range would fit, or ""."""
    low, high = field.limits
    if field.range is not None and abs(number) > 10 * max(abs(low), abs(high)):
        for unit in _OTHERS.get(field.unit, ()):
            if low <= unit_map(unit, field.unit)(number) <= high:
                return f' Did you mean "{number:g} {unit}"?'
    return ""


def _limits(field: Kind) -> str:
    if field.range is None:
        return ""
    return f" from {field.range[0]:.10g} to {field.range[1]:.10g}"


def expected(field: Kind) -> str:
    """Return the values that the field takes, as the object of a sentence."""
    unit = f" in {field.unit}" if field.unit else ""
    if field.shape:
        shape = " x ".join(map(str, field.shape))
        kind = _KINDS.get(field.dtype, "numbers")
        return f"an array of {shape} {kind}{unit}{_limits(field)}"
    if field.dtype == "choice":
        return f"one of {', '.join(map(repr, field.choices))}"
    if field.dtype == "list" and field.item is not None:
        return f"a list of at most {field.max_len} {field.item.name}"
    if field.dtype in ("str", "bytes"):
        return f"{_KINDS[field.dtype]} of at most {field.max_len} bytes"
    return f"{_KINDS[field.dtype]}{unit}{_limits(field)}"


def is_quantity(value: object) -> bool:
    """Return whether the value is a quantity of unyt; does not import unyt."""
    unyt = sys.modules.get("unyt")
    return hasattr(type(value), "is_Unit") or (
        unyt is not None and isinstance(value, unyt.unyt_array)
    )


def show(value: object) -> str:
    """Return a short text for a value."""
    text = str(value) if is_quantity(value) else repr(value)
    if isinstance(value, np.ndarray) and value.ndim:
        text = f"an array of shape {value.shape}"
    return text if len(text) <= 60 else f"{text[:57]}..."


def refuse(field: Kind, where: str, got: object, hint: str = "") -> FieldValueError:
    """Return the error for a value that the field refuses."""
    return FieldValueError(
        f"{where} expects {expected(field)}, but got {show(got)}.{hint} (R0101)"
    )


def definition(field: Kind) -> str:
    """Return the definition: type or unit, range, choices, default, max_age."""
    text = f"{field.unit or field.describe_type()}{_limits(field)}"
    if field.choices:
        text += f" of {', '.join(field.choices)}"
    if not field.shape and field.default:
        text += f" (default {field.default!r})"
    if field.max_age is not None:
        text += f" (max_age {field.max_age:g} s)"
    return text


def in_brief(field: Kind) -> str:
    """Return type, unit and range of a field in a few characters."""
    words = [field.unit or field.describe_type()]
    if field.shape and field.unit:
        words.append(field.describe_type())
    if field.means:
        words.append(f"of {field.means}")
    if field.range:
        words.append(f"{field.range[0]:g}..{field.range[1]:g}")
    return " ".join(words)
