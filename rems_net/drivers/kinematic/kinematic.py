"""Kinematic: a robot done by integrating its definition's own mathematics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, cast

from rems_net.agents.robot import Robot
from rems_net.agents.tick import Tick
from rems_net.defdict import DefDict
from rems_net.drivers.kinematic.model import Change, Model, feel, mean_rates, motion
from rems_net.drivers.needs import NEEDS_MUJOCO
from rems_net.errors import SchemaError
from rems_net.worlds.scenes.scene import Scene

if TYPE_CHECKING:
    from rems_net.drivers.kinematic.world import KinematicWorld


class Kinematic(Model):
    """Integrates `derivative(state, command)`; senses by `measure(state, command)`.

    Fields that `advance(state, command, dt)` gives, where there is one, are afterwards
    where it says: joints that go to a target and halt there, at any step. A field of
    the state that neither gives stays as it is. `euler` takes the rate
    at the beginning of a step for all of it, as the class's model does; `rk4` (Runge
    and Kutta's four rates) follows a curve far closer. `substeps` divides the step.
    """

    def rewind(self) -> None:
        """Go back to the initial state."""
        super().rewind()
        self._driven, self._dt = self.command, 0.0
        self.halt()
        self._trial = self.state.schema()
        rates = self.rates(self.state, self.command)
        # Refuses fields that the state does not have.
        self._ahead(self.state, rates, 0.0)
        if self.advanced is not None:
            self._trial.update(self.advanced(self.state, self.command, 0.0))
        self.sense()
        self.begin_noise()

    def drive(self, command: DefDict, dt: float) -> None:
        """Integrate over `dt` seconds."""
        self._driven = command
        state, count = self.state, self.options["substeps"]
        h = dt / count
        for _ in range(count):
            mean = mean_rates(self, state, command, h, self._ahead)
            gone = self.advanced(state, command, h) if self.advanced else {}
            for path, rate in mean.items():
                state[path] = float(state[path] + h * rate)
            for path, value in gone.items():
                state[path] = _plain(value)
        if self.accelerometers:
            self._dt, self.went = dt, self.goes
            self.goes = motion(state, self.rates(state, command))

    def sense(self) -> None:
        """Let the definition measure; the state is already where `drive` left it."""
        if self.read is not None:
            read = self.read(self.state, self._driven)
            if self.accelerometers:
                felt = feel(self.accelerometers, self.went, self.goes, self._dt)
                read = {**felt, **read}
            self.sensors = {path: _plain(value) for path, value in read.items()}
            if self.shared is not None:
                self.sensors = cast("KinematicWorld", self.shared).see(self)
        self.add_noise()

    def _ahead(self, state: DefDict, rates: Change, h: float) -> DefDict:
        """Return the state that these rates lead to; what has none stays as it is."""
        self._trial.update(state)
        for path, rate in rates.items():
            self._trial[path] = float(state[path] + h * rate)
        return self._trial

    @classmethod
    def share(cls, robots: Sequence[Model], scene: Scene) -> KinematicWorld:
        """Return a place whose walls stop these robots."""
        if scene.mjcf:
            raise SchemaError(NEEDS_MUJOCO)
        # Here: a robot that is alone needs none of the geometry.
        from rems_net.drivers.kinematic.world import KinematicWorld

        return KinematicWorld(robots, scene)

    @classmethod
    def swarm(cls, robots: Sequence[Robot]) -> Callable[[Tick], None] | None:
        """Step them as arrays, where the definition's mathematics takes arrays."""
        own = ("step", "obey", "drive", "sense")
        if any(getattr(cls, name) is not getattr(Kinematic, name) for name in own):
            return None  # a subclass does more in it than arrays do

        from rems_net.drivers.kinematic.swarm import Swarm

        kinematic = [r for r in robots if isinstance(r, Model)]
        made = Swarm.of(kinematic) if len(kinematic) == len(robots) > 1 else None
        return made.step if made else None


def _plain(value: Any) -> Any:
    """A number of numpy's as Python's own; a definition may compute with either."""
    return value.item() if getattr(value, "shape", None) == () else value
