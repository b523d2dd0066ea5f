"""Prediction: many short drives of a definition's mathematics, computed as arrays."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from rems_net.agents.robot import Definition, combine
from rems_net.bodies.actuators import driven
from rems_net.drivers.kinematic.correction import limits
from rems_net.drivers.kinematic.integration import Integration
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.kinematic.swarm import Columns, ahead, moved
from rems_net.errors import ExperimentError
from rems_net.identification.drive import Drive, Floats
from rems_net.identification.motors import acting

#: s. Longest substep of Runge and Kutta's rule; a robot turns by 0.3 rad in it.
FINE = 0.1
#: Rows. A rest at the end of a drive that is not longer is left out.
FEW = 4
#: Share of a command by which a slip is tried.
SLIP = 1e-3
#: Share of a state by which arrays of parameters may differ from one by one: rounding.
SAME = 1e-9


def made(definition: type[Definition], parameters: Mapping[str, Any]) -> Kinematic:
    """Return a robot that computes this definition, with these parameters."""
    robot = combine(definition, Kinematic)("identified", parameters=dict(parameters))
    robot.prepare()
    assert isinstance(robot, Kinematic)
    return robot


@dataclass(frozen=True)
class Segments:
    """Drives, cut into pieces of equal length; shorter ones end with weight 0.

    drives: from which they are cut      begin: (S,) s
    steps: (S, L) s, the step to each row
    rows: (S, L), number of the row among those of all drives, one after the other
    read: by field, (S, L + 1), where row 0 is the start
    weight: (S, L + 1), 1 for rows that are there
    """

    drives: tuple[Drive, ...]
    begin: Floats
    steps: Floats
    rows: NDArray[np.intp]
    read: dict[str, Floats]
    weight: Floats

    def __len__(self) -> int:
        return len(self.steps)

    def starts(self) -> Floats:
        """Return the first readings, (fields, S)."""
        return np.array([read[:, 0] for read in self.read.values()])


def cut(drives: Sequence[Drive], seconds: float) -> Segments:
    """Cut drives into segments of `seconds`; the last of each is what is left."""
    cuts = [(drive, rows) for drive in drives for rows in _pieces(drive, seconds)]
    pieces = [drive.part(rows) for drive, rows in cuts]
    firsts = dict(zip(map(id, drives), np.cumsum([0, *map(len, drives)]), strict=False))
    longest = max(len(piece) for piece in pieces)

    def table(rows: Sequence[Any], width: int) -> Any:
        found = np.zeros((len(rows), width))
        for row, values in zip(found, rows, strict=True):
            row[: len(values)] = values
            row[len(values) :] = values[-1] if len(values) else 0.0
        return found

    steps = table([np.diff(one.time) for one in pieces], longest - 1)
    weight = np.zeros((len(pieces), longest))
    for i, piece in enumerate(pieces):
        weight[i, : len(piece)] = 1.0
        steps[i, len(piece) - 1 :] = 0.0
    places = [
        firsts[id(drive)] + np.arange(rows.start + 1, rows.stop) for drive, rows in cuts
    ]
    return Segments(
        tuple(drives),
        np.array([piece.time[0] for piece in pieces]),
        steps,
        table(places, longest - 1).astype(np.intp),
        {p: table([one.state[p] for one in pieces], longest) for p in pieces[0].state},
        weight,
    )


def whole(drive: Drive) -> Segments:
    """Return a drive as one segment."""
    return cut([drive], drive.time[-1] - drive.time[0])


def _pieces(drive: Drive, seconds: float) -> list[slice]:
    """Return parts of a drive that share no row: a shared error would count twice."""
    first, found = 0, []
    for i, time in enumerate(drive.time):
        if time - drive.time[first] >= seconds - 1e-9:
            found.append(slice(first, i + 1))
            first = i + 1
    if len(drive) - first > FEW or not found:
        found.append(slice(first, len(drive)))
    return found


class Predictor:
    """Predicts segments with a definition, for any parameters.

    euler: whether each row is one step by Euler's rule, as of a recorded model.
    Otherwise a row is as many steps of the definition's integrator as are fine.
    """

    #: share of a parameter by which it is changed to see its effect
    nudge: ClassVar[float] = 1e-5
    #: whether it can make one step of Euler's rule a row
    steps: ClassVar[bool] = True

    def __init__(self, definition: type[Definition], base: Mapping[str, Any]):
        self.definition, self.base, self.euler = definition, dict(base), False
        #: whether its mathematics takes arrays of parameters; None: not tried yet
        self.together: bool | None = None

    @cached_property
    def plain(self) -> Kinematic:
        """The robot with its parameters as they were."""
        return made(self.definition, self.base)

    def __call__(
        self, segments: Segments, starts: Floats, values: Mapping[str, Any]
    ) -> Floats:
        """Return the states at all rows, (fields, S, L + 1), from these starts.

        starts: (fields, S), of the fields that were read      values: parameters
        """
        many = {name: np.array([value]) for name, value in values.items()}
        return self.many(segments, starts[:, None], many)[:, 0]

    def many(
        self, segments: Segments, starts: Floats, values: Mapping[str, Floats]
    ) -> Floats:
        """Return the states (fields, K, S, L + 1) of K predictions at once.

        starts: (fields, K, S)      values: parameters, (K,) of each
        """
        count = starts.shape[1]
        if self.together is None and count > 1 and values:
            self.together = True
            with np.errstate(all="ignore"):
                try:
                    found = self._predict(segments, starts, values)
                except (TypeError, ValueError, AttributeError, ExperimentError):
                    found = np.full(1, np.nan)
            each = self._each(segments, starts, values)
            off = np.abs(found - each) <= SAME * (1 + np.abs(each))
            self.together = found.shape == each.shape and bool(off.all())
            return each
        if self.together or not values:
            return self._predict(segments, starts, values)
        return self._each(segments, starts, values)

    def shaken(
        self, segments: Segments, starts: Floats, values: Mapping[str, float]
    ) -> Floats:
        """Return the effects (fields, F L, S, L + 1) of slips: a command, in one row.

        Each is the change of the states for a slip of 1 of one of F commands in one of
        L rows, linearly.      starts: (fields, S)      values: parameters
        """
        count = segments.steps.shape[1]
        asked = list(segments.drives[0].command)
        rows = 1 + SLIP * np.eye(len(asked) * count + 1, len(asked) * count)
        slips = dict(zip(asked, np.split(rows, len(asked), axis=1), strict=True))
        wide = np.repeat(starts[:, None], len(rows), axis=1)
        found = self._predict(segments, wide, values, slips)
        effects: Floats = (found[:, :-1] - found[:, -1:]) / SLIP
        return effects

    def _each(
        self, segments: Segments, starts: Floats, values: Mapping[str, Floats]
    ) -> Floats:
        """Return the states, predicted with one robot after the other."""
        found = [
            self._predict(
                segments,
                starts[:, k : k + 1],
                {name: column[k] for name, column in values.items()},
            )
            for k in range(starts.shape[1])
        ]
        return np.concatenate(found, axis=1)

    def _predict(
        self,
        segments: Segments,
        starts: Floats,
        values: Mapping[str, Any],
        slips: Mapping[str, Floats] | None = None,
    ) -> Floats:
        if any(np.ndim(value) for value in values.values()):
            robot = self._arrays(values)
        else:
            robot = (
                made(self.definition, {**self.base, **values}) if values else self.plain
            )
        commands = self._commands(segments, robot, values)
        for path, share in (slips or {}).items():
            commands[path] = commands[path] * share[:, None]
        none = np.zeros(starts.shape[1:])
        state = Columns(dict.fromkeys(robot.state.schema.paths, none))
        state |= dict(zip(segments.read, starts, strict=True))
        integration = Integration(robot, ahead)
        integration.kind = "euler" if self.euler else "rk4"
        found = [[state[path] for path in segments.read]]
        for i in range(segments.steps.shape[1]):
            steps = segments.steps[:, i]
            command = Columns({p: column[..., i] for p, column in commands.items()})
            fine = max(1, round(float(steps.max()) / FINE))
            integration.count = 1 if self.euler else fine
            try:
                state = moved(integration, state, command, steps)
            except (TypeError, ValueError) as error:
                raise ExperimentError(
                    f"{self.definition.__name__} cannot be computed with arrays "
                    f"({error}); write its mathematics with the functions of rems_net "
                    "(cos, sin, hypot) and without `if`. (R0862)"
                ) from error
            found.append([state[path] for path in segments.read])
        wide = np.array([np.broadcast_arrays(*row, none)[:-1] for row in found])
        return wide.transpose(1, 2, 3, 0)

    def _arrays(self, values: Mapping[str, Floats]) -> Kinematic:
        """Return a robot whose parameters are arrays, (K, 1) of each that is given."""
        robot = made(self.definition, self.base)
        flat = robot.parameters.flat()
        flat |= {name: column[:, None] for name, column in values.items()}
        robot.__dict__["parameters"] = Columns(flat)
        for base in type(robot).__mro__:  # computed from parameters that were others
            for name, found in vars(base).items():
                if isinstance(found, cached_property):
                    robot.__dict__.pop(name, None)
        return robot

    def _commands(
        self, segments: Segments, robot: Kinematic, values: Mapping[str, Any]
    ) -> dict[str, Floats]:
        """Return what acts in each row, by field, (K or 1, S, L)."""
        most = self._limits(values)
        fields = driven(self.plain.parameters.schema)
        given = robot.__dict__["parameters"]
        acts = acting(segments.drives, fields, given)
        return {
            path: column[..., segments.rows] * most[path]
            for path, column in acts.items()
        }

    def _limits(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return the limit of each field of the command, (K, 1, 1) if it varies."""
        columns = {n: np.atleast_1d(value) for n, value in values.items()}
        count = max((len(column) for column in columns.values()), default=1)
        kind, parameters = type(self.plain), self.plain.parameters
        found: list[dict[str, float]] = []
        for k in range(count):
            mine = {name: float(column[k]) for name, column in columns.items()}
            schema = kind.command.schema_for(
                parameters.schema({**parameters.flat(), **mine})
            )
            found.append(limits(schema or self.plain.command.schema))
        return {
            path: np.array([one[path] for one in found])[:, None, None]
            for path in found[0]
        }
