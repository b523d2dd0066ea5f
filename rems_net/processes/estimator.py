"""Estimator: where a robot is, from its commands, its sensors and its definition.

The belief is a mean and a root of the covariance, of the state and of the constant
offsets of its sensors. A step adds the errors of the commands, moves all by the
definition's own `derivative`, and compares the sensors with its own `measure`: so a
gyroscope shows how far the wheels really turned. No Jacobian is written by hand.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import sqrt
from typing import Any, ClassVar

import numpy as np

from rems_net.agents.agent import Process
from rems_net.agents.ports import In, Out, Settings
from rems_net.agents.table import table
from rems_net.agents.tick import Tick
from rems_net.bodies.noise import Noise
from rems_net.defdict import (
    Field,
    Schema,
    number,
    parse_quantity,
    ratio,
    text,
)
from rems_net.drivers.kinematic.correction import limits
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.errors import ExperimentError, nearest
from rems_net.maths.ukf import Floats, Moments, points, predicted, product, updated
from rems_net.processes.model import model_of
from rems_net.processes.motion import Motion
from rems_net.processes.turns import Turns

#: Least variance of a reading, in its unit: with 0 nothing could be divided by it.
LEAST = 1e-18


class Estimator(Process):
    """Base of filters that estimate a robot's state: `ekf` and `ukf`.

    command: what the robot was commanded      sensors: its readings
    state: the estimate, as the definition has it      deviation: standard deviation of
    each field, in its unit      covariance: of each pair of fields, such as m*rad
    """

    #: distance of the sigma points, as a share of the usual one
    alpha: ClassVar[float] = 1.0

    options = Settings(
        definition=text(doc="of the robot: woodbot, or my.py:Cart"),
        parameters=text(max_len=4096, doc='of it: track = "100 mm", or a file'),
        initial=text(max_len=4096, doc='where it starts: x = "10 cm"'),
        unsure=text(max_len=4096, doc='standard deviation of that: x = "5 mm"'),
        slip=ratio(default=0.03, range=(0, 1), doc="error of a command, in each step"),
        drift=text(max_len=4096, doc='error besides, in 1 s: heading = "1 deg"'),
        noise=text(max_len=4096, doc="of sensors, if not as defined: gyro/z = 0.01"),
    )
    command = In()
    sensors = In()
    state = Out()
    deviation = Out()
    covariance = Out()

    def prepare(self) -> None:
        """Build the definition, and settle the Outs. Raises ExperimentError."""
        super().prepare()
        self.model = robot = self._built()
        schema = robot.state.schema
        self._paths = [path for path, one in schema.rows()]
        rows = {**dict(robot.command.schema.rows()), **dict(schema.rows())}
        if odd := [path for path, one in rows.items() if _odd(one)]:
            raise ExperimentError(
                f"{odd[0]!r} of {self.options.definition} is no single number, which "
                "an estimator needs; give it a definition without that field. (R0881)"
            )
        self.settle("state", schema)
        units = {path: number(one.unit) for path, one in schema.rows()}
        self.settle("deviation", Schema("estimate.deviation", units))
        self.settle("covariance", Schema("estimate.covariance", _pairs(schema)))
        self._noises = self._noise()
        self._used = [*self._noises]
        self._settings()

    def _built(self) -> Kinematic:
        name, robot = self.options.definition, model_of(self)
        if robot.read is None:
            raise ExperimentError(
                f"{name} has no sensors, so nothing corrects an estimate; give its "
                "definition `sensors`, `measure` and `noise`. (R0881)"
            )
        return robot

    def _noise(self) -> dict[str, Noise]:
        """Return the noise of each sensor that has some; others are not used."""
        robot, given = self.model, table(self.options.noise, "noise")
        stated = robot.noises()
        schema = robot.sensors.schema
        found: dict[str, Noise] = {}
        for glob, one in stated.items():
            found |= dict.fromkeys(schema.slice(glob).paths, one)
        for path, value in given.items():
            unit = _field(schema, path, "noise").unit
            size = parse_quantity(value, unit, f"the noise of {path!r}")
            found[path] = Noise(absolute=size)
        assert robot.read is not None
        computed = robot.read(robot.state, robot.command)
        usable = {
            path: found[path]
            for path, one in schema.rows()
            if found.get(path, Noise()) != Noise() and path in computed
            if not _odd(one)
        }
        if not usable:
            raise ExperimentError(
                f"{self.options.definition} does not state how noisy its sensors are, "
                'and no option does; write such as options={"noise": '
                f"'{schema.paths[0]} = 0.01'}}. (R0881)"
            )
        return usable

    def _settings(self) -> None:
        """Begin with the belief that the options state."""
        schema, names = self.model.state.schema, ("initial", "unsure", "drift")
        first, unsure, drift = (
            self._numbers(schema, table(getattr(self.options, name), name), name)
            for name in names
        )
        offsets = [path for path in self._used if self._noises[path].bias]
        self._offsets = [self._used.index(path) for path in offsets]
        # An offset is anywhere between its limits: the deviation of such a value.
        biases = [self._noises[path].bias / sqrt(3) for path in offsets]
        self._mean = np.array([*first, *(0.0 for _ in offsets)])
        self._root = np.diag([*unsure, *biases])
        commands = len(self.model.command.schema.paths)
        rest = np.zeros(len(offsets) + commands)
        self._drift = np.diag(np.array([*drift, *rest]) ** 2)
        turns = Turns(self._fields(schema, self._paths))
        self._turns = turns.extended(len(rest))
        self._sensed = Turns(self._fields(self.model.sensors.schema, self._used))
        self._old: list[float] = []

    def _numbers(
        self, schema: Schema, given: Mapping[str, Any], name: str
    ) -> list[float]:
        for path in given:
            _field(schema, path, name)
        value = {
            path: parse_quantity(given[path], one.unit, f"{name} of {path!r}")
            for path, one in schema.rows()
            if path in given
        }
        default = schema({}).flat() if name == "initial" else {}
        return [value.get(path, default.get(path, 0.0)) for path in self._paths]

    def _fields(self, schema: Schema, paths: list[str]) -> list[Field]:
        fields = dict(schema.rows())
        return [fields[path] for path in paths]

    def open(self) -> None:
        """Prepare to integrate many states at once."""
        self._motion = Motion(self.model, self._used)
        self._ranges = limits(self.command.schema)

    def step(self, tick: Tick) -> None:
        """Predict with the command, correct with the sensors, and publish."""
        command = self._command()
        self._predict(command, tick.dt)
        readings = [float(self.sensors[path]) for path in self._used]
        if readings != self._old:  # the same numbers again are an old reading
            self._correct(command, np.array(readings))
        count = self._count
        self._mean, self._root, self._old = (
            self._mean[:count],
            self._root[:count],
            readings,
        )
        self._publish()

    @property
    def _count(self) -> int:
        return len(self._paths) + len(self._offsets)

    def _command(self) -> Floats:
        """Return the command: the same shares of the limits as the robot's."""
        ours = limits(self.model.command.schema)
        return np.array(
            [
                float(self.command[p]) / self._ranges[p] * most
                for p, most in ours.items()
            ]
        )

    # -- the belief ----------------------------------------------------------------

    def moments(self, values: Floats, less: Callable[[Any, Any], Any]) -> Moments:
        """Return the moments of values at the sigma points."""
        raise NotImplementedError

    def _predict(self, command: Floats, dt: float) -> None:
        errors = np.diag(float(self.options.slip) * np.abs(command))
        (n, k), m = self._root.shape, len(command)
        root = np.zeros((n + m, k + m))
        root[:n, :k], root[n:, k:] = self._root, errors
        mean = np.concatenate([self._mean, np.zeros(m)])
        spots = points(mean, root, self.alpha)
        moved = spots.copy()
        moved[:, : len(self._paths)] = self._motion.moved(spots, command, dt)
        found = self.moments(moved, self._turns.less)
        self._mean, self._root = predicted(found, self._drift * dt)

    def _correct(self, command: Floats, readings: Floats) -> None:
        spots = points(self._mean, self._root, self.alpha)
        values = self._motion.read(spots, command)
        first = len(self._paths)
        for i, column in enumerate(self._offsets):
            values[:, column] += spots[:, first + i]
        found = self.moments(values, self._sensed.less)
        noise = np.diag(
            [
                _variance(self._noises[path], float(value))
                for path, value in zip(self._used, found.mean, strict=True)
            ]
        )
        off = self._sensed.less(readings, found.mean)
        self._mean, self._root = updated(self._mean, self._root, found, off, noise)

    def _publish(self) -> None:
        count = len(self._paths)
        mean = self._turns.wrapped(self._mean)[:count].tolist()
        self.state.clip(dict(zip(self._paths, mean, strict=True)))
        covariance = product(self._root, self._root.T)[:count, :count]
        spread = np.sqrt(np.maximum(np.diag(covariance), 0.0)).tolist()
        self.deviation = dict(zip(self._paths, spread, strict=True))
        upper = covariance[np.triu_indices(count)].tolist()
        pairs = self.covariance.schema.paths
        self.covariance = dict(zip(pairs, upper, strict=True))


def _variance(noise: Noise, value: float) -> float:
    """Return the variance of a reading; a value that is rounded to a step has some."""
    return float(max(noise.spread(value) ** 2 + noise.step**2 / 12, LEAST))


def _odd(field: Field) -> bool:
    return bool(field.shape) or field.dtype != "float"


def _pairs(schema: Schema) -> dict[str, Field]:
    """Return a field for each pair of fields, in its unit: "x/heading" in m*rad."""
    rows = list(schema.rows())
    found = {}
    for i, (path, one) in enumerate(rows):
        for other, two in rows[i:]:
            found[f"{path}/{other}"] = number(_product(one.unit, two.unit))
    return found


def _product(a: str, b: str) -> str:
    """Return the unit of a product: m**2, m*rad."""
    if a == b:
        return a and (f"{a}**2" if a.isalpha() else f"({a})**2")
    return "*".join(unit if unit.isalpha() else f"({unit})" for unit in (a, b) if unit)


def _field(schema: Schema, path: str, name: str) -> Field:
    found = dict(schema.rows()).get(path)
    if found is None:
        raise ExperimentError(
            f"{name} names {path!r}, and {schema.name} has {', '.join(schema.paths)}."
            f"{nearest(path, schema.paths)} (R0881)"
        )
    return found
