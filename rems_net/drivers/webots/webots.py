"""Webots: a robot done by the Webots simulator, as its extern controller.

Written against the documented interface of extern controllers (docs/webots.md), and
tested against a stand-in of it: it has not been run with Webots itself.
"""

from __future__ import annotations

import os
import sys
from math import ceil
from typing import Any

import numpy as np

from rems_net.agents.ports import Settings
from rems_net.agents.robot import Driver
from rems_net.defdict import DefDict, Field, Schema, text
from rems_net.drivers.needs import missing
from rems_net.drivers.webots import connection, pose
from rems_net.drivers.webots.actuator import Actuator
from rems_net.drivers.webots.gauge import Gauge
from rems_net.drivers.webots.installation import installed, url
from rems_net.errors import AgentError, SchemaError, nearest
from rems_net.worlds.devices import Devices, InWebots, Motor
from rems_net.worlds.parts import Array

#: s between two looks at the heading: no robot turns half round in them
LOOK = 0.1
#: s that a robot is left alone to settle where it was put
SETTLE = 0.5
#: how far a joint may be from where it starts, rad or m
NEAR = 0.01
POSE = ("x", "y", "heading")


class Webots(Driver):
    """Moves a robot in a world of Webots, which runs beside it and waits for it.

    In Webots the robot's controller is `<extern>`, and its supervisor TRUE. A process
    can have one robot there, as it has without `host`. Not yet run with Webots itself.
    """

    options = Settings(
        robot=text(doc="its name in Webots' world; empty for the only one"),
        url=text(doc="tcp://192.168.1.2:1234 of another computer; empty for this one"),
    )

    one_per_process = True
    _robot: Any = None
    _node: Any = None
    _devices: Devices
    _yaw = 0.0

    def prepare(self) -> None:
        """Check that Webots is here, and that the definition knows its devices."""
        if not isinstance(self, InWebots):
            raise missing(
                self,
                "webots()",
                "what its motors and sensors are called there",
                "def webots(self):\n        return "
                'Devices(motors=(Motor("left wheel", "wheel/left"),))',
            )
        self._devices = self.webots()
        self._where = url(self.options.url, self.options.robot)
        installed(os.environ)
        super().prepare()
        for motor in self._devices.motors:
            for path in (motor.command, motor.pace) if motor.pace else (motor.command,):
                self._field("command", path)
        for reading in self._devices.readings:
            self._field(reading.port, reading.field)

    def _field(self, port: str, path: str) -> Field:
        schema = self.schemas().get(port, Schema(f"{self.name}.{port}"))
        field = schema.find(path)
        if not isinstance(field, Field):
            raise SchemaError(
                f"{type(self).__name__}: webots() names the field {path!r} of {port}. "
                f"{schema.unknown(path)}"
            )
        return field

    # -- there and back ----------------------------------------------------------

    def open(self) -> None:
        """Reach the robot in Webots, and put it to where the experiment starts."""
        super().open()
        robot = connection.take(self.key, self._where)
        self._robot = robot
        if not robot.getSupervisor():
            raise AgentError(
                self.key,
                f"in Webots, `supervisor` of {robot.getName()!r} is FALSE, so nobody "
                "may ask where it is. Set it to TRUE, save the world, and reload it. "
                "(A model without that field: right-click, Convert to Base Node(s).)",
            )
        self._step = float(robot.getBasicTimeStep())  # ms
        if self._step < 1 or self._step % 1:
            raise AgentError(
                self.key,
                f"the world's basicTimeStep is {self._step:g} ms; controllers count in "
                "whole ones. Set it to 1, 2, 4, ... in WorldInfo.",
            )
        devices = self._devices
        names = self._names()
        self._actuators = [self._actuator(m, names) for m in devices.motors]
        self._gauges = [
            Gauge(robot.getDevice(r.device), r, self._field(r.port, r.field))
            for r in devices.readings
            if r.device in names
        ]
        self._check_readings()
        for gauge in self._gauges:
            gauge.device.enable(round(self._step))
        self._node = robot.getSelf()
        self._go_on(1)
        self._stand()
        self._put()
        self._go_on(ceil(1000 * SETTLE / self._step))
        self._stand()
        self._check_joints()
        self._put()
        self._measure()

    def _names(self) -> list[str]:
        """What the devices of the robot are called."""
        count = self._robot.getNumberOfDevices()
        return [self._robot.getDeviceByIndex(i).getName() for i in range(count)]

    def _actuator(self, motor: Motor, names: list[str]) -> Actuator:
        if motor.device not in names:
            raise AgentError(
                self.key,
                f"{self._robot.getName()!r} of Webots has no motor {motor.device!r}; "
                f"it has {', '.join(names) or 'none'}.{nearest(motor.device, names)} "
                f"The names are those of webots() in {type(self).__name__}: is it "
                "another robot? Say which by the option robot.",
            )
        device = self._robot.getDevice(motor.device)
        made = Actuator(device, motor, self._field("command", motor.command))
        if made.complaint:
            self._warn(made.complaint)
        return made

    def _check_readings(self) -> None:
        """Find wheels without a sensor, which are counted; warn of all else."""
        read = {(g.reading.port, g.reading.field) for g in self._gauges}
        if self._moves:
            read |= {("state", path) for path in POSE}
        turned = {a.motor.command for a in self._actuators if not a.goes}
        self._counted = [
            path
            for path in self.state.schema.paths
            if path in turned and ("state", path) not in read
        ]
        read |= {("state", path) for path in self._counted}
        unread = [
            f"{port}/{path}"
            for port, schema in self.published().items()
            for path in schema.paths
            if port != "command" and (port, path) not in read
        ]
        if unread:
            self._warn(
                f"no device of Webots' robot measures {', '.join(unread)}: they stay "
                "as they are"
            )

    def close(self) -> None:
        """Have it stand. Webots' world waits until this process has ended."""
        robot = self._robot
        if robot is not None:
            try:
                if self._node is not None:
                    self._tell(self.command.schema())
                    robot.step(round(self._step))
            finally:
                self._robot = self._node = None
                connection.leave()
        super().close()

    # -- a step ------------------------------------------------------------------

    def reset(self) -> None:
        """Go back to the initial pose, at rest; joints and the world stay as they are.

        It takes no step: that would wait for all other robots of the world.
        """
        super().reset()
        if self._robot is not None:
            self._put()
            for gauge in self._gauges:
                if gauge.reading.port == "state":
                    self._take(gauge)

    def drive(self, command: DefDict, dt: float) -> None:
        """Tell the motors, and let Webots take the whole steps nearest to `dt`."""
        self._tell(command)
        # In a world of 3 ms, 0.1 s is 33 steps, and every third time 34.
        self._left += 1000 * dt
        count = round(self._left / self._step)
        self._left -= count * self._step
        most = max(1, int(1000 * LOOK / self._step))
        for done in range(0, count, most):
            self._go_on(min(most, count - done))
            self._follow()
        for path in self._counted:
            self.state[path] += command[path] * count * self._step / 1000

    def sense(self) -> None:
        """Read where it is, and its sensors."""
        if self._moves:
            at = pose.origin(*self._look(), self._devices)
            self.state["x"], self.state["y"] = float(at[0]), float(at[1])
        self._measure()

    def _tell(self, command: DefDict) -> None:
        for actuator in self._actuators:
            actuator.tell(command)

    def _go_on(self, count: int) -> None:
        if self._robot.step(count * round(self._step)) == -1:
            raise AgentError(
                self.key,
                "Webots has ended this robot's controller: it was closed, its world "
                "reloaded or reset. Start the experiment again.",
            )

    def _look(self) -> tuple[Array, Array]:
        """Return position and rotation of the model, in Webots' world."""
        rotation = np.array(self._node.getOrientation(), dtype=float).reshape(3, 3)
        return np.array(self._node.getPosition(), dtype=float), rotation

    def _follow(self) -> None:
        """Keep count of the heading, which Webots knows only within one turn."""
        if self._moves:
            yaw = pose.heading(self._look()[1], self._devices)
            self.state["heading"] += pose.wrap(yaw - self._yaw)
            self._yaw = yaw

    def _measure(self) -> None:
        for gauge in self._gauges:
            self._take(gauge)

    def _take(self, gauge: Gauge) -> None:
        value = gauge.read()
        if value is not None:
            getattr(self, gauge.reading.port)[gauge.reading.field] = value

    # -- its place ---------------------------------------------------------------

    @property
    def _moves(self) -> bool:
        """Whether its state says where it is."""
        return all(path in self.state.schema for path in POSE)

    def _stand(self) -> None:
        """Remember how it stands, and how high."""
        position, self._upright = self._look()
        self._height = float(pose.origin(position, self._upright, self._devices)[2])

    def _put(self) -> None:
        """Put it to where its state says, at rest, from the next step on."""
        self._tell(self.command.schema())
        self._left = 0.0
        for gauge in self._gauges:
            port = getattr(self, gauge.reading.port)
            gauge.begin(port[gauge.reading.field])
        if not self._moves:
            return
        x, y, heading = (self.state[path] for path in POSE)
        position, rotation = pose.placed(
            x, y, heading, self._height, self._upright, self._devices
        )
        self._node.getField("translation").setSFVec3f(position.tolist())
        self._node.getField("rotation").setSFRotation(pose.axis_angle(rotation))
        self._node.resetPhysics()
        self._yaw = pose.wrap(heading)

    def _check_joints(self) -> None:
        """Warn of joints that are not where the state starts: nobody can put them."""
        for gauge in self._gauges:
            reading = gauge.reading
            there = gauge.read()
            if reading.port == "state" and not reading.counted and there is not None:
                start = self.state[reading.field]
                if abs(there - start) > NEAR:
                    self._warn(
                        f"{reading.field} starts at {there:.3g}, as in Webots' world, "
                        f"and not at {start:.3g}: move the joint there"
                    )

    def _warn(self, sentence: str) -> None:
        print(f"warning: {self.key}: {sentence}", file=sys.stderr, flush=True)
