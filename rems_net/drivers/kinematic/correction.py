"""Correction: a network adds to each step what the definition's mathematics leaves out.

Its inputs are the newest commands, as shares of their limits; its results are a
displacement in the robot's frame at the start of the step. Without a command in its
memory it is 0, so a robot that stands does not creep. There are only sums, products
and quotients, in a fixed order: the same bits on every computer. (`tanh` differs.)
"""

import json
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rems_net.agents.robot import definition_of
from rems_net.bodies.actuators import full
from rems_net.defdict import DefDict, Schema
from rems_net.drivers.kinematic.model import POSE
from rems_net.errors import ExperimentError, SchemaError
from rems_net.events import warn
from rems_net.maths import sincos
from rems_net.system.reading import DESCRIPTION, read_file

if TYPE_CHECKING:
    from rems_net.drivers.kinematic.kinematic import Kinematic

Floats = NDArray[np.float64]
#: Steps of the short drive by which a definition is recognised.
PROBE = 3
#: Relative difference of two such drives from which definitions are not the same.
SAME = 1e-6
#: Share of full speed. A motor that is late and turns round is wrong by 2; a correction
#: that is larger has run away.
HUGE = 2.5


def limits(schema: Schema) -> dict[str, float]:
    """Return the limit of each field that goes from -limit to limit; 1 for others."""
    return {path: full(schema, path) for path in schema.paths}


def sigmoid(z: Any) -> Any:
    """Return z / (1 + |z|): -1 to 1."""
    return z / (1.0 + np.abs(z))


@dataclass(frozen=True)
class Network:
    """One hidden layer, and a way around it.

    inputs: number      hidden: number of neurons
    """

    inputs: int
    hidden: int

    @property
    def count(self) -> int:
        """Number of weights."""
        return self.hidden * (self.inputs + 1) + len(POSE) * (self.hidden + self.inputs)

    def begin(self, random: np.random.Generator) -> tuple[Floats, Floats]:
        """Return weights with which every result is 0, and their deviations."""
        inner = self.hidden * (self.inputs + 1)
        mean, spread = np.zeros(self.count), np.full(self.count, 0.3)
        spread[:inner] = 1.0 / np.sqrt(self.inputs)
        mean[:inner] = spread[:inner] * random.uniform(-1.5, 1.5, inner)
        return mean, spread

    def __call__(self, weights: Floats, given: Floats) -> Floats:
        """Return the results (S, 3) of S sets of weights (S, count) for one input."""
        s, i, h, o = len(weights), self.inputs, self.hidden, len(POSE)
        a, b, v, w = np.split(weights, np.cumsum([h * i, h, o * h]).tolist(), axis=1)
        level = (a.reshape(s, h, i) * given).sum(axis=2) + b
        lit = sigmoid(level) - sigmoid(b)
        found: Floats = (v.reshape(s, o, h) * lit[:, None, :]).sum(axis=2)
        found += (w.reshape(s, o, i) * given).sum(axis=2)
        return found


@dataclass(frozen=True)
class Weights:
    """Weights that were learned for one definition, as they are in a file.

    definition: its class      commands: the fields of its command
    step: s, of the ticks      taps, width: the inputs are the means of so many spans of
    so many steps      hidden: number of neurons      full: m, m, rad, at full speed
    probe: where the definition alone goes in a short drive
    helps: whether the gate was open in the end; if not, the correction is 0
    """

    definition: str
    commands: list[str]
    step: float
    taps: int
    width: int
    hidden: int
    full: list[float]
    probe: list[float]
    helps: bool
    weights: list[float]

    def write(self, path: Path) -> None:
        """Write the file; numbers read back to the same bits."""
        text = json.dumps(asdict(self), indent=1) + "\n"
        path.write_text(text, encoding="utf-8", newline="\n")

    @classmethod
    def read(cls, path: Path, shown: str = "") -> "Weights":
        """Read the file. Raises ExperimentError, with its name as `shown`."""
        shown = shown or str(path)
        try:
            given = json.loads(read_file(path, DESCRIPTION))
            found = cls(**{field.name: given[field.name] for field in fields(cls)})
            numbers = [*found.full, *found.probe, *found.weights, found.step]
            count = found.network.count
            good = len(found.weights) == count and found.width > 0
            good = good and bool(np.isfinite(numbers).all())
        except OSError as error:
            raise ExperimentError(
                f"{shown} cannot be read: {error.strerror}. A process of type residual "
                'writes it, with options={"save": "NAME.json"}. (R0871)'
            ) from None
        except (KeyError, TypeError, ValueError, RecursionError):
            good = False
        if not good:
            raise ExperimentError(
                f"{shown} has no weights of a residual, or some that are not finite; "
                "expected the file that a process of type residual has saved. (R0871)"
            )
        return found

    @property
    def network(self) -> Network:
        return Network(self.taps * len(self.commands), self.hidden)


class Memory:
    """The newest commands of a robot, as shares of their limits.

    taps: number of spans      width: steps of a span, whose mean counts
    """

    def __init__(self, schema: Schema, taps: int, width: int):
        self.limits = limits(schema)
        self._shape = taps, width, len(self.limits)
        self._rows: deque[list[float]] = deque(maxlen=taps * width)
        self.clear()

    def clear(self) -> None:
        """Forget all commands."""
        for _ in range(self._rows.maxlen or 0):
            self._rows.append([0.0] * len(self.limits))

    def add(self, command: DefDict | Mapping[str, Any]) -> Floats:
        """Add the command of a step; return the inputs, the newest first."""
        row = [float(command[path]) / most for path, most in self.limits.items()]
        self._rows.appendleft(row)
        found: Floats = np.array(self._rows).reshape(self._shape).mean(axis=1).ravel()
        return found


class Correction:
    """A term of the kinematic driver: the network of a file, beside the mathematics."""

    def __init__(self, robot: "Kinematic", file: str):
        path = robot.folder / file
        self.robot, self.path = robot, path
        self.saved = saved = Weights.read(path, file)
        _check(robot, saved, path)
        self._weights = np.array([saved.weights])
        self._network, self._full = saved.network, np.array(saved.full)
        self._memory = Memory(robot.command.schema, saved.taps, saved.width)
        self._off = not saved.helps
        if self._off:
            warn(
                "correction",
                f"{robot.key}: the weights of {path.name} do not help, as their own "
                "skill shows, so they are not used",
                robot.key,
            )

    def rewind(self) -> None:
        """Forget the commands so far."""
        self._memory.clear()

    def add(self, before: Sequence[float], command: DefDict, dt: float) -> None:
        """Move the robot's state, which the mathematics has already moved.

        before: its pose at the start of the step
        """
        if abs(dt - self.saved.step) > SAME * dt:
            raise SchemaError(
                f"{self.path.name} was learned at steps of {self.saved.step:g} s, and "
                f"this one has {dt:g} s; learn it at this step, or write dt="
                f"{self.saved.step:g}. (R0872)"
            )
        given = self._memory.add(command)
        if self._off:
            return
        found = self._network(self._weights, given)[0]
        if runs_away(found):
            self._off = True
            warn("correction", f"{self.robot.key}: {RUNAWAY}", self.robot.key)
            return
        x, y, turn = (found * self._full).tolist()
        s, c = sincos(before[2])
        state = self.robot.state
        state["x"] = state["x"] + (x * c - y * s)
        state["y"] = state["y"] + (x * s + y * c)
        state["heading"] = state["heading"] + turn


RUNAWAY = (
    "its correction has run away (it is not finite, or beyond twice full speed); from "
    "here on it is 0, and the robot is as it was without one"
)


def runs_away(found: Floats) -> bool:
    """Return whether results of a network, as shares of full speed, are useless."""
    return not bool((np.abs(found) < HUGE).all())


def probe(robot: "Kinematic", dt: float) -> tuple[list[float], list[float]]:
    """Return a step at full speed (m, m, rad), and where a short drive goes.

    robot: one without a correction, which is put back afterwards
    """
    full, went = [0.0, 0.0, 0.0], list[float]()
    for path, most in limits(robot.command.schema).items():
        robot.rewind()
        robot.state = dict.fromkeys(POSE, 0.0)
        for _ in range(PROBE):
            before = pose(robot.state)
            go(robot, {path: most}, dt)
            step = local(before, pose(robot.state))
        went += pose(robot.state)
        full = [a + abs(b) for a, b in zip(full, step, strict=True)]
    robot.rewind()
    most = max(full[0], full[1])
    return [most or dt, most or dt, full[2] or dt], went


def go(robot: "Kinematic", command: Mapping[str, Any], dt: float) -> None:
    """Let a robot obey a command for one step; fields without a value are safe."""
    robot.command = robot.command.schema(command)
    robot.drive(robot.acting(dt), dt)


def pose(state: DefDict | Mapping[str, Any]) -> tuple[float, float, float]:
    """Return x, y and heading of a state."""
    return float(state["x"]), float(state["y"]), float(state["heading"])


def local(before: Sequence[float], after: Sequence[float]) -> tuple[float, ...]:
    """Return the way from one pose to the next, seen from the first: m, m, rad."""
    s, c = sincos(before[2])
    x, y = after[0] - before[0], after[1] - before[1]
    return x * c + y * s, y * c - x * s, after[2] - before[2]


def _check(robot: "Kinematic", saved: Weights, path: Path) -> None:
    """Raise ExperimentError for weights of another definition or other parameters."""
    ours = definition_of(type(robot)).__name__
    commands = list(robot.command.schema.paths)
    if (saved.definition, saved.commands) != (ours, commands):
        raise ExperimentError(
            f"{path.name} has weights for a {saved.definition} with the command "
            f"{', '.join(saved.commands)}; this robot is a {ours} with "
            f"{', '.join(commands)}. Learn weights for it. (R0872)"
        )
    words = ("integrator", "substeps")
    options = {word: robot.options[word] for word in words}
    parameters = {path: robot.parameters[path] for path in robot.parameters}
    alone = type(robot)(robot.name, parameters=parameters, options=options)
    alone.prepare()
    went = probe(alone, saved.step)[1]
    if not np.allclose(went, saved.probe, rtol=SAME, atol=SAME * max(saved.full)):
        raise ExperimentError(
            f"{path.name} was learned beside a {ours} with other parameters or another "
            "integrator, which drives elsewhere; give this robot the same, or learn "
            "weights with these. (R0872)"
        )
