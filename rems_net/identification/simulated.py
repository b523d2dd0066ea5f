"""Simulated: prediction by a physics engine, which knows masses and friction, too.

Each drive is simulated once for each set of parameters, on an open floor. A segment's
prediction is its piece of that way, moved to where the segment starts: so motors and
wheels have their speed there. That takes much longer than a definition's mathematics.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

from rems_net.agents.parts import find
from rems_net.agents.robot import Definition, Driver, combine
from rems_net.drivers.kinematic.correction import limits
from rems_net.errors import ExperimentError
from rems_net.identification.drive import Drive, Floats
from rems_net.identification.prediction import Predictor, Segments

#: s. Commands before a drive that are simulated, too: longer than motors lag.
WARM = 2.0
#: Number of simulated drives that are kept.
KEPT = 200
POSE = ("x", "y", "heading")


class Simulated(Predictor):
    """Predicts segments with a driver that simulates, such as mujoco."""

    #: An engine's contacts make smaller changes uneven.
    nudge = 0.02
    steps = False

    def __init__(
        self, definition: type[Definition], base: Mapping[str, Any], driver: str
    ):
        super().__init__(definition, base)
        self.together = False  # one simulation after the other
        kind = cast(type[Driver], find("driver", driver, Path.cwd()))
        if kind.__dict__.get("needs") is None or not hasattr(kind, "member"):
            raise ExperimentError(
                f"driver {driver!r} does not simulate a body; expected mujoco or "
                "pybullet. Without --driver, the definition's own mathematics "
                "predicts. (R0882)"
            )
        self._kind = combine(definition, kind)
        open_floor = {"arena_radius": 0.0}
        paths = self.plain.parameters.schema.paths
        self._open = {name: v for name, v in open_floor.items() if name in paths}
        #: with each way its drive: while that lives, no other one has its id
        self._ways: dict[tuple[object, ...], tuple[Drive, Floats]] = {}

    def _predict(
        self,
        segments: Segments,
        starts: Floats,
        values: Mapping[str, Any],
        slips: Mapping[str, Floats] | None = None,
    ) -> Floats:
        fields = list(segments.read)
        ways = [self._way(drive, values) for drive in segments.drives]
        way = np.concatenate(ways, axis=1)[:, _rows(segments)][:, None]
        own = dict(zip(fields, way, strict=True))  # (1, S, L + 1) of each
        begin = {path: rows[..., :1] for path, rows in own.items()}
        start = dict(zip(fields, starts[..., None], strict=True))  # (K, S, 1) of each
        gone = {path: own[path] - begin[path] for path in fields}
        if set(POSE) <= set(fields):
            turn = start["heading"] - begin["heading"]
            cosine, sine = np.cos(turn), np.sin(turn)
            x, y = gone["x"], gone["y"]
            gone["x"], gone["y"] = x * cosine - y * sine, x * sine + y * cosine
        return np.array([start[path] + gone[path] for path in fields])

    def _way(self, drive: Drive, values: Mapping[str, Any]) -> Floats:
        """Return the states (fields, n) of a drive, simulated from 0; each once."""
        key = id(drive), *((name, float(value)) for name, value in values.items())
        if key not in self._ways:
            if len(self._ways) >= KEPT:
                self._ways.pop(next(iter(self._ways)))
            self._ways[key] = drive, self._simulate(drive, values)
        return self._ways[key][1]

    def _simulate(self, drive: Drive, values: Mapping[str, Any]) -> Floats:
        floats = {name: float(value) for name, value in values.items()}
        parameters = {**self.base, **floats, **self._open}
        robot: Any = self._kind("identified", parameters=parameters)
        time, command, warm = drive.time, drive.command, 0
        if (past := drive.past) is not None:
            first = int(np.searchsorted(past.time, time[0] - WARM))
            warm = len(past) - first
            time = np.concatenate([past.time[first:], time])
            command = {
                path: np.concatenate([past.command[path][first:], shares])
                for path, shares in command.items()
            }
        robot.prepare()
        robot.open()
        try:
            schema = robot.command.schema
            most, spans = limits(schema), {p: one.limits for p, one in schema.rows()}
            asked = {p: np.clip(v * most[p], *spans[p]) for p, v in command.items()}
            rows = np.array([*asked.values()]).T.tolist()
            went = []
            for row, dt in zip(
                rows, np.diff(time, prepend=time[0]).tolist(), strict=True
            ):
                if dt:
                    robot.command = schema(dict(zip(asked, row, strict=True)))
                    robot.drive(robot.acting(dt), dt)
                    robot.sense()
                went.append([robot.state[path] for path in drive.state])
        finally:
            robot.close()
        way: Floats = np.array(went[warm:]).T
        return way


def _rows(segments: Segments) -> Any:
    """Return the rows (S, L + 1) of segments, with their starts, among all drives'."""
    rows = segments.rows.copy()
    # A shorter segment ends with rows that do not count: there it stays where it is.
    last = (segments.weight[:, 1:].sum(axis=1) - 1).astype(int)
    for row, end in zip(rows, last, strict=True):
        row[end + 1 :] = row[end]
    return np.concatenate([rows[:, :1] - 1, rows], axis=1)
