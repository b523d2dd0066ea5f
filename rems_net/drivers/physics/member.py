"""Member: one robot in an engine's world: where it starts, is, and what it measures."""

from collections.abc import Sequence
from functools import cache, cached_property
from math import pi
from typing import Any

from rems_net.agents.robot import Robot
from rems_net.bodies.body import Accelerometer, Body, Encoder, Tachometer
from rems_net.bodies.tree import Tree
from rems_net.defdict import DefDict
from rems_net.drivers.acceleration import felt
from rems_net.drivers.physics.engine import Instance
from rems_net.drivers.physics.pictures.looks import cameras
from rems_net.drivers.physics.reading import Moment, Reader, reader
from rems_net.errors import AgentError
from rems_net.maths import atan2
from rems_net.scenes.outline import Outline, of_body

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

    #: its world as it is now, and its number in that
    _now: Moment
    _n: int
    _state: DefDict
    _sensors: DefDict

    def __init__(self, robot: Robot, body: Body):
        self.robot, self.body = robot, body
        self.tree = tree = Tree(body)
        driven = [tree.links[n] for n in tree.motors]
        #: what each motor obeys, and by how much
        self._motors = _alike(*((link.joint.obeys, link.ratio) for link in driven))
        #: of the motors, those that have a servo: which motor, which joint
        self.servos = tuple(
            (motor, tree.motors[motor], link.joint.servo)
            for motor, link in enumerate(driven)
            if link.joint.servo
        )
        #: where each servo asks its joint to be
        self._asked: list[float] = []
        #: physics steps after which it wants to be told and followed again
        self.look_every = ASK if self.servos else LOOK
        self._positions = tuple(
            (link.joint.position, n, link.ratio)
            for n, link in enumerate(tree.links)
            if link.joint.position
        )
        self._walks = not body.fixed
        #: whether it has accelerometers
        self.feels = any(isinstance(one, Accelerometer) for one in body.sensors)
        #: how fast it went in its own frame, m/s
        self._went: Sequence[float] = (0.0, 0.0, 0.0)
        #: whether it asks where its joints are
        self._bends = bool(self._positions) or any(
            isinstance(one, Encoder | Tachometer) for one in body.sensors
        )
        self._readers: tuple[tuple[str, Reader], ...] = ()
        self._cameras: tuple[tuple[str, Reader, int], ...] = ()
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

    @cached_property
    def outline(self) -> Outline:
        """What of it can touch others, found once."""
        return of_body(self.body)

    def enter(self, instance: Instance, now: Moment, n: int) -> None:
        """From now on this is its body, and `n` its number in the world."""
        self._instance, self._now, self._n = instance, now, n
        read = {one.name: reader(one, self.tree, now, n) for one in self.body.sensors}
        self._cameras = tuple(
            (one.name, read.pop(one.name), one.every) for one in cameras([self.body])
        )
        self._readers = _alike(*read.items())
        self._state = self.robot.state
        self._sensors = self.robot.sensors if self.body.sensors else self._state

    def leave(self) -> None:
        """It has no body any more."""
        self._instance = None
        self._readers = self._cameras = ()

    def targets(self, command: DefDict) -> list[float]:
        """What the motors are told, in the order of the tree; then servos, how fast."""
        words = self.robot.motor_command(command)
        told = [words[path] * ratio for path, ratio in self._motors]
        for _, _, servo in self.servos:
            share = command[servo.share] if servo.share else 1.0
            told.append(share * servo.speed)
        return told

    def rest(self) -> list[float]:
        """What keeps it where the state says that it is."""
        targets = self.targets(self.robot.command.schema())
        for number, (motor, _, _) in enumerate(self.servos):
            targets[motor] = self._asked[number]
        return targets

    def told(self, targets: Sequence[float], dt: float) -> list[float]:
        """Return what motors are told for `dt` seconds, so that servos get there."""
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
        if self.posed or any(self.robot.place):
            position = self._now.positions[self._n]
            shift = (x - position[0], y - position[1], 0.0)
            self.instance.move(shift, _wrap(heading - self._heads()))
        if self._positions:
            wanted = {n: state[path] * ratio for path, n, ratio in self._positions}
            self.instance.bend(self.tree.closed(wanted))
        self._hold()

    def _hold(self) -> None:
        """Let the servos ask for what is."""
        now, _ = self.instance.joints()
        self._asked = [now[joint] for _, joint, _ in self.servos]

    def look(self) -> None:
        """Begin to count the heading from here, hold the joints, and measure."""
        self._hold()
        self._yaw = self._heads()
        if self.feels:
            self.feel(0.0)
        self._steps = 0
        self._measure()

    def follow(self) -> None:
        """Keep count of the heading, which an engine knows only within one turn."""
        if self._walks:
            yaw = self._heads()
            self._state["heading"] += _wrap(yaw - self._yaw)
            self._yaw = yaw

    def _heads(self) -> float:
        """Where it heads, from -pi to pi."""
        now, n = self._now, self._n
        heading: float = atan2(now.sines[n], now.cosines[n])
        return heading

    def feel(self, dt: float) -> None:
        """Let its accelerometers feel the last `dt` seconds; with 0 they begin here."""
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
        for name, see, every in self._cameras:
            if self._steps % every == 0:
                sensors[name] = see(now, n)


@cache
def _alike(*pairs: Any) -> tuple[Any, ...]:
    """These pairs, as one thing for all robots that are alike: see `Moment`."""
    return pairs


def _near(wanted: float, middle: float, most: float) -> float:
    """Return what is wanted, but no further from the middle than that."""
    return min(max(wanted, middle - most), middle + most)


def _wrap(angle: float) -> float:
    return (angle + pi) % (2 * pi) - pi
