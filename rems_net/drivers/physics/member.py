"""Member: one robot in an engine's world: where it starts, is, and what it measures."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

from rems_net.agents.robot import Robot
from rems_net.defdict import DefDict
from rems_net.drivers.acceleration import felt
from rems_net.drivers.physics.engine import Instance
from rems_net.drivers.physics.pictures.looks import cameras
from rems_net.drivers.physics.reading import Moment, reader
from rems_net.errors import AgentError
from rems_net.maths import atan2
from rems_net.worlds.body import Accelerometer, Array, Body, Camera
from rems_net.worlds.tree import Tree

#: Physics steps between two looks at the heading: no robot spins half round in them.
LOOK = 50
#: The same where there are servos: so often they ask for another speed.
ASK = 5
#: Of the state: where a robot stands, m and rad.
POSE = ("x", "y", "heading")
#: What a servo asks for runs ahead of the joint by what its speed is in this time, s:
#: one that was held up does not leap when it comes free.
LEAD = 0.2


class Member:
    """Brings the state and the sensors of a robot in line with its body."""

    def __init__(self, robot: Robot, body: Body):
        self.robot, self.body = robot, body
        self.tree = tree = Tree(body)
        self._driven = [tree.links[n] for n in tree.motors]
        #: of the motors, those that have a servo: which motor, which joint
        self._servos = [
            (motor, tree.motors[motor], link.joint.servo)
            for motor, link in enumerate(self._driven)
            if link.joint.servo
        ]
        #: where each servo asks its joint to be
        self._asked: list[float] = []
        #: physics steps after which it wants to be told and followed again
        self.look_every = ASK if self._servos else LOOK
        self._positions = [
            (link.joint.position, n, link.ratio)
            for n, link in enumerate(tree.links)
            if link.joint.position
        ]
        #: whether it has accelerometers
        self.feels = any(isinstance(one, Accelerometer) for one in body.sensors)
        #: in its own frame: how fast it went, m/s, and what they feel, m/s2
        self._went: Sequence[float] = (0.0, 0.0, 0.0)
        self._felt: Sequence[float] = self._went
        self._readers = [
            (one.name, reader(one, tree))
            for one in body.sensors
            if not isinstance(one, Camera)
        ]
        self._cameras = [
            (one.name, reader(one, tree), one.every) for one in cameras([body])
        ]
        #: how often it has sensed since it was put where it started
        self._steps = 0
        self._instance: Instance | None = None
        self._yaw = 0.0

    @property
    def instance(self) -> Instance:
        """Its body in the engine's world. Raises AgentError before that is open."""
        if self._instance is None:
            raise AgentError(self.robot.key, "it has no world yet: call open() first.")
        return self._instance

    @property
    def is_in(self) -> bool:
        """Whether its world is open."""
        return self._instance is not None

    def enter(self, instance: Instance | None) -> None:
        """From now on this is its body."""
        self._instance = instance

    def targets(self, command: DefDict) -> list[float]:
        """What the motors are told, in the order of the tree; then servos, how fast."""
        words = self.robot.motor_command(command)
        told = [words[link.joint.obeys] * link.ratio for link in self._driven]
        for _, _, servo in self._servos:
            share = command[servo.share] if servo.share else 1.0
            told.append(share * servo.speed)
        return told

    def rest(self) -> list[float]:
        """What keeps it where the state says that it is."""
        targets = self.targets(self.robot.command.schema())
        for number, (motor, _, _) in enumerate(self._servos):
            targets[motor] = self._asked[number]
        return targets

    def command(self, targets: Sequence[float], dt: float) -> None:
        """Tell the motors what they shall do for `dt` seconds."""
        if self._servos:
            now, _ = self.instance.joints()
            count = len(self._driven)
            told = list(targets[:count])
            for number, (motor, joint, servo) in enumerate(self._servos):
                most, lead = targets[count + number] * dt, servo.speed * LEAD
                asked = _near(self._asked[number], now[joint], lead)
                goal = _near(told[motor], asked, most)
                told[motor] = (goal - asked) / dt + servo.gain * (asked - now[joint])
                self._asked[number] = goal
            targets = told
        self.instance.command(targets)

    @property
    def posed(self) -> bool:
        """Whether its state says where it stands, and not its `place`."""
        return not self.body.fixed or set(POSE) <= set(self.robot.state.schema.paths)

    def start(self) -> tuple[float, ...]:
        """Where the state says that it is: x and y in m, heading in rad, and joints."""
        pose = POSE if self.posed else ()
        joints = (path for path, _, _ in self._positions)
        return tuple(self.robot.state[path] for path in (*pose, *joints))

    def where(self) -> tuple[float, float, float]:
        """Where the state says that it stands: x and y in m, heading in rad."""
        return self._pose(self.robot.state)

    def beginning(self) -> tuple[float, float, float]:
        """Where it stands after a reset."""
        return self._pose(self.robot.begins())

    def _pose(self, state: DefDict) -> tuple[float, float, float]:
        if not self.posed:
            return self.robot.place
        return state["x"], state["y"], state["heading"]

    def place(self) -> None:
        """Put the body and its joints where the state says that they are."""
        state, (x, y, heading) = self.robot.state, self.where()
        position, rotation = self.instance.pose()
        if self.posed or any(self.robot.place):
            shift = (x - position[0], y - position[1], 0.0)
            self.instance.move(shift, _wrap(heading - _yaw(rotation)))
        if self._positions:
            wanted = {n: state[path] * ratio for path, n, ratio in self._positions}
            self.instance.bend(self.tree.closed(wanted))
        self._hold()

    def _hold(self) -> None:
        """Let the servos ask for what is."""
        now, _ = self.instance.joints()
        self._asked = [now[joint] for _, joint, _ in self._servos]

    def look(self) -> None:
        """Begin to count the heading from here, hold the joints, and measure."""
        self._hold()
        self._yaw = _yaw(self.instance.pose()[1])
        if self.feels:
            self.feel(0.0)
        self._steps = 0
        self._measure()

    def follow(self) -> None:
        """Keep count of the heading, which an engine knows only within one turn."""
        if self.body.fixed:
            return
        yaw = _yaw(self.instance.pose()[1])
        self.robot.state["heading"] += _wrap(yaw - self._yaw)
        self._yaw = yaw

    def feel(self, dt: float) -> None:
        """Let its accelerometers feel the last `dt` seconds; with 0 they begin here."""
        turn = self.instance.pose()[1]
        now = self.instance.velocity().dot(turn).tolist()
        spin = self.instance.spin().dot(turn).tolist()
        self._felt = felt(self._went, now, spin, turn[2].tolist(), dt)
        self._went = now

    def sense(self) -> None:
        """Read position, joints and sensors from the world."""
        state = self.robot.state
        if not self.body.fixed:
            position, _ = self.instance.pose()
            state["x"], state["y"] = float(position[0]), float(position[1])
        if self._positions:
            now, _ = self.instance.joints()
            for path, n, ratio in reversed(self._positions):
                state[path] = now[n] / ratio
        self._steps += 1
        self._measure()

    def _measure(self) -> None:
        if self.body.sensors:
            moment, sensors = Moment(self.instance, self._felt), self.robot.sensors
            for name, read in self._readers:
                sensors[name] = read(moment)
            for name, see, every in self._cameras:
                if self._steps % every == 0:
                    sensors[name] = see(moment)


def _near(wanted: float, middle: float, most: float) -> float:
    """Return what is wanted, but no further from the middle than that."""
    return min(max(wanted, middle - most), middle + most)


def _yaw(rotation: Array) -> float:
    return float(atan2(float(rotation[1, 0]), float(rotation[0, 0])))


def _wrap(angle: float) -> float:
    return (angle + pi) % (2 * pi) - pi
