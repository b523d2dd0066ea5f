"""Devices of a robot in Webots, by the names that its definition gives.

An actuator is a motor that obeys a field of the command; a gauge is a sensor that sets
a field.
"""

from collections.abc import Callable
from math import inf, isnan, nan
from typing import Any

import numpy as np

from rems_net.bodies.devices import Devices, Motor, Reading
from rems_net.defdict import DefDict, Field
from rems_net.errors import SchemaError, nearest

#: units of a field that is a motor's position, not its speed
PLACES = ("rad", "m")


class Actuator:
    """A motor of Webots, its entry in the definition, and its field.

    goes: whether the field is a position, not a speed.
    """

    def __init__(self, device: Any, motor: Motor, field: Field):
        self.device, self.motor, self._field = device, motor, field
        self.goes = field.unit in PLACES
        self.begin()

    def begin(self) -> None:
        """Switch the motor to speed control if needed; a reset of Webots undoes it."""
        if not self.goes:
            self.device.setPosition(inf)

    def tell(self, command: DefDict) -> None:
        """Set the motor's target from the command, for the next steps."""
        motor = self.motor
        value = motor.factor * command[motor.command] + motor.offset
        if not self.goes:
            self.device.setVelocity(value)
            return
        if motor.pace:  # at 0 it holds its position, at any target
            self.device.setVelocity(command[motor.pace] * motor.top)
        self.device.setPosition(value)

    def send(self, target: float) -> None:
        """Move to where the field would be `target`, at the motor's top speed."""
        motor = self.motor
        self.device.setVelocity(motor.top or self.device.getMaxVelocity())
        self.device.setPosition(motor.factor * target + motor.offset)

    def reckon(self, value: float, command: DefDict, seconds: float) -> float:
        """Return the position expected after `seconds`; for a motor without sensor."""
        motor, told = self.motor, float(command[self.motor.command])
        if not self.goes:
            return value + told * seconds
        pace = float(command[motor.pace]) * motor.top if motor.pace else inf
        return value + min(max(told - value, -pace * seconds), pace * seconds)

    @property
    def complaint(self) -> str:
        """Why the motor in Webots cannot obey, in a sentence; "" if it can."""
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
    """A sensor of Webots, its entry in the definition, and its field."""

    def __init__(self, device: Any, reading: Reading, field: Field):
        self.device, self.reading, self._field = device, reading, field
        self._table = np.array(sorted(reading.table)).T
        self._from = self._base = 0.0
        self._mark = nan

    def mark(self) -> None:
        """Remember the sensor's present value: it will be put back to that."""
        self._mark = self._number()

    def begin(self, value: float, *, marked: bool = False) -> None:
        """Count from here on: the sensor's present value means `value` of the field.

        marked: the sensor was put back, and shows the remembered value after a step
        """
        number = self._mark if marked else self._number()
        if self.reading.counted and not isnan(number):
            self._from, self._base = value, number

    def read(self) -> float | bool | None:
        """Return the field's value; None if the device has none."""
        reading = self.reading
        number = self._number()
        if isnan(number):
            return None  # the sensor's axis is switched off
        if reading.counted:
            passed = reading.factor * (number - self._base)
            # The last digits depend on the turns before a reset: runs would differ.
            value = self._from + round(passed, 9)
        elif reading.table:
            value = float(np.interp(number, *self._table))
        else:
            value = reading.factor * number + reading.offset
        if self._field.dtype == "bool":
            return value > 0.5
        low, high = self._field.limits
        # Webots adds noise beyond the ends of a range, too.
        return min(max(round(value) if self._field.whole else value, low), high)

    def _number(self) -> float:
        part = self.reading.part
        if part is None:
            return float(self.device.getValue())
        return float(self.device.getValues()[part])


def find(
    robot: Any, devices: Devices, field: Callable[[str, str], Field]
) -> tuple[list[Actuator], list[Gauge]]:
    """Return the robot's motors, and its readings for which there is a device.

    field: returns a field by port and path. Raises SchemaError for a motor that is
    missing in Webots.
    """
    count = robot.getNumberOfDevices()
    names = [robot.getDeviceByIndex(i).getName() for i in range(count)]
    for motor in devices.motors:
        if motor.device not in names:
            raise SchemaError(
                f"{robot.getName()!r} of Webots has no motor {motor.device!r}; it has "
                f"{', '.join(names) or 'none'}.{nearest(motor.device, names)} The "
                "names are those of webots() in the definition: is it another robot? "
                "Name it by the option robot. (R0315)"
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
