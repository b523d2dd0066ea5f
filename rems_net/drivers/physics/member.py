"""Member: one robot in an engine's world: its start, its pose, its measurements."""

from collections.abc import Sequence
from functools import cache, cached_property
from typing import Any

from rems_net.agents.robot import Robot
from rems_net.agents.runtime import runtime
from rems_net.bodies.body import Accelerometer, Body, Camera, Encoder, Tachometer
from rems_net.bodies.tree import Tree
from rems_net.defdict import DefDict
from rems_net.drivers.acceleration import felt
from rems_net.drivers.physics.engine import Instance
from rems_net.drivers.physics.pictures.looks import cameras
from rems_net.drivers.physics.pictures.optics import Chip
from rems_net.drivers.physics.reading import Moment, Reader, reader
from rems_net.errors import AgentError
from rems_net.kinematics.rotation import wrapped
from rems_net.maths import atan2
from rems_net.scenes.outline import Outline, of_body

#: Physics steps between two readings of the heading: no robot turns half round in them.
LOOK = 50
#: The same for a robot with servos: their speeds are computed anew this often.
ASK = 5
#: Fields of the state that are the robot's pose, m and rad.
POSE = ("x", "y", "heading")
#: s. A servo's setpoint is at most this far ahead of its joint, at the servo's speed:
#: a joint that was blocked does not jump when it comes free.
LEAD = 0.2


class Member:
    """One robot of a physics world: keeps its state and sensors equal to its body's."""

    #: the newest values of the world, and the robot's index in them
    _now: Moment
    _n: int
    _state: DefDict
    _sensors: DefDict

    def __init__(self, robot: Robot, body: Body):
        self.robot, self.body = robot, body
        self.tree = tree = Tree(body)
        driven = [tree.links[n] for n in tree.motors]
        #: the command's field and the gear ratio of each motor
        self._motors = _alike(*((link.joint.obeys, link.ratio) for link in driven))
        #: the motors that have a servo: motor's number, joint's number, servo
        self.servos = tuple(
            (motor, tree.motors[motor], link.joint.servo)
            for motor, link in enumerate(driven)
            if link.joint.servo
        )
        #: the setpoint of each servo, rad or m
        self._asked: list[float] = []
        #: physics steps between two updates of servos and heading
        self.look_every = ASK if self.servos else LOOK
        self._positions = tuple(
            (link.joint.position, n, link.ratio)
            for n, link in enumerate(tree.links)
            if link.joint.position
        )
        self._walks = not body.fixed
        #: whether the robot has accelerometers
        self.feels = any(isinstance(one, Accelerometer) for one in body.sensors)
        #: its last velocity in its own frame, m/s
        self._went: Sequence[float] = (0.0, 0.0, 0.0)
        #: whether the engine must be asked for the joints' positions
        self._bends = bool(self._positions) or any(
            isinstance(one, Encoder | Tachometer) for one in body.sensors
        )
        self._readers: tuple[tuple[str, Reader], ...] = ()
        self._cameras: tuple[tuple[Camera, Reader], ...] = ()
        #: the cameras' chips by name, if the robot's option asks for noise
        self._chips: dict[str, Chip] = {}
        #: number of measurements since the last reset
        self._steps = 0
        self._instance: Instance | None = None
        self._yaw = 0.0

    @property
    def instance(self) -> Instance:
        """The robot's body in the engine. Raises AgentError before `open`."""
        if self._instance is None:
            raise AgentError(
                self.robot.key, "it has no world yet: call open() first. (R0313)"
            )
        return self._instance

    @cached_property
    def outline(self) -> Outline:
        """The shapes of the robot that can touch others, computed once."""
        return of_body(self.body)

    def enter(self, instance: Instance, now: Moment, n: int) -> None:
        """Take `instance` as the robot's body, and `n` as its number in the world."""
        self._instance, self._now, self._n = instance, now, n
        read = {one.name: reader(one, self.tree, now, n) for one in self.body.sensors}
        self._cameras = tuple((one, read.pop(one.name)) for one in cameras([self.body]))
        self._readers = _alike(*read.items())
        self._state = self.robot.state
        self._sensors = self.robot.sensors if self.body.sensors else self._state

    def leave(self) -> None:
        """Forget the body: the world is closed."""
        self._instance = None
        self._readers = self._cameras = ()

    def targets(self, command: DefDict) -> list[float]:
        """Return the motors' commands in the order of the tree, then servos' speeds."""
        words = self.robot.motor_command(command)
        told = [words[path] * ratio for path, ratio in self._motors]
        for _, _, servo in self.servos:
            share = command[servo.share] if servo.share else 1.0
            told.append(share * servo.speed)
        return told

    def rest(self) -> list[float]:
        """Return the motors' commands that keep the robot at its state."""
        targets = self.targets(self.robot.command.schema())
        for number, (motor, _, _) in enumerate(self.servos):
            targets[motor] = self._asked[number]
        return targets

    def told(self, targets: Sequence[float], dt: float) -> list[float]:
        """Return motor speeds for the next `dt` seconds that move servos to goals."""
        now, _ = self.instance.joints()
        count = len(self._motors)
        told = list(targets[:count])
        for number, (motor, joint, servo) in enumerate(self.servos):
            most, lead = targets[count + number] * dt, servo.speed * LEAD
            asked = _near(self._asked[number], now[joint], lead)
            goal = _near(told[motor], asked, most)
            told[motor] = (goal - asked) / dt + servo.gain * (asked - now[joint])
            self._asked[number] = goal
        return told

    @property
    def posed(self) -> bool:
        """Whether the state has the robot's pose; if not, its `place` is the pose."""
        return not self.body.fixed or set(POSE) <= set(self.robot.state.schema.paths)

    def start(self) -> tuple[float, ...]:
        """Return the state's pose (x and y in m, heading in rad) and joints."""
        pose = POSE if self.posed else ()
        joints = (path for path, _, _ in self._positions)
        return tuple(self.robot.state[path] for path in (*pose, *joints))

    def where(self) -> tuple[float, float, float]:
        """Return the state's pose: x and y in m, heading in rad."""
        return self._pose(self.robot.state)

    def beginning(self) -> tuple[float, float, float]:
        """Return the pose after a reset: x and y in m, heading in rad."""
        return self._pose(self.robot.begins())

    def _pose(self, state: DefDict) -> tuple[float, float, float]:
        if not self.posed:
            return self.robot.place
        return state["x"], state["y"], state["heading"]

    def place(self) -> None:
        """Move the body and its joints to the pose in the state."""
        state, (x, y, heading) = self.robot.state, self.where()
        if self.posed or any(self.robot.place):
            position = self._now.positions[self._n]
            shift = (x - position[0], y - position[1], 0.0)
            self.instance.move(shift, wrapped(heading - self._heads()))
        if self._positions:
            wanted = {n: state[path] * ratio for path, n, ratio in self._positions}
            self.instance.bend(self.tree.closed(wanted))
        self._hold()

    def _hold(self) -> None:
        """Set each servo's setpoint to its joint's present position."""
        now, _ = self.instance.joints()
        self._asked = [now[joint] for _, joint, _ in self.servos]

    def look(self) -> None:
        """Start counting the heading, hold the joints, and measure once."""
        self._hold()
        self._yaw = self._heads()
        if self.feels:
            self.feel(0.0)
        self._steps = 0
        if self.robot.options.get("noise"):
            seed = f"{runtime(self.robot).seed} {self.robot.key}"
            self._chips = {
                c.name: Chip(c, f"{seed} {c.name}") for c, _ in self._cameras
            }
        self._measure()

    def follow(self) -> None:
        """Add up the turned angle: an engine knows the heading only within a turn."""
        if self._walks:
            yaw = self._heads()
            self._state["heading"] += wrapped(yaw - self._yaw)
            self._yaw = yaw

    def _heads(self) -> float:
        """Return the heading, from -pi to pi rad."""
        now, n = self._now, self._n
        heading: float = atan2(now.sines[n], now.cosines[n])
        return heading

    def feel(self, dt: float) -> None:
        """Average the acceleration over the last `dt` seconds; 0 starts anew."""
        now, n = self._now, self._n
        goes = self.instance.velocity().dot(now.rotations[n]).tolist()
        up = now.rotations[n, 2].tolist()
        now.felt[n] = felt(self._went, goes, now.spins[n], up, dt)
        self._went = goes

    def sense(self) -> None:
        """Read position, joints and sensors from the world."""
        self._steps += 1
        self._measure()
        state, now, n = self._state, self._now, self._n
        if self._walks:
            state["x"], state["y"] = now.x[n], now.y[n]
        for path, joint, ratio in reversed(self._positions):
            state[path] = now.joints[n][0][joint] / ratio

    def _measure(self) -> None:
        instance, now, n, sensors = self.instance, self._now, self._n, self._sensors
        if self._bends:
            now.joints[n] = instance.joints()
        for name, read in self._readers:
            sensors[name] = read(now, n)
        for camera, see in self._cameras:
            if self._steps % camera.every == 0:
                picture: Any = see(now, n)
                chip = self._chips.get(camera.name)
                sensors[camera.name] = chip.take(picture) if chip else picture
                if camera.stamp:
                    sensors[camera.stamp] = self.robot.tick.n


@cache
def _alike(*pairs: Any) -> tuple[Any, ...]:
    """Return the pairs; equal robots get the same tuple object: see `Moment`."""
    return pairs


def _near(wanted: float, middle: float, most: float) -> float:
    """Return `wanted`, limited to at most `most` away from `middle`."""
    return min(max(wanted, middle - most), middle + most)
