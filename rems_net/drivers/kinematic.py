"""Kinematic: a robot done by integrating its definition's own mathematics."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

from rems_net.agents.ports import Settings
from rems_net.agents.robot import Driver, Robot
from rems_net.agents.tick import Tick
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

    rates: Callable[[Any, Any], Rates]
    read: Callable[[Any, Any], Values] | None = None

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
        self.rates = self.derivative
        if type(self).sensors.schema_for(self.parameters) is not None:
            if not isinstance(self, Measuring):
                raise missing(
                    self,
                    "measure(state, command)",
                    "what the sensors read",
                    "def measure(self, state, command):\n"
                    '        return {"range": 1.0 - state["x"]}',
                )
            self.read = self.measure
        super().prepare()

    def reset(self) -> None:
        """Go back to the initial state."""
        super().reset()
        self._driven = self.command
        self._trial = self.state.schema()
        rates = self.rates(self.state, self.command)
        if not isinstance(rates, Mapping):
            raise SchemaError(
                f"{type(self).__name__}: derivative(state, command) returns a dict "
                'such as {"x": 0.1}, the rate of each field that changes; '
                f"got {rates!r}."
            )
        self._ahead(
            self.state, rates, 0.0
        )  # refuses fields that the state does not have
        self.sense()

    def drive(self, command: DefDict, dt: float) -> None:
        """Integrate over `dt` seconds."""
        self._driven = command
        state, count = self.state, self.options["substeps"]
        h = dt / count
        for _ in range(count):
            mean = mean_rates(self, state, command, h, self._ahead)
            for path, rate in mean.items():
                state[path] = float(state[path] + h * rate)

    def sense(self) -> None:
        """Let the definition measure; the state is already where `drive` left it."""
        if self.read is not None:
            read = self.read(self.state, self._driven)
            self.sensors = {path: _plain(value) for path, value in read.items()}

    def _ahead(self, state: DefDict, rates: Rates, h: float) -> DefDict:
        """Return the state that these rates lead to; what has none stays as it is."""
        self._trial.update(state)
        for path, rate in rates.items():
            self._trial[path] = float(state[path] + h * rate)
        return self._trial

    @classmethod
    def swarm(cls, robots: Sequence[Robot]) -> Callable[[Tick], None] | None:
        """Step them as arrays, where the definition's mathematics takes arrays."""
        from rems_net.drivers.swarm import Swarm

        kinematic = [r for r in robots if isinstance(r, Kinematic)]
        made = Swarm.of(kinematic) if len(kinematic) == len(robots) > 1 else None
        return made.step if made else None


def _plain(value: Any) -> Any:
    """A number of numpy's as Python's own; a definition may compute with either."""
    return value.item() if hasattr(value, "item") else value


def mean_rates(
    robot: Kinematic,
    state: Any,
    command: Any,
    h: float,
    ahead: Callable[[Any, Rates, float], Any],
) -> Mapping[str, Any]:
    """The rates that hold on average over `h` seconds; of one robot, or of arrays."""
    rates = robot.rates
    first = rates(state, command)
    if robot.options["integrator"] == "euler":
        return first
    second = rates(ahead(state, first, h / 2), command)
    third = rates(ahead(state, second, h / 2), command)
    fourth = rates(ahead(state, third, h), command)
    return {
        path: (first[path] + 2 * (second[path] + third[path]) + fourth[path]) / 6
        for path in first
    }
