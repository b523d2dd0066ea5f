"""Agreement: how far a robot strays from its own mathematics, in slow motion.

Robot and model receive the same commands: each field alone, all fields together, and
every other field reversed. A command goes to a tenth of its range, and rises and falls
slowly. A manoeuvre lasts four times `eases` of the definition: 2 s by default. The
error of a field is its greatest distance from the model, as a share of a scale. The
scale is the longest way of that field, or of a field like it (x and y, all joints), in
any manoeuvre. The model is the kinematic driver with fine steps.
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

#: Ratio. Tolerance of a field for which a definition states none.
USUAL = 0.05
#: Ratio. Length of a manoeuvre, in multiples of `eases`, the time of its rise.
LASTS = 4.0
#: A driven robot: number of manoeuvres; s before the first reading; s between readings.
FEW, SETTLES, WATCHED = 2, 0.4, 1.0
#: Attempts to read state and time without a newer reading coming in between.
LOOKS = 1000


@dataclass(frozen=True, slots=True)
class Agreement:
    """The field in which a robot is furthest from its model, relative to its tolerance.

    error, allowed: shares of `scale`, the longest way of the model
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
    """One manoeuvre: times (n,), and values of robot and model by field (n, size)."""

    command: str
    times: Array
    robot: Mapping[str, Array]
    model: Mapping[str, Array]


def measure(subject: Subject) -> tuple[Agreement | None, str]:
    """Return the worst deviation from the model; or None, and why there is none."""
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
    """Drive the model from one reading of the robot to the time of a later one."""
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
    """Return the position, and the wall time in s at which it was read."""
    for _ in range(LOOKS):
        before = wall() - robot.reading_age
        robot.sense()
        if abs(wall() - robot.reading_age - before) < 5e-4:
            return where.where(), before
        time.sleep(1e-3)
    raise TimeoutError("its device does not answer (R0701)")


def _columns(
    path: Sequence[Mapping[str, Array]], fields: Mapping[str, Field]
) -> dict[str, Array]:
    return {name: np.array([one[name] for one in path]) for name in fields}


def _worst(
    subject: Subject, schema: Schema, fields: Mapping[str, Field], ways: list[Way]
) -> tuple[Agreement | None, str]:
    """Return the field with the largest ratio of error to tolerance."""
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
    """Return the tolerance of a field, as a share of its scale."""
    stated = subject.definition.tolerance
    if isinstance(stated, Mapping):
        return float(stated.get(path, USUAL))
    return float(stated)
