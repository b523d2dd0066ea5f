"""Agreement: how far a robot goes from what its own mathematics says, in slow motion.

Both are told the same: each field of the command alone, all together, and every other
one back, at a tenth of its range, rising and falling slowly, for 2 s, or as long as
the definition says (`eases`). The error of a field is its greatest distance from the
model, as a share of the longest way that it, or one like it (x and y, all joints), goes
in any of these. The model is the kinematic driver, finely.
"""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rems_net.agents.robot import Robot
from rems_net.agents.wall import wall
from rems_net.defdict import Field, Schema
from rems_net.drivers.hardware.driven import Driven
from rems_net.errors import RemsError
from rems_net.testing.bench import Bench, WallBench
from rems_net.testing.subject import Subject
from rems_net.testing.values import (
    SLOW,
    Array,
    eased,
    numbers,
    positions,
    sweeps,
    together,
)

#: for the fields that a definition says nothing of
USUAL = 0.05
#: how long a manoeuvre is, by how long it begins, and ends
LASTS = 4.0
#: manoeuvres of a robot that is driven, and seconds in each: before, and watched
FEW, SETTLES, WATCHED = 2, 0.4, 1.0
#: how often a reading is looked for, at a time when no other one comes
LOOKS = 1000


@dataclass(frozen=True, slots=True)
class Agreement:
    """Where a robot was furthest from its model, by what its definition allows.

    error, allowed: shares of `scale`, the way that the model goes
    """

    error: float
    allowed: float
    field: str
    unit: str
    command: str
    after: float
    is_at: float
    should: float
    scale: float


@dataclass(frozen=True, slots=True)
class Way:
    """One manoeuvre: times (n,), and by field where both were, (n, size)."""

    command: str
    times: Array
    robot: Mapping[str, Array]
    model: Mapping[str, Array]


def measure(subject: Subject) -> tuple[Agreement | None, str]:
    """How far it is from its model; None, and why, where that cannot be said."""
    try:
        model = subject.model()
    except RemsError as error:
        reason = str(error).splitlines()[0].partition(" Write in ")[0]
        return None, f"there is no model to compare it with: {reason}"
    with model.opened("model") as reference, subject.opened("robot") as robot:
        moves = positions(reference)
        schema = reference.schemas()["state"]
        fields = {path: field for path, field in schema.rows() if path in moves}
        if isinstance(robot, Driven):
            ways = list(_in_wall_time(robot, reference, fields))
        else:
            eases = subject.definition.eases
            ways = list(_in_fabric_time(robot, reference, fields, eases))
        return _worst(subject, schema, fields, ways)


def _in_fabric_time(
    robot: Robot, model: Robot, fields: Mapping[str, Field], eases: float
) -> Iterator[Way]:
    schema, lasts = robot.schemas()["command"], LASTS * eases
    for name, values in sweeps(schema, SLOW):
        benches = Bench(robot), Bench(model)
        paths: list[list[Mapping[str, Array]]] = [[], []]
        times = []
        for _ in range(benches[0].count(lasts)):
            t = (benches[0].n + 0.5) * benches[0].dt
            part = min(1.0, t / eases, (lasts - t) / eases)
            times.append((benches[0].n + 1) * benches[0].dt)
            for one, path in zip(benches, paths, strict=True):
                one.step(eased(schema, values, part))
                path.append(one.numbers())
        for one in benches:
            one.robot.reset()
        yield Way(name, np.array(times), *(_columns(p, fields) for p in paths))


def _in_wall_time(
    robot: Driven, model: Robot, fields: Mapping[str, Field]
) -> Iterator[Way]:
    """From one reading to a later one the model is driven for just that long."""
    schema = robot.schemas()["command"]
    for name, values in list(sweeps(schema, SLOW))[-FEW:]:
        where = WallBench(robot)
        where.run(values, SETTLES)
        before, begun = _reading(robot, where)
        where.run(values, WATCHED)
        after, ended = _reading(robot, where)
        model.__dict__["state"].update(before)
        model.drive(schema(values), ended - begun)
        reached = numbers(model.__dict__["state"])
        start = numbers(robot.schemas()["state"](before))
        paths = ([start, numbers(robot.schemas()["state"](after))], [start, reached])
        yield Way(
            name, np.array([0.0, ended - begun]), *(_columns(p, fields) for p in paths)
        )


def _reading(robot: Driven, where: Bench) -> tuple[dict[str, Any], float]:
    """Where it is, and when that was read, in s of wall time."""
    for _ in range(LOOKS):
        before = wall() - robot.reading_age
        robot.sense()
        if abs(wall() - robot.reading_age - before) < 5e-4:
            return where.where(), before
        time.sleep(1e-3)
    raise TimeoutError("its device says nothing")


def _columns(
    path: Sequence[Mapping[str, Array]], fields: Mapping[str, Field]
) -> dict[str, Array]:
    return {name: np.array([one[name] for one in path]) for name in fields}


def _worst(
    subject: Subject, schema: Schema, fields: Mapping[str, Field], ways: list[Way]
) -> tuple[Agreement | None, str]:
    """The field that is furthest away, by what it may be."""
    gone = {
        path: max(float(np.ptp(way.model[path], axis=0).max()) for way in ways)
        for path in fields
    }
    scales = together(schema, gone)
    found = [
        _of(subject, way, path, field.unit, scales[path])
        for way in ways
        for path, field in fields.items()
        if scales[path] > 0
    ]
    if not found:
        return None, "nothing that its mathematics moves moves in slow motion"
    return max(found, key=lambda one: one.error / one.allowed), ""


def _of(subject: Subject, way: Way, path: str, unit: str, scale: float) -> Agreement:
    apart = np.abs(way.robot[path] - way.model[path])
    at, element = np.unravel_index(int(apart.argmax()), apart.shape)
    return Agreement(
        error=float(apart[at, element]) / scale,
        allowed=allowed(subject, path),
        field=path,
        unit=unit,
        command=way.command,
        after=float(way.times[at]),
        is_at=float(way.robot[path][at, element]),
        should=float(way.model[path][at, element]),
        scale=scale,
    )


def allowed(subject: Subject, path: str) -> float:
    """What the definition allows for a field, as a share of the way."""
    stated = subject.definition.tolerance
    if isinstance(stated, Mapping):
        return float(stated.get(path, USUAL))
    return float(stated)
