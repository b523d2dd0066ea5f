"""A definition's mathematics: given what it can only read, checked in what it returns.

`derivative` and `measure` get views that refuse to be set: a state that they changed
would be one that nobody integrated.
"""

import threading
from collections.abc import Callable, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any

from rems_net.agents.diagnosis import check_call, where, written
from rems_net.agents.robot import Robot
from rems_net.defdict import DefDict, parse_quantity, shown
from rems_net.drivers.kinematic.units import (
    rate,
    unclear_by_command,
    unclear_by_state,
)
from rems_net.errors import SchemaError


class Mathematics:
    """One function of a robot's definition, called with a state and a command.

    The arrays of a swarm go in and come out as they are.
    """

    name = "measure"
    takes: tuple[str, ...] = ("state", "command")
    example = '{"range": 1.0}, what each sensor reads'
    #: fields for which a plain number does not say enough, and why
    unclear: Mapping[str, str] = MappingProxyType({})

    def __init__(self, robot: Robot):
        self.robot = robot
        self._function = getattr(robot, self.name)
        self._refusals = tuple(
            _refusal(self.place, self.example, port) for port in ("state", "command")
        )
        check_call(robot, self.name, *self.takes)

    def __call__(self, state: Any, command: Any, *more: float) -> Mapping[str, Any]:
        """What the function returns. Raises SchemaError for what it may not."""
        if not isinstance(state, dict):  # a DefDict, asked the cheap way
            of_state, of_command = self._refusals
            state, command = shown(state, of_state), shown(command, of_command)
        given = self._function(state, command, *more)
        if type(given) is not dict or self.unclear:
            return self._checked(given)
        for value in given.values():
            if type(value) is not float:
                return self._checked(given)
        return given

    def _checked(self, given: object) -> Mapping[str, Any]:
        if not isinstance(given, Mapping):
            hint = " Is `return` missing?" if given is None else ""
            raise SchemaError(
                f"{self.place} returns {_show(given)}; expected a dict such as "
                f"{self.example}.{hint}"
            )
        return {path: self.number(path, value) for path, value in given.items()}

    def number(self, path: str, value: Any) -> Any:
        """What counts, of what was returned for one field."""
        return value

    @property
    def place(self) -> str:
        """`Cart.derivative (cart.py, line 12)`"""
        return written(self.robot, self.name)


class Advance(Mathematics):
    """`advance`: where fields are, `dt` seconds later, that are not integrated."""

    name = "advance"
    takes = ("state", "command", "dt")
    example = '{"joint": 0.3}, where each field is that goes to a target'


class Rates(Mathematics):
    """`derivative`: rates in each field's own unit per second.

    Text with a unit and quantities are converted. A rate is never a plain number if
    its field of the state is not in SI units, or a command that it depends on.
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
        """Find the rates that depend on commands which are not in SI units."""
        found = unclear_by_command(self._function, state, command)
        self.unclear = found | self._of_state

    def number(self, path: str, value: Any) -> Any:
        """The rate of a field. Raises SchemaError, or UnitError."""
        unit = rate(self._units.get(path, ""))
        if isinstance(value, str) or hasattr(value, "units"):
            return parse_quantity(value, unit, f"{path!r} of {self.place}")
        if value is None:
            raise SchemaError(
                f"{self.place} returns None for {path!r}; expected a number in {unit}."
            )
        if path in self.unclear:
            raise SchemaError(
                f"{self.place} returns {_show(value)} for {path!r}, and "
                f"{self.unclear[path]}"
            )
        return value


@cache
def _refusal(place: str, example: str, port: str) -> Callable[[str], SchemaError]:
    """Return what makes the error of setting a field in a function, from its path."""

    def refuse(path: str) -> SchemaError:
        return SchemaError(
            f"{place} sets {port}[{path!r}] "
            f"({where(threading.current_thread())}), and can only read it; return a "
            f"dict such as {example}."
        )

    return refuse


def _show(value: object) -> str:
    return repr(value)[:60]
