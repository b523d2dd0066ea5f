"""Reading: what each sensor of a body reads from its instance in an engine's world."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from rems_net.drivers.acceleration import component
from rems_net.drivers.physics.engine import Instance, Picture
from rems_net.worlds.body import (
    NORTH,
    Accelerometer,
    Array,
    Camera,
    Compass,
    Encoder,
    Gyro,
    Ray,
    Sensor,
    Switch,
    Tachometer,
)
from rems_net.worlds.tree import Tree


class Moment:
    """A body where it is now, asked for its joints once, if at all."""

    __slots__ = ("_joints", "felt", "instance", "position", "rotation")

    def __init__(self, instance: Instance, felt: Sequence[float]):
        self.instance, self.felt = instance, felt
        self.position, self.rotation = instance.pose()
        self._joints: tuple[Sequence[float], Sequence[float]] | None = None

    @property
    def joints(self) -> tuple[Sequence[float], Sequence[float]]:
        """Where each joint is, and how fast it goes."""
        if self._joints is None:
            self._joints = self.instance.joints()
        return self._joints

    def ray(self, at: Array, direction: Array, reach: float) -> float:
        """How far it is to the nearest thing, from the body's point `at`."""
        turn = self.rotation.dot  # twice as fast as @, and the same
        return self.instance.ray(self.position + turn(at), turn(direction), reach)


Reader = Callable[[Moment], float | bool | Picture]


def reader(sensor: Sensor, tree: Tree) -> Reader:
    """Return what reads a sensor: prepared once, since robots are many and sense often.

    tree: of the body's joints
    """
    match sensor:
        case Ray(_, at, direction, reach):
            ray = np.array(at), np.array(direction), reach
            return lambda now: now.ray(*ray)
        case Switch(_, rays, reach, empty):
            each = [(np.array(at), np.array(way), reach) for at, way in rays]
            return lambda moment: any(moment.ray(*ray) < reach for ray in each) != empty
        case Gyro(_, axis):
            about = np.array(axis)
            return lambda moment: float(
                moment.instance.spin() @ moment.rotation @ about
            )
        case Accelerometer(_, axis):
            return lambda now: float(component(axis, now.felt))
        case Compass(_, axis):
            along, north = np.array(axis), np.array(NORTH)
            return lambda now: float(north.dot(now.rotation).dot(along))
        case Encoder(_, joint) | Tachometer(_, joint):
            which, n = isinstance(sensor, Tachometer), tree.number(joint)
            ratio = tree.links[n].ratio
            return lambda now: now.joints[which][n] / ratio
        case Camera(_, at, direction):
            eye, ahead, up = map(np.array, (at, direction, sensor.up))
            return lambda now: now.instance.picture(
                sensor,
                now.position + now.rotation.dot(eye),
                now.rotation.dot(ahead),
                now.rotation.dot(up),
            )
