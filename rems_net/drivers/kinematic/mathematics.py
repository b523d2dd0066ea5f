"""A definition's mathematics: its arguments are read-only, its results are checked.

`derivative` and `measure` get views that refuse to be set: the integration would not
know of a change that they made to the state.
"""

import threading
from collections.abc import Callable, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np

from rems_net.agents.diagnosis import check_call, where, written
from rems_net.agents.robot import Robot
from rems_net.defdict import DefDict, parse_quantity, shown
from rems_net.drivers.kinematic.units import (
    rate,
    unclear_by_command,
    unclear_by_state,
)
from rems_net.errors import SchemaError

#: types of results that are taken as they are, in SI units
PLAIN = (float, np.ndarray)


class Mathematics:
    """One function of a robot's definition, called with a state and a command.

    Arrays of a swarm are passed on unchanged.
    """

    name = "measure"
    takes: tuple[str, ...] = ("state", "command")
    example = '{"range": 1.0}, what each sensor reads'
    #: fields for which a number without a unit is ambiguous, and why
    unclear: Mapping[str, str] = MappingProxyType({})

    def __init__(self, robot: Robot):
        self.robot = robot
        self._function = getattr(robot, self.name)
        self._refusals = tuple(
            _refusal(self.place, self.example, port) for port in ("state", "command")
        )
        check_call(robot, self.name, *self.takes)

    def __call__(self, state: Any, command: Any, *more: float) -> Mapping[str, Any]:
        """Return the function's result. Raises SchemaError for a wrong one."""
        if not isinstance(state, dict):  # a DefDict, tested the cheap way
            of_state, of_command = self._refusals
            state, command = shown(state, of_state), shown(command, of_command)
        given = self._function(state, command, *more)
        if type(given) is not dict or self.unclear:
            return self._checked(given)
        for value in given.values():
            if type(value) not in PLAIN:
                return self._checked(given)
        return given

    def _checked(self, given: object) -> Mapping[str, Any]:
        if not isinstance(given, Mapping):
            hint = " Is `return` missing?" if given is None else ""
            raise SchemaError(
                f"{self.place} returns {_show(given)}; expected a dict such as "
                f"{self.example}.{hint} (R0304)"
            )
        return {path: self.number(path, value) for path, value in given.items()}

    def number(self, path: str, value: Any) -> Any:
        """Return the value to use for one field of the result."""
        return value

    @property
    def place(self) -> str:
        """`Cart.derivative (cart.py, line 12)`"""
        return written(self.robot, self.name)


class Advance(Mathematics):
    """`advance`: values of fields that are not integrated, `dt` seconds later."""

    name = "advance"
    takes = ("state", "command", "dt")
    example = '{"joint": 0.3}, where each field is that goes to a target'


class Rates(Mathematics):
    """`derivative`: rates in each field's own unit per second.

    Text with a unit and quantities are converted. A number without a unit is refused
    if the field of the state, or a command that the rate depends on, is not in SI.
    """

    name = "derivative"
    example = '{"x": 0.1}, the rate of each field that changes'

    def __init__(self, robot: Robot):
        super().__init__(robot)
        schema = type(robot).state.schema_for(robot.parameters)
        rows = list(schema.rows()) if schema else []
        self._units = {path: field.unit for path, field in rows}
        self._of_state = unclear_by_state(schema) if schema else {}
        self.unclear = self._of_state

    def look(self, state: DefDict, command: DefDict) -> None:
        """Find the rates that depend on commands that are not in SI units."""
        found = unclear_by_command(self._function, state, command)
        self.unclear = found | self._of_state

    def number(self, path: str, value: Any) -> Any:
        """Return the rate of a field. Raises SchemaError, or UnitError."""
        unit = rate(self._units.get(path, ""))
        if isinstance(value, str) or hasattr(value, "units"):
            return parse_quantity(value, unit, f"{path!r} of {self.place}")
        if value is None:
            raise SchemaError(
                f"{self.place} returns None for {path!r}; expected a number in "
                f"{unit}. (R0304)"
            )
        if path in self.unclear:
            raise SchemaError(
                f"{self.place} returns {_show(value)} for {path!r}, and "
                f"{self.unclear[path]} (R0304)"
            )
        return value


@cache
def _refusal(place: str, example: str, port: str) -> Callable[[str], SchemaError]:
    """Return a function from a path to the error of setting that field."""

    def refuse(path: str) -> SchemaError:
        return SchemaError(
            f"{place} sets {port}[{path!r}] "
            f"({where(threading.current_thread())}), and can only read it; return a "
            f"dict such as {example}. (R0304)"
        )

    return refuse


def _show(value: object) -> str:
    return repr(value)[:60]
