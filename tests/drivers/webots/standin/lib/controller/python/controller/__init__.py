"""A stand-in for Webots' module `controller`: its surface, and a kinematic robot.

What robot that is, REMS_STANDIN tells, a JSON table:

name, supervisor, step (ms), max_speed (rad/s), quits_after (s)
upright: "z", or "y" for a model whose own y is up and whose z is to its right
at: the middle of the axle in the model's frame
left, right: names of the motors of either side, with `radius` and `track`; with
    `wheelbase`, too, front and rear ones are mecanum wheels
places: names of motors that go somewhere
sensors: by name, one of {"angle": MOTOR}, {"lidar": [ahead, left, offset]},
    {"compass": [axes that are on]}, {"gyro": [axes]}, {"accelerometer": [axes]},
    {"value": number}; a lidar counts mm to a round wall of 0.4 m

What Webots does late is late here: a sensor that was enabled knows nothing before the
next step, and a field that was set takes effect in it.
"""

# ruff: noqa: N802  (the names are Webots')

from __future__ import annotations

import json
import os
import sys
from math import atan2, cos, inf, nan, sin, sqrt
from typing import Any

Vector = list[float]
WALL = 0.4


def table() -> dict[str, Any]:
    told: dict[str, Any] = json.loads(os.environ["REMS_STANDIN"])
    return told


def times(matrix: list[Vector], vector: Vector) -> Vector:
    return [sum(a * b for a, b in zip(row, vector, strict=True)) for row in matrix]


class Device:
    def __init__(self, robot: Robot, name: str):
        self.robot, self.name = robot, name

    def getName(self) -> str:
        return self.name


class Motor(Device):
    velocity = target = angle = 0.0
    asked = inf

    def setPosition(self, position: float) -> None:
        self.target = position

    def setVelocity(self, velocity: float) -> None:
        top = self.getMaxVelocity()
        self.velocity = min(max(velocity, -top), top)
        self.asked = self.velocity

    def getMaxVelocity(self) -> float:
        return float(self.robot.told.get("max_speed", 10.0))

    def turn(self, dt: float) -> None:
        if self.target == inf:
            self.angle += self.velocity * dt
        else:  # as fast as it was told to, or can
            most = min(self.asked, self.getMaxVelocity()) * dt
            self.angle += min(max(self.target - self.angle, -most), most)


class Sensor(Device):
    """Knows what it read at the end of the last step, once it is enabled."""

    enabled = 0
    found: Vector = [nan]  # noqa: RUF012

    def __init__(self, robot: Robot, name: str, told: dict[str, Any]):
        super().__init__(robot, name)
        self.told = told

    def enable(self, period: int) -> None:
        assert isinstance(period, int)
        assert period >= 1
        self.enabled = period

    def getValue(self) -> float:
        return self.found[0]

    def getValues(self) -> Vector:
        return self.found

    def look(self) -> None:
        if self.enabled:
            (kind, told), *_ = self.told.items()
            self.found = getattr(self, f"_{kind}")(told)

    def _angle(self, motor: str) -> Vector:
        return [self.robot.motors[motor].angle]

    def _value(self, value: float) -> Vector:
        return [value]

    def _compass(self, axes: list[int]) -> Vector:
        return self._seen([0.0, 1.0, 0.0], axes)

    def _gyro(self, axes: list[int]) -> Vector:
        return self._seen([0.0, 0.0, self.robot.turning], axes)

    def _accelerometer(self, axes: list[int]) -> Vector:
        return self._seen([0.0, 0.0, 9.81], axes)  # whatever it does

    def _seen(self, vector: Vector, axes: list[int]) -> Vector:
        """A vector of the world in the model's frame; nan on axes that are off."""
        columns = zip(*self.robot.rotation(), strict=True)
        inside = times([list(column) for column in columns], vector)
        return [value if i in axes else nan for i, value in enumerate(inside)]

    def _lidar(self, told: Vector) -> Vector:
        ahead, left, offset = told
        r = self.robot
        c, s = cos(r.heading), sin(r.heading)
        x, y = r.x + offset * c, r.y + offset * s
        dx, dy = ahead * c - left * s, ahead * s + left * c
        along = x * dx + y * dy
        return [1000 * (sqrt(along * along + WALL * WALL - x * x - y * y) - along)]


class Field:
    def __init__(self, robot: Robot, name: str):
        self.robot, self.name = robot, name

    def setSFVec3f(self, value: Vector) -> None:
        assert self.name == "translation"
        self.robot.set["translation"] = list(value)

    def setSFRotation(self, value: Vector) -> None:
        assert self.name == "rotation"
        self.robot.set["rotation"] = list(value)


class Node:
    def __init__(self, robot: Robot):
        self.robot = robot

    def getPosition(self) -> Vector:
        r = self.robot
        away = times(r.rotation(), r.told["at"])
        middle = [r.x, r.y, r.told["radius"]]
        return [m - a for m, a in zip(middle, away, strict=True)]

    def getOrientation(self) -> Vector:
        return [number for row in self.robot.rotation() for number in row]

    def getField(self, name: str) -> Field:
        return Field(self.robot, name)

    def saveState(self, name: str) -> None:
        motors = self.robot.motors.items()
        self.robot.saved[name] = {device: motor.angle for device, motor in motors}

    def loadState(self, name: str) -> None:
        """Motors forget what they were told, and go to where the world has them."""
        for device, angle in self.robot.saved[name].items():
            motor = self.robot.motors[device]
            motor.angle, motor.target, motor.velocity = angle, 0.0, 0.0

    def resetPhysics(self) -> None:
        for motor in self.robot.motors.values():
            motor.velocity = 0.0


class Robot:
    created: Any = None

    def __init__(self) -> None:
        if Robot.created:
            print("Error: only one Robot instance can be created", file=sys.stderr)
            return
        Robot.created = self
        self.told = told = table()
        url = os.environ.get("WEBOTS_CONTROLLER_URL", "")
        if url and url.rpartition("/")[2] != told["name"]:
            print(f"there is no robot {url!r}", file=sys.stderr)
            sys.exit(1)
        self.x, self.y, self.heading, self.turning = 0.1, -0.1, 0.5, 0.0
        self.time = 0.0
        self.set: dict[str, Vector] = {}
        self.saved: dict[str, dict[str, float]] = {}
        turned = [*told["left"], *told["right"], *told.get("places", [])]
        self.motors = {name: Motor(self, name) for name in turned}
        sensors = {
            name: Sensor(self, name, one)
            for name, one in told.get("sensors", {}).items()
        }
        self.devices: dict[str, Any] = {**self.motors, **sensors}

    def getName(self) -> str:
        return str(self.told["name"])

    def getSupervisor(self) -> bool:
        return bool(self.told.get("supervisor", True))

    def getBasicTimeStep(self) -> float:
        return float(self.told["step"])

    def getTime(self) -> float:
        return self.time

    def getNumberOfDevices(self) -> int:
        return len(self.devices)

    def getDeviceByIndex(self, index: int) -> Any:
        return list(self.devices.values())[index]

    def getDevice(self, name: str) -> Any:
        return self.devices.get(name)

    def step(self, milliseconds: int) -> int:
        assert isinstance(milliseconds, int)
        assert milliseconds % self.told["step"] == 0
        for _ in range(round(milliseconds / self.told["step"])):
            self._move(self.told["step"] / 1000)
        if self.time >= self.told.get("quits_after", inf):
            return -1
        for device in self.devices.values():
            if isinstance(device, Sensor):
                device.look()
        return 0

    def rotation(self) -> list[Vector]:
        """Model to world."""
        c, s = cos(self.heading), sin(self.heading)
        if self.told.get("upright", "z") == "z":
            return [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
        return [[c, 0.0, s], [s, 0.0, -c], [0.0, 1.0, 0.0]]

    def _move(self, dt: float) -> None:
        self._place()
        for motor in self.motors.values():
            motor.turn(dt)
        ahead, aside, self.turning = self._twist()
        middle = self.heading + self.turning * dt / 2
        self.x += (ahead * cos(middle) - aside * sin(middle)) * dt
        self.y += (ahead * sin(middle) + aside * cos(middle)) * dt
        self.heading = atan2(
            sin(self.heading + self.turning * dt), cos(self.heading + self.turning * dt)
        )
        self.time += dt

    def _twist(self) -> tuple[float, float, float]:
        """Speeds ahead and to the left, m/s, and of turning, rad/s."""
        told = self.told
        left, right = (
            [self.motors[name].velocity for name in told[side]]
            for side in ("left", "right")
        )
        if not left:
            return 0.0, 0.0, 0.0
        radius, apart = told["radius"], told["track"]
        count = len(left)
        ahead = radius * (sum(left) + sum(right)) / 2 / count
        turning = radius * (sum(right) - sum(left)) / count / apart
        if "wheelbase" not in told:
            return ahead, 0.0, turning
        front, rear = right[0] - left[0], right[1] - left[1]
        aside = radius * (front - rear) / 4
        return ahead, aside, turning * apart / (apart + told["wheelbase"])

    def _place(self) -> None:
        """What was set; Webots would let a robot fall that is put down crookedly."""
        told, self.set = self.set, {}
        if "rotation" in told:
            x, y, z, angle = told["rotation"]
            c, s, v = cos(angle), sin(angle), 1 - cos(angle)
            matrix = [
                [c + x * x * v, x * y * v - z * s, x * z * v + y * s],
                [y * x * v + z * s, c + y * y * v, y * z * v - x * s],
                [z * x * v - y * s, z * y * v + x * s, c + z * z * v],
            ]
            self.heading = atan2(matrix[1][0], matrix[0][0])
            flat = [n for row in matrix for n in row]
            upright = [n for row in self.rotation() for n in row]
            off = max(abs(a - b) for a, b in zip(flat, upright, strict=True))
            assert off < 1e-9, "it was put down crookedly"
        if "translation" in told:
            away = times(self.rotation(), self.told["at"])
            at = [t + a for t, a in zip(told["translation"], away, strict=True)]
            self.x, self.y, height = at
            assert abs(height - self.told["radius"]) < 1e-9, "it hangs in the air"


class Supervisor(Robot):
    def getSelf(self) -> Node:
        return Node(self)
