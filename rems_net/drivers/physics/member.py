"""Member: one robot in an engine's world: where it starts, is, and what it measures."""

from __future__ import annotations

from math import pi

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
    Gyro,
    Ray,
    Sensor,
)


class Member:
    """Brings the state and the sensors of a robot in line with its body."""

    def __init__(self, robot: Robot, body: Body):
        self.robot, self.body = robot, body
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
        """What the motors are told, in the order of the joints."""
        return [command[hinge.name] for hinge in self.body.hinges]

    def start(self) -> tuple[float, float, float]:
        """Where the state says that it is: x and y in m, heading in rad."""
        state = self.robot.state
        return state["x"], state["y"], state["heading"]

    def place(self) -> None:
        """Put the body where the state says that it is."""
        position, rotation = self.instance.pose()
        x, y, heading = self.start()
        shift = (x - position[0], y - position[1], 0.0)
        self.instance.move(shift, _wrap(heading - _yaw(rotation)))

    def look(self) -> None:
        """Begin to count the heading from here, and measure."""
        self._yaw = _yaw(self.instance.pose()[1])
        self._measure()

    def follow(self) -> None:
        """Keep count of the heading, which an engine knows only within one turn."""
        yaw = _yaw(self.instance.pose()[1])
        self.robot.state["heading"] += _wrap(yaw - self._yaw)
        self._yaw = yaw

    def sense(self) -> None:
        """Read position and sensors from the world."""
        state = self.robot.state
        position, _ = self.instance.pose()
        state["x"], state["y"] = float(position[0]), float(position[1])
        self._measure()

    def _measure(self) -> None:
        position, rotation = self.instance.pose()
        for sensor in self.body.sensors:
            self.robot.sensors[sensor.name] = _read(
                sensor, self.instance, position, rotation
            )


def _read(
    sensor: Sensor, instance: Instance, position: Array, rotation: Array
) -> float:
    match sensor:
        case Ray(_, at, direction, reach):
            start = position + rotation @ np.array(at)
            return instance.ray(start, rotation @ np.array(direction), reach)
        case Gyro(_, axis):
            return float(instance.spin() @ rotation @ np.array(axis))
        case Compass(_, axis):
            return float(np.array(NORTH) @ rotation @ np.array(axis))
        case _:
            raise NotImplementedError(f"no engine reads {sensor} yet")


def _yaw(rotation: Array) -> float:
    return float(atan2(float(rotation[1, 0]), float(rotation[0, 0])))


def _wrap(angle: float) -> float:
    return (angle + pi) % (2 * pi) - pi
