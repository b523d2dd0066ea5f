"""Kinematic: driver that integrates the mathematics of the robot's definition."""

from collections.abc import Callable, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any, cast

from rems_net.agents.robot import Robot
from rems_net.agents.tick import Tick
from rems_net.agents.verbs import verb_names
from rems_net.defdict import DefDict, refill
from rems_net.drivers.kinematic.integration import Change, Integration
from rems_net.drivers.kinematic.mathematics import Rates
from rems_net.drivers.kinematic.model import POSE, Model, feel, motion
from rems_net.drivers.needs import NEEDS_MUJOCO
from rems_net.errors import RemsError, SchemaError
from rems_net.scenes.scene import Scene

if TYPE_CHECKING:
    from rems_net.drivers.kinematic.correction import Correction
    from rems_net.drivers.kinematic.swarm import Swarm
    from rems_net.drivers.kinematic.world import KinematicWorld


class Kinematic(Model):
    """Driver that integrates `derivative(state, command)`; `measure` gives the sensors.

    Fields that `advance(state, command, dt)` returns, if the definition has it, get its
    values after the integration: joints that go to a target and halt there, at any
    step. A field of the state that neither returns stays as it is. `rk4` (Runge and
    Kutta's four rates, in four substeps) is the default; `euler` takes the rate at the
    beginning of a step for all of it, as the class's model does. If an integrator is
    stated, by the options or as `integrator = "euler"` in the definition, a step is one
    substep. If a step and its two halves differ too much, the driver warns.
    """

    #: a term beside the mathematics: what a network has learned of the rest
    correction: "Correction | None" = None

    def prepare(self) -> None:
        """Read the weights of a correction, too, if the options name them."""
        super().prepare()
        if file := self.options["correction"]:
            from rems_net.drivers.kinematic.correction import Correction

            self.correction = Correction(self, file)

    def rewind(self) -> None:
        """Go back to the initial state."""
        super().rewind()
        if self.correction is not None:
            self.correction.rewind()
        self._driven, self._dt = self.command, 0.0
        self._flat = not any(field.shape for field in self.command.schema.fields)
        self.halt()
        self._trial = self.state.schema()
        if "integration" not in self.__dict__:
            self.integration = Integration(self, self._ahead)
        if isinstance(self.rates, Rates):
            self.rates.look(self.state, self.command)
        rates = self.rates(self.state, self.command)
        # Raises an error for rates of fields that the state does not have.
        self._ahead(self.state, rates, 0.0)
        if self.advanced is not None:
            self._trial.update(self.advanced(self.state, self.command, 0.0))
        self.sense()
        self.begin_noise()

    def drive(self, command: DefDict, dt: float) -> None:
        """Integrate over `dt` seconds."""
        self._driven = command
        state, integration = self.state, self.integration
        h = dt / integration.count
        told = command.leaves() if self._flat else command.encode()
        if not integration.told and integration.disagrees(state, command, h, told):
            integration.tell(h, dt)
        before = [state[path] for path in POSE] if self.correction else []
        for _ in range(integration.count):
            mean = integration.mean(state, command, h)
            gone = self.advanced(state, command, h) if self.advanced else {}
            self._lead(state, state, mean, h)
            for path, value in gone.items():
                state[path] = _plain(value)
        if self.correction is not None:
            self.correction.add(before, self.command, dt)
        if self.accelerometers:
            self._dt, self.went = dt, self.goes
            self.goes = motion(state, self.rates(state, command))

    def sense(self) -> None:
        """Call the definition's `measure`; the state is that after `drive`."""
        if self.read is not None:
            read = self.read(self.state, self._driven)
            if self.accelerometers:
                felt = feel(self.accelerometers, self.went, self.goes, self._dt)
                read = {**felt, **read}
            self.sensors = {
                path: value if type(value) is float else _plain(value)
                for path, value in read.items()
            }
            if self.shared is not None:
                self.sensors = cast("KinematicWorld", self.shared).see(self)
        self.add_noise()

    def _ahead(self, state: DefDict, rates: Change, h: float) -> DefDict:
        """Return the state after `h` s; fields without a rate stay as they are."""
        refill(self._trial, state)
        self._lead(self._trial, state, rates, h)
        return self._trial

    def _lead(self, to: DefDict, state: DefDict, rates: Change, h: float) -> None:
        """Write the fields after `h` seconds. Raises SchemaError for infinite ones."""
        value, path, rate = 0.0, "", 0.0
        try:
            for path, rate in rates.items():
                value = float(state[path] + h * rate)
                to[path] = value
        except RemsError as error:
            if isfinite(value):
                raise
            raise self.integration.endless(path, rate, h) from error

    @classmethod
    def share(cls, robots: Sequence[Model], scene: Scene) -> "KinematicWorld":
        """Return a world in which walls stop these robots."""
        if scene.mjcf:
            raise SchemaError(NEEDS_MUJOCO)
        # Imported here: a robot without a world needs none of the geometry.
        from rems_net.drivers.kinematic.world import KinematicWorld

        return KinematicWorld(robots, scene)

    @classmethod
    def swarm(cls, robots: Sequence[Robot]) -> Callable[[Tick], None] | None:
        """Return a step for all as arrays; None if their mathematics takes none."""
        made = cls.columns(robots) if len(robots) > 1 else None
        return made.step if made else None

    @classmethod
    def columns(cls, robots: Sequence[Robot]) -> "Swarm | None":
        """Return what computes these robots as arrays; None if arrays do not fit."""
        own = ("step", "obey", "acting", "drive", "sense")
        if any(getattr(cls, name) is not getattr(Kinematic, name) for name in own):
            return None  # the subclass's method does more than the step of arrays
        if any(robot.options["correction"] for robot in robots):
            return None  # each has a memory of its own commands
        verbs = [getattr(cls, name) for name in verb_names(cls)]
        if not all(verb.__module__.startswith("rems_net.") for verb in verbs):
            return None  # a verb of the user's own may change one robot alone

        from rems_net.drivers.kinematic.swarm import Swarm

        kinematic = [r for r in robots if isinstance(r, Model)]
        return Swarm.of(kinematic) if len(kinematic) == len(robots) else None


def _plain(value: Any) -> Any:
    """Return a number of numpy as Python's own; a definition may return either."""
    return value.item() if getattr(value, "shape", None) == () else value
