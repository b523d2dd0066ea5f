"""Kinematic: a robot done by integrating its definition's own mathematics."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol, runtime_checkable

from rems_net.agents.ports import Settings
from rems_net.agents.robot import Driver
from rems_net.defdict import DefDict, choice, integer
from rems_net.drivers.needs import missing
from rems_net.errors import SchemaError

Values = Mapping[str, Any]
Rates = Mapping[str, float]


@runtime_checkable
class Moving(Protocol):
    """A definition that mathematics can move."""

    def derivative(self, state: DefDict, command: DefDict) -> Rates:
        """Return fields of the state with their rates: own unit per second."""
        ...


@runtime_checkable
class Measuring(Protocol):
    """A definition that knows what its sensors read."""

    def measure(self, state: DefDict, command: DefDict) -> Values:
        """Return fields of the sensors."""
        ...


class Kinematic(Driver):
    """Integrates `derivative(state, command)`; senses by `measure(state, command)`.

    A field of the state whose rate is not given stays as it is. `euler` takes the rate
    at the beginning of a step for all of it, as the class's model does; `rk4` (Runge
    and Kutta's four rates) follows a curve far closer. `substeps` divides the step.
    """

    options = Settings(
        integrator=choice("euler", "rk4", doc="how rates become a step"),
        substeps=integer(default=1, range=(1, 10_000), doc="in a step of the clock"),
    )

    _rates: Callable[[DefDict, DefDict], Rates]
    _read: Callable[[DefDict, DefDict], Values] | None = None

    def prepare(self) -> None:
        """Check that the definition says how it moves and what its sensors read."""
        if not isinstance(self, Moving):
            raise missing(
                self,
                "derivative(state, command)",
                "the rates by which the state changes",
                "def derivative(self, state, command):\n"
                '        return {"x": command["speed"]}  # per second',
            )
        self._rates = self.derivative
        if type(self).sensors.schema_for(self.parameters) is not None:
            if not isinstance(self, Measuring):
                raise missing(
                    self,
                    "measure(state, command)",
                    "what the sensors read",
                    "def measure(self, state, command):\n"
                    '        return {"range": 1.0 - state["x"]}',
                )
            self._read = self.measure
        super().prepare()

    def reset(self) -> None:
        """Go back to the initial state."""
        super().reset()
        self._driven = self.command
        self._trial = self.state.schema()
        rates = self._rates(self.state, self.command)
        if not isinstance(rates, Mapping):
            raise SchemaError(
                f"{type(self).__name__}: derivative(state, command) returns a dict "
                'such as {"x": 0.1}, the rate of each field that changes; '
                f"got {rates!r}."
            )
        self._ahead(rates, 0.0)  # refuses fields that the state does not have
        self.sense()

    def drive(self, command: DefDict, dt: float) -> None:
        """Integrate over `dt` seconds."""
        self._driven = command
        count = self.options["substeps"]
        step = self._rk4 if self.options["integrator"] == "rk4" else self._euler
        for _ in range(count):
            step(command, dt / count)

    def sense(self) -> None:
        """Let the definition measure; the state is already where `drive` left it."""
        if self._read is not None:
            self.sensors = self._read(self.state, self._driven)

    def _euler(self, command: DefDict, h: float) -> None:
        state = self.state
        for path, rate in self._rates(state, command).items():
            state[path] += h * rate

    def _rk4(self, command: DefDict, h: float) -> None:
        state, trial = self.state, self._trial
        trial.update(state)
        first = self._rates(state, command)
        second = self._rates(self._ahead(first, h / 2), command)
        third = self._rates(self._ahead(second, h / 2), command)
        fourth = self._rates(self._ahead(third, h), command)
        for path in first:
            middle = second[path] + third[path]
            state[path] += h / 6 * (first[path] + 2 * middle + fourth[path])

    def _ahead(self, rates: Rates, h: float) -> DefDict:
        """Return the state that these rates lead to; what has none stays as it is."""
        for path, rate in rates.items():
            self._trial[path] = self.state[path] + h * rate
        return self._trial
