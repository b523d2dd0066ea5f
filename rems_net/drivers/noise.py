"""Noise of simulated sensors: the definition says how much, an option asks for it."""

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

from rems_net.agents.ports import Settings
from rems_net.agents.robot import Driver
from rems_net.agents.runtime import runtime
from rems_net.bodies.noise import Noise, Noisy
from rems_net.defdict import Schema, boolean
from rems_net.drivers.needs import missing

#: an option of every driver that is `Simulated`
NOISE = boolean(default=False, doc="sensors with the noise that the definition states")


@runtime_checkable
class Noised(Protocol):
    """A definition that says how far its sensors are from the truth."""

    def noise(self) -> Mapping[str, Noise]:
        """How far, by path of the sensors, or by a glob such as "lidar/*"."""


class Simulated(Driver):
    """A driver that knows what the sensors would read, and adds noise on request."""

    options = Settings(noise=NOISE)
    _noisy: Noisy | None = None

    def prepare(self) -> None:
        """Check that the definition says how much noise there is, if it is wanted."""
        senses = type(self).sensors.schema_for(self.parameters) is not None
        if self.options["noise"] and senses and not isinstance(self, Noised):
            raise missing(
                self,
                "noise()",
                "how far its sensors are from the truth",
                "def noise(self):\n"
                '        return {"range": Noise(relative=0.04)}  # standard deviation',
            )
        super().prepare()
        self.begin_noise()  # refuses what it says of sensors that are not there

    def rewind(self) -> None:
        """Begin again, with the same noise."""
        super().rewind()
        self.begin_noise()

    def begin_noise(self) -> None:
        """Let the noise be what it was at the start."""
        self._noisy = None
        if self.options["noise"] and isinstance(self, Noised):
            schema = self.schemas().get("sensors", Schema("sensors"))
            seed = f"{runtime(self).seed} {self.key} noise"
            self._noisy = Noisy(schema, self.noise(), seed)

    def add_noise(self) -> None:
        """Add it to what the sensors read, if it is wanted."""
        if self._noisy is not None:
            self._noisy.add(self.sensors)
