"""A stand-in for Webots' module `controller`: its surface, and a kinematic robot.

REMS_STANDIN is a JSON table of that robot, or a list of them, one of which has the name
in WEBOTS_CONTROLLER_URL:

name, supervisor, step (ms), max_speed (rad/s), quits_after (s)
upright: "z", or "y" for a model whose own y is up and whose z is to its right
at: the middle of the axle in the model's frame
parents: fields of the Transforms around the robot, outermost first, each a table of
    `translation`, `rotation` and `scale`
system: the world's coordinateSystem; "ENU" without
left, right: names of the motors of either side, with `radius` and `track`; with
    `wheelbase`, too, front and rear ones are mecanum wheels
places: names of motors that go somewhere
sensors: by name, one of {"angle": MOTOR}, {"lidar": [ahead, left, offset]},
    {"compass": [axes that are on]}, {"gyro": [axes]}, {"accelerometer": [axes]},
    {"value": number}; a lidar counts mm to a round wall of 0.4 m

What Webots does late is late here: a sensor that was enabled knows nothing before the
next step, and a field that was set takes effect in it.

Positions and orientations of nodes are in the world; the fields `translation` and
`rotation` are relative to the parent; a `scale` around a Robot is reset to 1 (Webots'
Reference Manual: Supervisor, Transform).
"""

# ruff: noqa: N802  (the names are Webots')

from __future__ import annotations

import json
import os
import sys
from math import atan2, cos, inf, sin
from typing import Any

import numpy as np

from .devices import Motor, Sensor
from .geometry import Matrix, Vector, fields, transform


def table() -> dict[str, Any]:
    told: Any = json.loads(os.environ["REMS_STANDIN"])
    if isinstance(told, dict):
        return told
    name = os.environ.get("WEBOTS_CONTROLLER_URL", "").rpartition("/")[2]
    one: dict[str, Any] = next(robot for robot in told if robot["name"] == name)
    return one


class Field:
    def __init__(self, robot: Robot, name: str):
        self.robot, self.name = robot, name

    def getSFVec3f(self) -> Vector:
        assert self.name == "translation"
        return fields(self.robot.local)[0]

    def getSFRotation(self) -> Vector:
        assert self.name == "rotation"
        return fields(self.robot.local)[1]

    def setSFVec3f(self, value: Vector) -> None:
        assert self.name == "translation"
        self.robot.set["translation"] = list(value)

    def setSFRotation(self, value: Vector) -> None:
        assert self.name == "rotation"
        self.robot.set["rotation"] = list(value)

    def getSFString(self) -> str:
        assert self.name == "coordinateSystem"
        return self.robot.system

    def getCount(self) -> int:
        assert self.name == "children"
        return 2

    def getMFNode(self, index: int) -> Node:
        return Node(self.robot, ("Viewpoint", "WorldInfo")[index])


class Node:
    def __init__(self, robot: Robot, kind: str = "Robot"):
        self.robot, self.kind = robot, kind

    def getTypeName(self) -> str:
        return self.kind

    def getPosition(self) -> Vector:
        world: Vector = self.robot.world()[:3, 3].tolist()
        return world

    def getOrientation(self) -> Vector:
        world: Vector = self.robot.world()[:3, :3].ravel().tolist()
        return world

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
        self.system: str = told.get("system", "ENU")
        self.outside = np.eye(4)
        for parent in told.get("parents", []):
            if parent.get("scale", [1, 1, 1]) != [1, 1, 1]:
                print("warning: scale is reset to 1 around a Robot", file=sys.stderr)
            rotation = parent.get("rotation", [0, 0, 1, 0])
            nowhere = parent.get("translation", [0, 0, 0])
            self.outside = self.outside @ transform(nowhere, rotation)
        self.x, self.y, self.heading, self.turning = 0.1, -0.1, 0.5, 0.0
        self._local: Matrix | None = None
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
        self._local = None

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

    def world(self) -> Matrix:
        """Return the robot's pose (4, 4) in Webots' world."""
        return self.outside @ self.local

    def _flat(self) -> Matrix:
        """Return the rotation (4, 4) from Webots' world to east, north and up."""
        turn = np.eye(4)
        turn[:3, :3] = [np.eye(3)[self.system.index(letter)] for letter in "ENU"]
        return turn

    @property
    def local(self) -> Matrix:
        """The matrix (4, 4) of the fields, which follow the robot's motion."""
        if self._local is None:
            self._local = self._relative()
        return self._local

    def _relative(self) -> Matrix:
        pose = np.eye(4)
        pose[:3, :3] = self.rotation()
        middle = [self.x, self.y, self.told["radius"]]
        pose[:3, 3] = middle - pose[:3, :3] @ self.told["at"]
        return np.linalg.inv(self.outside) @ self._flat().T @ pose

    def _place(self) -> None:
        """Take what was set. Webots lets a robot fall that is put down crookedly."""
        told, self.set = self.set, {}
        if not told:
            return
        translation, rotation = fields(self.local)
        self._local = transform(
            told.get("translation", translation), told.get("rotation", rotation)
        )
        pose = self._flat() @ self.world()
        self.heading = atan2(pose[1, 0], pose[0, 0])
        off = abs(pose[:3, :3] - np.array(self.rotation())).max()
        assert off < 1e-9, "it was put down crookedly"
        self.x, self.y, height = pose[:3, 3] + pose[:3, :3] @ self.told["at"]
        assert abs(height - self.told["radius"]) < 1e-9, "it hangs in the air"


class Supervisor(Robot):
    def getSelf(self) -> Node:
        return Node(self)

    def getRoot(self) -> Node:
        return Node(self, "Group")
