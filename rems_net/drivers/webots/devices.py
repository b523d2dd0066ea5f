"""Devices of a robot of Webots, as its definition says what they are called there.

An actuator is a motor that is told the field it obeys; a gauge is a sensor that is read
as the field it fills.
"""

from collections.abc import Callable
from math import inf, isnan, nan
from typing import Any

import numpy as np

from rems_net.bodies.devices import Devices, Motor, Reading
from rems_net.defdict import DefDict, Field
from rems_net.errors import SchemaError, nearest

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


class Gauge:
    """A device, what the definition says of it, and the field."""

    def __init__(self, device: Any, reading: Reading, field: Field):
        self.device, self.reading, self._field = device, reading, field
        self._table = np.array(sorted(reading.table)).T
        self._from = self._base = 0.0
        self._mark = nan

    def mark(self) -> None:
        """Remember what it shows, since it will be put back to that."""
        self._mark = self._number()

    def begin(self, value: float, *, marked: bool = False) -> None:
        """Count from here on: what it shows now is `value` of the field.

        marked: it was put back, and will show what was remembered from the next step on
        """
        number = self._mark if marked else self._number()
        if self.reading.counted and not isnan(number):
            self._from, self._base = value, number

    def read(self) -> float | bool | None:
        """Return the field's value; None where the device shows none."""
        reading = self.reading
        number = self._number()
        if isnan(number):
            return None  # of an axis that is switched off
        if reading.counted:
            passed = reading.factor * (number - self._base)
            # Its last digits tell how far it had turned before: no two runs agree.
            value = self._from + round(passed, 9)
        elif reading.table:
            value = float(np.interp(number, *self._table))
        else:
            value = reading.factor * number + reading.offset
        if self._field.dtype == "bool":
            return value > 0.5
        low, high = self._field.limits
        # Webots adds noise to what is read at the ends of a range, too.
        return min(max(round(value) if self._field.whole else value, low), high)

    def _number(self) -> float:
        part = self.reading.part
        if part is None:
            return float(self.device.getValue())
        return float(self.device.getValues()[part])


def find(
    robot: Any, devices: Devices, field: Callable[[str, str], Field]
) -> tuple[list[Actuator], list[Gauge]]:
    """Return its motors, and those of its readings that a device is there for.

    field: what tells a field by port and path. Raises SchemaError for a motor that is
    not there.
    """
    count = robot.getNumberOfDevices()
    names = [robot.getDeviceByIndex(i).getName() for i in range(count)]
    for motor in devices.motors:
        if motor.device not in names:
            raise SchemaError(
                f"{robot.getName()!r} of Webots has no motor {motor.device!r}; it has "
                f"{', '.join(names) or 'none'}.{nearest(motor.device, names)} The "
                "names are those of webots() in the definition: is it another robot? "
                "Say which by the option robot."
            )
    actuators = [
        Actuator(robot.getDevice(m.device), m, field("command", m.command))
        for m in devices.motors
    ]
    gauges = [
        Gauge(robot.getDevice(r.device), r, field(r.port, r.field))
        for r in devices.readings
        if r.device in names
    ]
    return actuators, gauges
