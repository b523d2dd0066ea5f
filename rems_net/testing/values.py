"""Values: test commands for a robot, and how much its state changes."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rems_net.agents.robot import Robot
from rems_net.defdict import DefDict, Field, Schema

Array = NDArray[np.float64]
Numbers = Mapping[str, Array]
#: One number of each field, by path.
Values = Mapping[str, float]

#: Ratio. How far a command goes from the safe one to the end of its range.
WELL, SLOW = 0.5, 0.1
#: Ratio. Every other field of a medley goes only this part of that way.
LESS = 0.6


def numbers(value: DefDict) -> dict[str, Array]:
    """Return its numbers by path, including whole numbers and switches."""
    rows = zip(value.schema.paths, value.schema.fields, value.leaves(), strict=True)
    return {
        path: np.array(leaf, dtype=np.float64).ravel()
        for path, field, leaf in rows
        if field.numeric or field.dtype == "bool"
    }


def apart(one: Numbers, other: Numbers) -> dict[str, float]:
    """Return by how much two values differ, by path."""
    return {path: float(np.abs(other[path] - one[path]).max()) for path in one}


def most(differences: Values) -> tuple[str, float]:
    """Return the path with the largest difference, and that difference."""
    path = max(differences, key=lambda one: differences[one], default="")
    return path, differences.get(path, 0.0)


def differs(schema: Schema, one: Any, other: Any) -> tuple[str, float]:
    """Return the field in which two values of a schema differ most, and by how much."""
    return most(apart(numbers(schema(one)), numbers(schema(other))))


def sweeps(schema: Schema, share: float) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield commands that together move every part: a name, and all values by path.

    Each field alone, all fields together, and every other field reversed if it can be.
    A field goes `share` of the way from the safe command to the end of its range. A
    ratio, such as how fast an arm goes to its targets, is set in all of them.
    """
    safe = schema().flat()
    ahead = {p: v for p, f in schema.rows() if (v := _towards(f, share)) is not None}
    ratios = {p: ahead[p] for p, f in schema.rows() if p in ahead and f.unit == "ratio"}
    alone = [p for p in ahead if p not in ratios] or [*ahead]
    if not alone:
        yield "nothing", safe
    for path in alone:
        yield path, safe | ratios | {path: ahead[path]}
    if len(alone) > 1:
        yield "all together", safe | ahead
        back = {p: _towards(f, share, back=True) for p, f in schema.rows()}
        every_other = [p for p in alone[1::2] if back[p] is not None]
        if every_other:
            yield (
                "every other one back",
                safe | ahead | {p: back[p] for p in every_other},
            )


def positions(robot: Robot) -> list[str]:
    """Return the paths of the state that its mathematics moves; all if it has none."""
    schemas = robot.schemas()
    state, command = schemas["state"], schemas["command"]
    words = robot.begins(), command()
    rates, advance = (getattr(robot, name, None) for name in ("derivative", "advance"))
    if not rates and not advance:
        return [*state.paths]
    moved = dict(rates(*words)) if rates else {}
    return [*(moved | dict(advance(*words, 0.0)) if advance else moved)]


def medley(robot: Robot, share: float) -> dict[str, Any]:
    """Return a command that moves every part; every other field goes less far.

    A base drives along an arc, so that both its place and its heading change.
    """
    schema = robot.schemas()["command"]
    found = schema().flat()
    for i, (path, field) in enumerate(schema.rows()):
        value = _towards(field, share * (LESS if i % 2 else 1.0))
        found[path] = found[path] if value is None else value
    return found


def together(schema: Schema, differences: Values) -> Values:
    """Return for each field the largest difference of all fields like it.

    Fields are alike if they have the same group and unit: x and y, wheels, joints.
    """
    alike = {path: (path.rpartition("/")[0], f.unit) for path, f in schema.rows()}
    largest: dict[tuple[str, str], float] = {}
    for path, by in differences.items():
        largest[alike[path]] = max(by, largest.get(alike[path], 0.0))
    return {path: largest[alike[path]] for path in differences}


def _towards(field: Field, share: float, *, back: bool = False) -> Any:
    """Return a value on the way to an end of the range; None if there is none.

    The end is the further one; with `back`, the other one.
    """
    if field.dtype == "bool" and not field.shape:
        return None if back else not field.default
    if field.dtype == "choice" and len(field.choices) > 1:
        others = [one for one in field.choices if one != field.default]
        return None if back else others[0]
    if not field.numeric:
        return None
    safe = np.array(field.default, dtype=np.float64)
    low, high = field.range or (safe.min() - 1.0, safe.max() + 1.0)
    up = high - safe.max() >= safe.min() - low
    end = high if up != back else low
    value = safe + share * (end - safe)
    if field.whole:
        step = 1 if end > safe.max() else -1
        value = np.where(np.rint(value) == safe, safe + step, np.rint(value))
    if np.array_equal(value, safe):
        return None
    if field.shape:
        return value.astype(field.dtype)
    return int(value) if field.whole else float(value)


def eased(schema: Schema, values: Mapping[str, Any], part: float) -> dict[str, Any]:
    """Return a command between the safe one (part = 0) and `values` (part = 1)."""
    eased = dict(values)
    for path, field in schema.rows():
        if field.dtype == "float" or field.dtype in ("f4", "f8"):
            safe = field.default
            value = safe + part * (np.asarray(values[path]) - safe)
            eased[path] = value.astype(field.dtype) if field.shape else float(value)
    return eased


def beyond(schema: Schema) -> Iterator[tuple[str, Any, str]]:
    """Yield commands that must be refused: path, value, and what is wrong with it."""
    first = True
    for path, field in schema.rows():
        if field.range is not None and not field.shape:
            low, high = field.range
            unit = f" {field.unit}" if field.unit else ""
            limits = f"its range is {low:g} to {high:g}{unit}"
            yield path, high + max(1.0, abs(high)), limits
        if field.numeric and not field.shape and first:
            first = False
            yield path, float("nan"), "it is no number"
            yield path, "hello", "it is text"
            yield path, None, "it is nothing"
    yield "no_such_field", 0.0, "there is no such field"
