"""Model: a robot whose definition computes its motion and its sensors."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rems_net.agents.ports import Settings
from rems_net.agents.robot import Robot
from rems_net.bodies.body import Accelerometer, Embodied
from rems_net.defdict import Schema, acceleration, choice, integer, text
from rems_net.drivers.acceleration import component, felt
from rems_net.drivers.kinematic.integration import Change, Integration
from rems_net.drivers.kinematic.mathematics import Advance, Mathematics, Rates
from rems_net.drivers.needs import missing
from rems_net.drivers.noise import NOISE, Simulated
from rems_net.errors import SchemaError
from rems_net.maths import sincos

#: values by field
Values = Mapping[str, Any]
#: velocity ahead and to the left, m/s, and turning, rad/s
Motion = tuple[Any, Any, Any]
#: fields of a robot's pose, with their units
POSE = {"x": "m", "y": "m", "heading": "rad"}


class Model(Simulated):
    """Base of kinematic drivers: finds the definition's mathematics, and checks it."""

    options = Settings(
        NOISE,
        integrator=choice("default", "euler", "rk4", doc="how rates become a step"),
        substeps=integer(range=(0, 10_000), doc="in a step; 0: 4 by default, or 1"),
        correction=text(
            max_len=4096,
            doc="weights that a process of type residual has saved; added to each step",
        ),
    )

    rates: Callable[[Any, Any], Change]
    integration: Integration
    #: returns fields that go to a target and halt there, after the given seconds
    advanced: Callable[[Any, Any, float], Values] | None = None
    read: Callable[[Any, Any], Values] | None = None
    #: accelerometers of the body; the driver computes them if `measure` does not
    accelerometers: Sequence[Accelerometer] = ()
    #: motion a tick ago and now: m/s ahead and to the left, rad/s
    went: Motion = (0.0, 0.0, 0.0)
    goes: Motion = (0.0, 0.0, 0.0)

    def prepare(self) -> None:
        """Check that the definition has functions for its motion and its sensors."""
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
            self.accelerometers = _accelerometers(self)
        super().prepare()

    def halt(self) -> None:
        """Set the motion to 0: an obstacle has stopped the robot."""
        self.goes = (0.0, 0.0, 0.0)


def motion(state: Any, rates: Change) -> Motion:
    """Return a robot's motion from its state's rates; for one robot, or arrays."""
    s, c = sincos(state["heading"]) if "heading" in rates else (0.0, 1.0)
    x, y, turning = (rates.get(path, 0.0) for path in POSE)
    return x * c + y * s, y * c - x * s, turning


def feel(
    sensors: Sequence[Accelerometer], went: Motion, goes: Motion, dt: float
) -> dict[str, Any]:
    """Return accelerometers' values on a level floor after `dt` s; 0: at the start."""
    (a, b, _), (x, y, turning) = went, goes
    up = (0.0, 0.0, 1.0)
    force = felt((a, b, 0.0), (x, y, 0.0), (0.0, 0.0, turning), up, dt)
    return {sensor.name: component(sensor.axis, force) for sensor in sensors}


def _accelerometers(robot: Robot) -> list[Accelerometer]:
    fields = type(robot).sensors.schema_for(robot.parameters)
    assert fields is not None
    unit = acceleration().unit
    if not isinstance(robot, Embodied) or all(f.unit != unit for f in fields.fields):
        return []
    state = type(robot).state.schema_for(robot.parameters) or Schema("state")
    for path, needed in POSE.items():
        found = getattr(state.find(path), "unit", needed)
        if found != needed:
            raise SchemaError(
                f"{type(robot).__name__}: an accelerometer needs {path!r} of the state "
                f"in {needed}, but {state.name} has it in {found!r}. (R0306)"
            )
    return [one for one in robot.body().sensors if isinstance(one, Accelerometer)]


def _nothing(state: Any, command: Any) -> Change:
    return {}
