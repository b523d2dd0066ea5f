"""Reading: poses of all bodies in a world, and their sensors' values.

A world has many robots, which measure often. So values for all robots are computed at
once, and equal bodies share the functions for their sensors: after a step of fifty
robots a processor's cache is empty, and less memory to read means less time.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import Any

import numpy as np

from rems_net.bodies import sensors
from rems_net.bodies.body import NORTH, Array, Sensor, Vector
from rems_net.bodies.tree import Tree
from rems_net.drivers.acceleration import component
from rems_net.drivers.physics.engine import Engine, Picture
from rems_net.drivers.physics.pictures.optics import distorted, ideal

#: row of a rotation that is the direction to north
TO_NORTH = NORTH.index(1.0)


class Moment:
    """The present values of all bodies of a world, by their numbers in the engine."""

    #: positions, m, and rotations, body to world: (n, 3) and (n, 3, 3)
    positions: Array
    rotations: Array
    #: positions on the floor, m
    x: list[float]
    y: list[float]
    #: cosines and sines of the headings
    cosines: list[float]
    sines: list[float]
    #: in the bodies' own frames: directions to north, and angular velocities, rad/s
    norths: list[list[float]]
    spins: list[list[float]]
    #: distances along each body's rays, m
    distances: list[list[float]]

    def __init__(self, engine: Engine):
        self.engine = engine
        # The engine keeps these arrays, so views of them are made once.
        self.positions, self.rotations = engine.poses()
        self._xy = self.positions[:, :2].T
        self._ahead = self.rotations[:, :2, 0].T
        self._north = self.rotations[:, TO_NORTH]
        bodies = len(engine.instances)
        #: values for accelerometers, in the bodies' own frames, m/s2
        self.felt: list[Sequence[float]] = [(0.0, 0.0, 0.0)] * bodies
        #: positions and speeds of joints, of bodies that measure them
        self.joints: list[tuple[Sequence[float], Sequence[float]]] = [((), ())] * bodies
        #: whether some body measures its angular velocity, or the direction to north
        self.turning = self.finding = False
        self._rays: list[list[tuple[Vector, Vector, float]]] = [[] for _ in self.felt]

    def add_rays(
        self, body: int, rays: Iterable[tuple[Vector, Vector]], reach: float
    ) -> tuple[int, int]:
        """Add rays, each with a start and a direction in the body's own frame.

        Returns the first and the end of their numbers among its `distances`.
        """
        own = self._rays[body]
        first = len(own)
        own += [(at, direction, reach) for at, direction in rays]
        return first, len(own)

    def settle(self) -> None:
        """Prepare the arrays for all rays that were added."""
        rays = [(n, *ray) for n, some in enumerate(self._rays) for ray in some]
        bodies = [body for body, _, _, _ in rays]
        # Of one body alone no copies are made.
        several = len(self._rays) > 1
        self._carriers: Any = np.array(bodies, int) if several else slice(None)
        both = [[at for _, at, _, _ in rays], [way for _, _, way, _ in rays]]
        self._both = np.array(both, float).reshape(2, -1, 3, 1)
        #: the same in the world's frame, and each ray's rows of it
        self._turned = self._both.copy()
        self._starts, ways = self._turned[..., 0]
        lines = [*zip(self._starts, ways, strict=True)]
        reaches = [reach for _, _, _, reach in rays]
        self.engine.aim([*zip(bodies, lines, reaches, strict=True)])
        ends = np.cumsum([0, *map(len, self._rays)]).tolist()
        self._own = [*map(slice, ends, ends[1:])]

    def look(self) -> None:
        """Read the bodies' poses."""
        self.engine.poses()
        self.cosines, self.sines = self._ahead.tolist()

    def sense(self) -> None:
        """Compute the other values that sensors need, from the poses of `look`."""
        self.x, self.y = self._xy.tolist()
        if self.finding:
            self.norths = self._north.tolist()
        if self.turning:
            self.spins = self.engine.spins().tolist()
        if len(self._starts):
            # One product of all has the same bits as one product of each.
            turns = self.rotations[self._carriers]
            np.matmul(turns, self._both, out=self._turned)
            self._starts += self.positions[self._carriers]
            found = self.engine.rays()
            self.distances = [found[own] for own in self._own]


#: returns the value of a sensor of the body with the given number
Reader = Callable[[Moment, int], float | bool | Picture]


def reader(sensor: Sensor, tree: Tree, now: Moment, n: int) -> Reader:
    """Return the function that reads a sensor of body `n`.

    tree: the body's joints
    """
    match sensor:
        case sensors.Ray(_, at, direction, reach):
            number, _ = now.add_rays(n, [(at, direction)], reach)
            return _ray(number)
        case sensors.Switch(_, rays, reach, empty):
            return _switch(*now.add_rays(n, rays, reach), reach, empty)
        case sensors.Gyro(_, axis):
            now.turning = True
            return _gyro(*map(float, axis))
        case sensors.Accelerometer(_, axis):
            now.turning = True
            return _accelerometer(*map(float, axis))
        case sensors.Compass(_, axis):
            now.finding = True
            return _compass(*map(float, axis))
        case sensors.Encoder(_, joint) | sensors.Tachometer(_, joint):
            number = tree.number(joint)
            ratio = tree.links[number].ratio
            return _joint(isinstance(sensor, sensors.Tachometer), number, ratio)
        case sensors.Camera(_, at, direction):
            eye, ahead, up = map(np.array, (at, direction, sensor.up))
            drawn, bend = ideal(sensor), distorted(sensor)

            def see(now: Moment, n: int) -> Picture:
                turn = now.rotations[n].dot
                at = now.positions[n] + turn(eye)
                picture = now.engine.instances[n].picture
                return bend(picture(drawn, at, turn(ahead), turn(up)))

            return see


@cache
def _ray(number: int) -> Reader:
    return lambda now, n: now.distances[n][number]


@cache
def _switch(first: int, end: int, reach: float, empty: bool) -> Reader:
    rays = slice(first, end)
    return lambda now, n: any(d < reach for d in now.distances[n][rays]) != empty


# Sums begin at 0.0, as in BLAS, so that -0.0 becomes 0.0.
@cache
def _gyro(a: float, b: float, c: float) -> Reader:
    def read(now: Moment, n: int) -> float:
        x, y, z = now.spins[n]
        return 0.0 + (a * x + b * y + c * z)

    return read


@cache
def _accelerometer(*axis: float) -> Reader:
    return lambda now, n: component(axis, now.felt[n])


@cache
def _compass(a: float, b: float, c: float) -> Reader:
    def read(now: Moment, n: int) -> float:
        x, y, z = now.norths[n]
        return 0.0 + (a * x + b * y + c * z)

    return read


@cache
def _joint(which: bool, number: int, ratio: float) -> Reader:
    return lambda now, n: now.joints[n][which][number] / ratio
