"""Simulated: the common part of drivers whose motors and sensors are computed.

The definition states how motors follow their command and how sensors deviate; an
option switches the noise on.
"""

import re
from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

from rems_net.agents.ports import Settings
from rems_net.agents.robot import Driver
from rems_net.agents.runtime import runtime
from rems_net.bodies.actuators import Actuators
from rems_net.bodies.noise import Noise, Noisy, read_noises
from rems_net.defdict import DefDict, Field, Schema, boolean, text
from rems_net.drivers.needs import missing
from rems_net.errors import ExperimentError
from rems_net.toml import TOMLDecodeError, loads

#: A path of several names, which TOML takes only in quotes.
_PATH = re.compile(r"(?<![\w\"'/])([\w.-]+(?:/[\w.-]+)+)(?=\s*=)")
#: options of every driver that is `Simulated`
NOISE: dict[str, Field | Schema] = {
    "noise": boolean(default=False, doc="sensors with noise, as the definition has it"),
    "noises": text(
        max_len=4096, doc="noise in place of that: gyro/z = { absolute = 0.01 }"
    ),
}


def table(given: str, name: str) -> dict[str, Any]:
    """Return the values of an option that is a line of TOML. Raises ExperimentError."""
    quoted = _PATH.sub(r'"\1"', given)
    try:
        return dict(loads(f"all = {{ {quoted} }}")["all"])
    except TOMLDecodeError as error:
        raise ExperimentError(
            f"{name} = {given!r:.80} cannot be read ({error}); write such as "
            "'x = \"10 mm\", heading = 0.1'. (R0881)"
        ) from None


@runtime_checkable
class Noised(Protocol):
    """A definition that states the noise of its sensors."""

    def noise(self) -> Mapping[str, Noise]:
        """Return the noise by path of the sensors, or by a glob such as "lidar/*"."""


class Simulated(Driver):
    """A driver that computes the sensors' true values, and adds noise on request.

    Its motors follow the command as the parameters `actuation/...` state.
    """

    options = Settings(NOISE)
    _noisy: Noisy | None = None
    #: None if the motors do at once what is commanded
    _actuators: Actuators | None = None

    def prepare(self) -> None:
        """Check that the definition states its noise, if the option asks for it."""
        senses = type(self).sensors.schema_for(self.parameters) is not None
        stated = isinstance(self, Noised) or self.noises()
        if self.options["noise"] and senses and not stated:
            raise missing(
                self,
                "noise()",
                "how far its sensors are from the truth",
                "def noise(self):\n"
                '        return {"range": Noise(relative=0.04)}  # standard deviation',
            )
        super().prepare()
        self.begin_noise()  # raises an error for noise of a missing sensor

    def rewind(self) -> None:
        """Start again, with motors at rest and the same noise."""
        super().rewind()
        self._actuators = Actuators.of(self.parameters, self.command)
        self.begin_noise()

    def acting(self, dt: float) -> DefDict:
        """Return what the motors make of the command in the next `dt` seconds."""
        motors, command = self._actuators, self.command
        return command if motors is None else motors.acting(command, dt)

    def noises(self) -> dict[str, Noise]:
        """Return the noise that the definition states, and what replaces it."""
        own = dict(self.noise()) if isinstance(self, Noised) else {}
        given = table(self.options["noises"], "noises")
        return own | read_noises(given, "option noises")

    def begin_noise(self) -> None:
        """Start the noise anew: the same numbers as at the start."""
        self._noisy = None
        if self.options["noise"] and (found := self.noises()):
            schema = self.schemas().get("sensors", Schema("sensors"))
            seed = f"{runtime(self).seed} {self.key} noise"
            self._noisy = Noisy(schema, found, seed)

    def add_noise(self) -> None:
        """Add noise to the sensors, if the option asks for it."""
        if self._noisy is not None:
            self._noisy.add(self.sensors)
