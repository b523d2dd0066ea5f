"""Member: one robot in an engine's world: where it starts, is, and what it measures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import pi
from typing import Any

import numpy as np

from rems_net.agents.robot import Robot
from rems_net.defdict import DefDict
from rems_net.drivers.physics.engine import Instance
from rems_net.errors import AgentError
from rems_net.maths import atan2
from rems_net.worlds.body import (
    NORTH,
    Array,
    Body,
    Compass,
    Encoder,
    Gyro,
    Ray,
    Sensor,
    Switch,
    Tachometer,
)
from rems_net.worlds.tree import Tree

#: Physics steps between two looks at the heading: no robot spins half round in them.
LOOK = 50
#: The same where there are servos: so often they ask for another speed.
ASK = 5


class Member:
    """Brings the state and the sensors of a robot in line with its body."""

    def __init__(self, robot: Robot, body: Body):
        self.robot, self.body = robot, body
        self.tree = tree = Tree(body)
        #: the definition's own, if it has one: what joints are told, by a command
        self.motors: Callable[[DefDict], Mapping[str, Any]] | None
        self.motors = getattr(robot, "motors", None)
        self._driven = [tree.links[n] for n in tree.motors]
        self._servos = any(link.joint.servo for link in self._driven)
        #: physics steps after which it wants to be told and followed again
        self.look_every = ASK if self._servos else LOOK
        self._positions = {
            link.joint.position: n
            for n, link in enumerate(tree.links)
            if link.joint.position
        }
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

    def told(self, command: DefDict) -> Mapping[str, Any]:
        """What the joints are told, by the path that they obey."""
        return command if self.motors is None else self.motors(command)

    def targets(self, command: DefDict) -> list[float]:
        """What the motors are told, in the order of the tree."""
        told = self.told(command)
        return [told[link.joint.obeys] * link.ratio for link in self._driven]

    def rest(self) -> list[float]:
        """What keeps its motors where the state says that they are."""
        targets = self.targets(self.robot.command.schema())
        for n, link in enumerate(self._driven):
            if link.joint.servo and link.joint.position:
                targets[n] = self.robot.state[link.joint.position]
        return targets

    def command(self, targets: Sequence[float]) -> None:
        """Tell the motors: those with a servo by how far they still have to go."""
        if self._servos:
            now, _ = self.instance.joints()
            targets = [
                target if servo is None else servo.ask(target, now[n])
                for target, n, servo in zip(
                    targets,
                    self.tree.motors,
                    (link.joint.servo for link in self._driven),
                    strict=True,
                )
            ]
        self.instance.command(targets)

    def start(self) -> tuple[float, ...]:
        """Where the state says that it is: x and y in m, heading in rad, and joints."""
        pose = () if self.body.fixed else ("x", "y", "heading")
        return tuple(self.robot.state[path] for path in (*pose, *self._positions))

    def place(self) -> None:
        """Put the body and its joints where the state says that they are."""
        state = self.robot.state
        if not self.body.fixed:
            position, rotation = self.instance.pose()
            shift = (state["x"] - position[0], state["y"] - position[1], 0.0)
            self.instance.move(shift, _wrap(state["heading"] - _yaw(rotation)))
        if self._positions:
            wanted = {
                n: state[path] * self.tree.links[n].ratio
                for path, n in self._positions.items()
            }
            self.instance.bend(self.tree.closed(wanted))

    def look(self) -> None:
        """Begin to count the heading from here, and measure."""
        self._yaw = _yaw(self.instance.pose()[1])
        self._measure()

    def follow(self) -> None:
        """Keep count of the heading, which an engine knows only within one turn."""
        if self.body.fixed:
            return
        yaw = _yaw(self.instance.pose()[1])
        self.robot.state["heading"] += _wrap(yaw - self._yaw)
        self._yaw = yaw

    def sense(self) -> None:
        """Read position, joints and sensors from the world."""
        state = self.robot.state
        if not self.body.fixed:
            position, _ = self.instance.pose()
            state["x"], state["y"] = float(position[0]), float(position[1])
        if self._positions:
            now, _ = self.instance.joints()
            for path, n in self._positions.items():
                state[path] = now[n] / self.tree.links[n].ratio
        self._measure()

    def _measure(self) -> None:
        position, rotation = self.instance.pose()
        for sensor in self.body.sensors:
            self.robot.sensors[sensor.name] = self._read(sensor, position, rotation)

    def _read(self, sensor: Sensor, position: Array, rotation: Array) -> float | bool:
        instance = self.instance
        match sensor:
            case Ray(_, at, direction, reach):
                start = position + rotation @ np.array(at)
                return instance.ray(start, rotation @ np.array(direction), reach)
            case Switch(_, rays, reach, empty):
                near = any(
                    instance.ray(
                        position + rotation @ np.array(at),
                        rotation @ np.array(direction),
                        reach,
                    )
                    < reach
                    for at, direction in rays
                )
                return near != empty
            case Gyro(_, axis):
                return float(instance.spin() @ rotation @ np.array(axis))
            case Compass(_, axis):
                return float(np.array(NORTH) @ rotation @ np.array(axis))
            case Encoder(_, joint):
                n = self.tree.number(joint)
                return instance.joints()[0][n] / self.tree.links[n].ratio
            case Tachometer(_, joint):
                n = self.tree.number(joint)
                return instance.joints()[1][n] / self.tree.links[n].ratio


def _yaw(rotation: Array) -> float:
    return float(atan2(float(rotation[1, 0]), float(rotation[0, 0])))


def _wrap(angle: float) -> float:
    return (angle + pi) % (2 * pi) - pi
