"""Motion: a definition's mathematics for many states at once."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from rems_net.drivers.kinematic.integration import Integration
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.kinematic.swarm import Columns, ahead, moved
from rems_net.maths.ukf import Floats


class Motion:
    """Steps and readings of a robot in many states, as rows of arrays.

    A row has the state, values that are left alone, and the error of each command.
    used: paths of the sensors that are read
    """

    def __init__(self, robot: Kinematic, used: Sequence[str]):
        self._robot, self._used = robot, list(used)
        self._states = list(robot.state.schema.paths)
        self._commands = list(robot.command.schema.paths)
        self._integration = Integration(robot, ahead)
        self._at_once = True

    def moved(self, rows: Floats, command: Floats, dt: float) -> Floats:
        """Return the states after `dt` s."""
        return self._each(self._move, rows, command, dt)

    def read(self, rows: Floats, command: Floats) -> Floats:
        """Return what the sensors read there, without noise."""
        return self._each(self._look, rows, command, 0.0)

    def _each(
        self, function: Callable[..., Any], rows: Floats, command: Floats, dt: float
    ) -> Floats:
        commands = command + rows[:, -len(command) :]
        if self._at_once:
            try:
                return _table(function(_all(rows), _all(commands), dt), len(rows))
            except (TypeError, ValueError):
                self._at_once = False  # the mathematics has an `if`: one by one
        found = [
            _table(function(state.tolist(), given.tolist(), dt), 1)
            for state, given in zip(rows, commands, strict=True)
        ]
        return np.concatenate(found)

    def _move(self, state: Any, command: Any, dt: float) -> list[Any]:
        now = Columns(zip(self._states, state, strict=False))
        given = Columns(zip(self._commands, command, strict=True))
        count = self._integration.count
        then = moved(self._integration, now, given, dt, count)
        return [then[path] for path in self._states]

    def _look(self, state: Any, command: Any, dt: float) -> list[Any]:
        assert self._robot.read is not None
        now = Columns(zip(self._states, state, strict=False))
        given = Columns(zip(self._commands, command, strict=True))
        read = self._robot.read(now, given)
        return [read[path] for path in self._used]


def _all(rows: Floats) -> list[Floats]:
    return [column.copy() for column in rows.T]


def _table(columns: list[Any], rows: int) -> Floats:
    found = [np.broadcast_to(np.asarray(one, float), (rows,)) for one in columns]
    return np.array(found).T.copy()
