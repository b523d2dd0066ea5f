"""Actuator: a motor of Webots' robot, told the field that it obeys."""

from __future__ import annotations

from math import inf
from typing import Any

from rems_net.defdict import DefDict, Field
from rems_net.worlds.devices import Motor

#: units of a field that says where a motor goes, and not how fast
PLACES = ("rad", "m")


class Actuator:
    """A device, what the definition says of it, and the field.

    goes: whether it is told a place, and not a speed.
    """

    def __init__(self, device: Any, motor: Motor, field: Field):
        self.device, self.motor, self._field = device, motor, field
        self.goes = field.unit in PLACES
        self.begin()

    def begin(self) -> None:
        """Be told a speed from now on, if it is; Webots forgets that in a reset."""
        if not self.goes:
            self.device.setPosition(inf)

    def tell(self, command: DefDict) -> None:
        """Obey from the next step on."""
        motor = self.motor
        value = motor.factor * command[motor.command] + motor.offset
        if not self.goes:
            self.device.setVelocity(value)
            return
        if motor.pace:  # at 0 it holds where it is, wherever it is told to go
            self.device.setVelocity(command[motor.pace] * motor.top)
        self.device.setPosition(value)

    def send(self, target: float) -> None:
        """Go to where the field would be `target`, as fast as it may."""
        motor = self.motor
        self.device.setVelocity(motor.top or self.device.getMaxVelocity())
        self.device.setPosition(motor.factor * target + motor.offset)

    def reckon(self, value: float, command: DefDict, seconds: float) -> float:
        """Return where it should be by now, for one without a sensor."""
        motor, told = self.motor, float(command[self.motor.command])
        if not self.goes:
            return value + told * seconds
        pace = float(command[motor.pace]) * motor.top if motor.pace else inf
        return value + min(max(told - value, -pace * seconds), pace * seconds)

    @property
    def complaint(self) -> str:
        """What is wrong with it there, in a sentence; "" for nothing."""
        low, high = self._field.range or (0.0, 0.0)
        wanted = abs(self.motor.factor) * max(-low, high)
        top = float(self.device.getMaxVelocity())
        if self.goes or wanted <= top:
            return ""
        return (
            f"{self.motor.device!r} of Webots turns at most {top:g} rad/s, and "
            f"{self.motor.command} goes up to {wanted:g}: set its maxVelocity there"
        )
