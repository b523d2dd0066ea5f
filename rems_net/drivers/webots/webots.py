"""Webots: drives a robot in the Webots simulator, as its extern controller.

Written against the documented interface of extern controllers (docs/webots.md), and
tested against a stand-in of it: it has not been run with Webots itself.
"""

import os
from math import ceil
from typing import Any

from rems_net.agents.ports import Settings
from rems_net.agents.robot import Driver
from rems_net.bodies.devices import Devices, InWebots
from rems_net.defdict import DefDict, Field, Schema, text
from rems_net.drivers.needs import missing
from rems_net.drivers.webots import connection, pose
from rems_net.drivers.webots.devices import find
from rems_net.drivers.webots.installation import installed, url
from rems_net.drivers.webots.pose import Placement, coordinate_system
from rems_net.errors import AgentError, SchemaError, uncoded
from rems_net.events import warn
from rems_net.kinematics.rotation import wrapped

#: s between two readings of the heading: no robot turns half round in them
LOOK = 0.1
#: s in which a robot comes to rest at its start, and its joints reach their positions:
#: the same for all robots of a world, since they wait for each other
SETTLE = 1.0
#: name under which Webots saves the state at the start
START = "rems"
#: rad or m. A joint that is further from its start than this is reported.
NEAR = 0.01
POSE = ("x", "y", "heading")


class Webots(Driver):
    """Driver of a robot in a world of Webots, which runs beside it and waits for it.

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
    _place: Placement
    _devices: Devices
    _starts: dict[str, float]
    _yaw = 0.0

    def prepare(self) -> None:
        """Check that Webots is installed, and that the definition fits its devices."""
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
        if port == "command":
            schema = self.motor_schema()
        field = schema.find(path)
        if not isinstance(field, Field):
            raise SchemaError(
                f"{type(self).__name__}: webots() names the field {path!r} of {port}. "
                f"{uncoded(schema.unknown(path))} (R0306)"
            )
        return field

    def open(self) -> None:
        """Connect to the robot in Webots, and put it to its start."""
        super().open()
        robot, first = connection.take(self.key, self._where)
        self._robot = robot
        if not robot.getSupervisor():
            raise AgentError(
                self.key,
                f"in Webots, `supervisor` of {robot.getName()!r} is FALSE, so its "
                "position cannot be read. Set it to TRUE, save the world, and reload "
                "it. (A model without that field: right-click, Convert to Base "
                "Node(s).) (R0315)",
            )
        system = coordinate_system(self.key, robot)
        self._step = float(robot.getBasicTimeStep())  # ms
        if self._step < 1 or self._step % 1:
            raise AgentError(
                self.key,
                f"the world's basicTimeStep is {self._step:g} ms; controllers count in "
                "whole ones. Set it to 1, 2, 4, ... in WorldInfo. (R0315)",
            )
        self._actuators, self._gauges = find(robot, self._devices, self._field)
        self._check()
        for gauge in self._gauges:
            gauge.device.enable(round(self._step))
        self._node = robot.getSelf()
        if not first:
            self._bend()
        self._go_on(1)
        self._place = Placement(self._node, system)
        self._stand()
        self._put()
        for actuator in self._actuators:
            path = actuator.motor.command
            if actuator.goes and path in self.state.schema:
                actuator.send(self.state[path])
        self._go_on(ceil(1000 * SETTLE / self._step))
        self._stand()
        self._starts = self._find_joints()
        if first and self._bends:
            self._node.saveState(START)
        for gauge in self._gauges:
            gauge.mark()
        self._put()
        self._measure()

    def _check(self) -> None:
        """Note motors without sensor; warn of slow motors and fields without device."""
        for actuator in self._actuators:
            if actuator.complaint:
                self._warn(actuator.complaint)
        read = {(g.reading.port, g.reading.field) for g in self._gauges}
        if self._moves:
            read |= {("state", path) for path in POSE}
        self._unseen = {
            a.motor.command: a
            for a in self._actuators
            if a.motor.command in self.state.schema
            and ("state", a.motor.command) not in read
        }
        read |= {("state", path) for path in self._unseen}
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
        """Stop the robot. Webots' world waits until this process has ended."""
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

    def rewind(self) -> None:
        """Put the robot at its initial pose, at rest, from the next step on.

        No step is made here: a step would wait for all other robots of the world.
        Other objects in the world stay as they are.
        """
        super().rewind()
        if self._robot is not None:
            self._bend()
            self.state = self._starts
            self._put(marked=self._bends)

    def drive(self, command: DefDict, dt: float) -> None:
        """Set the motors, and let Webots make the whole steps nearest to `dt`."""
        self._tell(command)
        # With steps of 3 ms, 0.1 s is 33 steps, and every third time 34.
        self._left += 1000 * dt
        count = round(self._left / self._step)
        self._left -= count * self._step
        most = max(1, int(1000 * LOOK / self._step))
        for done in range(0, count, most):
            self._go_on(min(most, count - done))
            self._follow()
        seconds = count * self._step / 1000
        words = self.motor_command(command)
        for path, actuator in self._unseen.items():
            self.state[path] = actuator.reckon(self.state[path], words, seconds)

    def sense(self) -> None:
        """Read pose and sensors from Webots."""
        if self._moves:
            at = pose.origin(*self._place.read(), self._devices)
            self.state["x"], self.state["y"] = float(at[0]), float(at[1])
        self._measure()

    def _tell(self, command: DefDict) -> None:
        words = self.motor_command(command)
        for actuator in self._actuators:
            actuator.tell(words)

    def _go_on(self, count: int) -> None:
        if self._robot.step(count * round(self._step)) == -1:
            raise AgentError(
                self.key,
                "Webots has ended this robot's controller: it was closed, its world "
                "reloaded or reset. Start the experiment again. (R0315)",
            )

    def _follow(self) -> None:
        """Add up the turned angle: Webots knows the heading only within one turn."""
        if self._moves:
            yaw = pose.heading(self._place.read()[1], self._devices)
            self.state["heading"] += wrapped(yaw - self._yaw)
            self._yaw = yaw

    def _measure(self) -> None:
        for gauge in self._gauges:
            value = gauge.read()
            if value is not None:
                getattr(self, gauge.reading.port)[gauge.reading.field] = value

    @property
    def _moves(self) -> bool:
        """Whether the state has the robot's pose."""
        return all(path in self.state.schema for path in POSE)

    def _stand(self) -> None:
        """Remember the robot's rotation and height, standing."""
        position, self._upright = self._place.read()
        self._height = float(pose.origin(position, self._upright, self._devices)[2])

    def _put(self, *, marked: bool = False) -> None:
        """Put the robot at the state's pose, at rest, from the next step on.

        marked: its joints and wheels were put back, too
        """
        self._tell(self.command.schema())
        self._left = 0.0
        for gauge in self._gauges:
            port = getattr(self, gauge.reading.port)
            gauge.begin(port[gauge.reading.field], marked=marked)
        if not self._moves:
            return
        x, y, heading = (self.state[path] for path in POSE)
        position, rotation = pose.placed(
            x, y, heading, self._height, self._upright, self._devices
        )
        self._place.write(position, rotation)
        self._yaw = wrapped(heading)

    @property
    def _bends(self) -> bool:
        """Whether the robot has joints whose command is a position."""
        return any(actuator.goes for actuator in self._actuators)

    def _bend(self) -> None:
        """Put the joints back to their saved positions."""
        if self._bends:
            self._node.loadState(START)
            for actuator in self._actuators:
                actuator.begin()

    def _find_joints(self) -> dict[str, float]:
        """Return the joints' positions, and warn of those not at their start."""
        found: dict[str, float] = {}
        for gauge in self._gauges:
            reading, there = gauge.reading, gauge.read()
            if reading.port != "state" or reading.counted or there is None:
                continue
            found[reading.field] = there
            start = self.state[reading.field]
            if abs(there - start) > NEAR:
                self._warn(
                    f"{reading.field} starts at {there:.3g}, not at {start:.3g}: it "
                    f"had {SETTLE:g} s to get there. Move the joint in Webots' world"
                )
        return found

    def _warn(self, sentence: str) -> None:
        warn("device", f"{self.key}: {sentence}", self.key)
