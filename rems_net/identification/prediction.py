"""Prediction: many short drives of a definition's mathematics, computed as arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rems_net.agents.robot import Definition, combine
from rems_net.drivers.kinematic.correction import limits
from rems_net.drivers.kinematic.integration import Integration
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.kinematic.swarm import Columns, ahead
from rems_net.errors import ExperimentError
from rems_net.identification.drive import Drive, Floats

#: s. Longest substep of Runge and Kutta's rule; a robot turns by 0.3 rad in it.
FINE = 0.1
#: Rows. A rest at the end of a drive that is not longer is left out.
FEW = 4


def made(definition: type[Definition], parameters: Mapping[str, Any]) -> Kinematic:
    """Return a robot that computes this definition, with these parameters."""
    robot = combine(definition, Kinematic)("identified", parameters=dict(parameters))
    robot.prepare()
    assert isinstance(robot, Kinematic)
    return robot


@dataclass(frozen=True)
class Segments:
    """Drives, cut into pieces of equal length; shorter ones end with weight 0.

    begin: (S,) s      steps: (S, L) s, the step to each row
    command: by field, (S, L)      read: by field, (S, L + 1), where row 0 is the start
    weight: (S, L + 1), 1 for rows that are there
    """

    begin: Floats
    steps: Floats
    command: dict[str, Floats]
    read: dict[str, Floats]
    weight: Floats

    def __len__(self) -> int:
        return len(self.steps)


def cut(drives: Sequence[Drive], seconds: float) -> Segments:
    """Cut drives into segments of `seconds`; the last of each is what is left."""
    pieces = [piece for drive in drives for piece in _pieces(drive, seconds)]
    longest = max(len(piece) for piece in pieces)

    def table(rows: Sequence[Floats], width: int) -> Floats:
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
    first = pieces[0]
    return Segments(
        np.array([piece.time[0] for piece in pieces]),
        steps,
        {
            p: table([one.command[p][1:] for one in pieces], longest - 1)
            for p in first.command
        },
        {p: table([one.state[p] for one in pieces], longest) for p in first.state},
        weight,
    )


def _pieces(drive: Drive, seconds: float) -> list[Drive]:
    """Return parts of a drive that share no row: a shared error would count twice."""
    first, found = 0, []
    for i, time in enumerate(drive.time):
        if time - drive.time[first] >= seconds - 1e-9:
            found.append(slice(first, i + 1))
            first = i + 1
    if len(drive) - first > FEW or not found:
        found.append(slice(first, len(drive)))
    return [drive.part(one) for one in found]


class Predictor:
    """Predicts segments with a definition, for any parameters.

    euler: whether each row is one step by Euler's rule, as of a recorded model.
    Otherwise a row is as many steps of the definition's integrator as are fine.
    """

    def __init__(
        self,
        definition: type[Definition],
        base: Mapping[str, Any],
        *,
        euler: bool = False,
    ):
        self.definition, self.base, self.euler = definition, dict(base), euler

    def robot(self, values: Mapping[str, float]) -> Kinematic:
        """Return the robot with these values of parameters."""
        return made(self.definition, {**self.base, **values})

    def __call__(
        self,
        segments: Segments,
        starts: Mapping[str, Floats],
        values: Mapping[str, float],
    ) -> Floats:
        """Return the states at all rows, (fields, S, L + 1), from these starts (S,)."""
        robot = self.robot(values)
        most = limits(robot.command.schema)
        state = Columns(
            {
                p: starts.get(p, np.zeros(len(segments)))
                for p in robot.state.schema.paths
            }
        )
        integration = Integration(robot, ahead)
        if self.euler:
            integration.kind = "euler"
        else:
            integration.kind = "rk4"
        found = [[state[path] for path in segments.read]]
        for i in range(segments.steps.shape[1]):
            command = Columns(
                {p: column[:, i] * most[p] for p, column in segments.command.items()}
            )
            count = (
                1
                if self.euler
                else max(1, round(float(segments.steps[:, i].max()) / FINE))
            )
            state = self._row(
                robot, integration, state, command, segments.steps[:, i], count
            )
            found.append([state[path] for path in segments.read])
        return np.array(found).transpose(1, 2, 0)

    def _row(
        self,
        robot: Kinematic,
        integration: Integration,
        state: Columns,
        command: Columns,
        steps: Floats,
        count: int,
    ) -> Columns:
        h: Any = steps / count
        try:
            for _ in range(count):
                rates = integration.mean(state, command, h)
                gone = robot.advanced(state, command, h) if robot.advanced else None
                state = ahead(state, rates, h)
                if gone:
                    state = Columns({**state, **gone})
        except (TypeError, ValueError) as error:
            raise ExperimentError(
                f"{self.definition.__name__} cannot be computed with arrays ({error}); "
                "write its mathematics with the functions of rems_net (cos, sin, "
                "hypot) and without `if`. (R0862)"
            ) from error
        return state
