"""Model: a robot whose definition has mathematics that can be carried forward."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rems_net.agents.ports import Settings
from rems_net.defdict import choice, integer
from rems_net.drivers.kinematic.mathematics import Advance, Mathematics, Rates
from rems_net.drivers.needs import missing
from rems_net.drivers.noise import NOISE, Simulated

#: fields with their values, or with their rates: own unit per second
Values = Mapping[str, Any]
Change = Mapping[str, Any]


class Model(Simulated):
    """Has found in its definition how it moves, and what its sensors read."""

    options = Settings(
        integrator=choice("euler", "rk4", doc="how rates become a step"),
        substeps=integer(default=1, range=(1, 10_000), doc="in a step of the clock"),
        noise=NOISE,
    )

    rates: Callable[[Any, Any], Change]
    #: where fields are so many seconds later that go to a target and halt there
    advanced: Callable[[Any, Any, float], Values] | None = None
    read: Callable[[Any, Any], Values] | None = None

    def prepare(self) -> None:
        """Check that the definition says how it moves and what its sensors read."""
        if callable(getattr(self, "advance", None)):
            self.advanced = Advance(self)
        if callable(getattr(self, "derivative", None)):
            self.rates = Rates(self)
        elif self.advanced is not None:
            self.rates = _nothing
        else:
            raise missing(
                self,
                "derivative(state, command)",
                "the rates by which the state changes",
                "def derivative(self, state, command):\n"
                '        return {"x": command["speed"]}  # per second',
            )
        if type(self).sensors.schema_for(self.parameters) is not None:
            if not callable(getattr(self, "measure", None)):
                raise missing(
                    self,
                    "measure(state, command)",
                    "what the sensors read",
                    "def measure(self, state, command):\n"
                    '        return {"range": 1.0 - state["x"]}',
                )
            self.read = Mathematics(self)
        super().prepare()


def _nothing(state: Any, command: Any) -> Change:
    return {}


def mean_rates(
    robot: Model,
    state: Any,
    command: Any,
    h: float,
    ahead: Callable[[Any, Change, float], Any],
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
