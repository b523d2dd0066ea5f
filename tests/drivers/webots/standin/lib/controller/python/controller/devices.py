"""Motors and sensors of the stand-in, by the names that Webots gives their methods."""

# ruff: noqa: N802  (the names are Webots')

from math import cos, inf, nan, sin, sqrt
from typing import Any

from .geometry import Vector, times

#: m. Radius of the round wall that the lidars see.
WALL = 0.4


class Device:
    def __init__(self, robot: Any, name: str):
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

    def __init__(self, robot: Any, name: str, told: dict[str, Any]):
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
