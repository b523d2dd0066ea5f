"""What a definition says of its devices, found on a robot of Webots."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rems_net.defdict import Field
from rems_net.drivers.webots.actuator import Actuator
from rems_net.drivers.webots.gauge import Gauge
from rems_net.errors import SchemaError, nearest
from rems_net.worlds.devices import Devices, Motor


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
            raise _no_motor(robot, motor, names)
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


def _no_motor(robot: Any, motor: Motor, names: list[str]) -> SchemaError:
    return SchemaError(
        f"{robot.getName()!r} of Webots has no motor {motor.device!r}; it has "
        f"{', '.join(names) or 'none'}.{nearest(motor.device, names)} The names are "
        "those of webots() in the definition: is it another robot? Say which by the "
        "option robot."
    )
