"""Physics: what the two engines have in common, so that only physics differs.

An engine is told the same `Body`, moves it, and answers where it is; the steps, the
state and the sensors are made here, once, for both.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import ceil, pi
from typing import Protocol

import numpy as np

from rems_net.agents.ports import Settings
from rems_net.agents.robot import Driver
from rems_net.defdict import DefDict, Schema, time
from rems_net.drivers.needs import look_for, missing
from rems_net.errors import AgentError, SchemaError
from rems_net.maths import atan2
from rems_net.worlds.body import (
    NORTH,
    Arena,
    Array,
    Body,
    Compass,
    Embodied,
    Gyro,
    Ray,
    Sensor,
    lump,
)

#: Physics steps between two looks at the heading: no robot spins half round in them.
LOOK = 50
#: How long a new body is left alone to settle on its wheels, s.
SETTLE = 0.5


class World(Protocol):
    """One body in one arena, in some engine. Positions in m in the arena's frame."""

    def advance(self, speeds: Sequence[float], h: float, count: int) -> None:
        """Take `count` steps of `h` s, motors told these speeds (rad/s, by hinge)."""
        ...

    def pose(self) -> tuple[Array, Array]:
        """Return the position (3,) and the rotation (3, 3), body to arena."""
        ...

    def spin(self) -> Array:
        """Return the angular velocity (3,), rad/s, in the arena's frame."""
        ...

    def move(self, shift: Sequence[float], yaw: float) -> None:
        """Put the body elsewhere, turned by `yaw` about its own origin, at rest."""
        ...

    def ray(self, start: Array, direction: Array, reach: float) -> float:
        """Return the distance to the nearest floor or wall, at most `reach`."""
        ...

    def close(self) -> None:
        """Give everything back."""
        ...


class Physics(Driver):
    """Moves the definition's `body()` in its `arena()` (an open floor without one).

    A step of the clock is cut into the fewest equal steps of at most `physics_step`.
    The state needs x and y in m and a heading in rad, which goes on past a full turn.
    A reset builds the world anew, so that what follows is the same to the last bit.
    """

    options = Settings(
        physics_step=time(
            "s", default=0.001, range=(1e-5, 0.005), doc="of the engine, at most"
        )
    )

    _world: World | None = None
    _body: Body
    _arena: Arena

    def build(self, body: Body, arena: Arena) -> World:
        """Return the engine's world: the body at the origin, heading along +x."""
        raise NotImplementedError(f"{type(self).__name__} must define build().")

    def prepare(self) -> None:
        """Check the engine, and that the definition says what it is made of."""
        for library in self.needs:
            look_for(library, library)
        if not isinstance(self, Embodied):
            raise missing(
                self,
                "body()",
                "what the robot is made of",
                "def body(self):\n"
                "        return Body(parts=(Part(Sphere(0.1), mass=1.0),), height=0.1)",
            )
        self._body = body = self.body()
        for parts in (body.parts, *(hinge.parts for hinge in body.hinges)):
            lump(parts)  # refuses what weighs nothing
        self._arena = getattr(self, "arena", Arena)()
        super().prepare()
        for port, path, unit in _told_and_heard(body):
            self._check(port, path, unit)

    def _check(self, port: str, path: str, unit: str) -> None:
        """Refuse a field that is not there, or that is in another unit."""
        schema = self.schemas().get(port, Schema(f"{self.name}.{port}"))
        if path not in schema:
            raise SchemaError(
                f"{type(self).__name__}: the body needs the field {path!r} of "
                f"{port}. {schema.unknown(path)}"
            )
        found = getattr(schema[path], "unit", None)
        if found != unit:
            raise SchemaError(
                f"{type(self).__name__}: physics needs {port} {path!r} in {unit!r}, "
                f"but {schema.name} has it in {found!r}. Give the field that unit."
            )

    def open(self) -> None:
        """Build the world and let the body settle at its initial pose."""
        super().open()
        self._place()

    def reset(self) -> None:
        """Go back to the initial pose, at rest, with everything else as it was."""
        super().reset()
        if self._world is not None:
            self._place()

    def close(self) -> None:
        """Give the world back."""
        self._leave()
        super().close()

    def _leave(self) -> None:
        world, self._world = self._world, None
        if world is not None:
            world.close()

    def _place(self) -> None:
        self._leave()
        step = self.options["physics_step"]
        self._world = world = self.build(self._body, self._arena)
        self._go(self.state["x"], self.state["y"], self.state["heading"])
        world.advance([0.0] * len(self._body.hinges), step, ceil(SETTLE / step))
        # What settling has moved is put right; with it, t = 0 is the initial pose.
        self._go(self.state["x"], self.state["y"], self.state["heading"])
        self._yaw = _yaw(world.pose()[1])
        self._measure(world)

    def _go(self, x: float, y: float, heading: float) -> None:
        world = self._running()
        position, rotation = world.pose()
        shift = (x - position[0], y - position[1], 0.0)
        world.move(shift, _wrap(heading - _yaw(rotation)))

    def _running(self) -> World:
        if self._world is None:
            raise AgentError(self.key, "it has no world yet: call open() first.")
        return self._world

    def drive(self, command: DefDict, dt: float) -> None:
        """Advance the physics by `dt` seconds, motors told the command."""
        world = self._running()
        speeds = [command[hinge.name] for hinge in self._body.hinges]
        # dt is seldom an exact multiple in binary: a millionth more is no more.
        count = max(1, ceil(dt / self.options["physics_step"] - 1e-6))
        for done in range(0, count, LOOK):
            world.advance(speeds, dt / count, min(LOOK, count - done))
            self._follow(world)

    def _follow(self, world: World) -> None:
        """Keep count of the heading, which an engine knows only within one turn."""
        yaw = _yaw(world.pose()[1])
        self.state["heading"] += _wrap(yaw - self._yaw)
        self._yaw = yaw

    def sense(self) -> None:
        """Read position and sensors from the world."""
        world = self._running()
        position, _ = world.pose()
        self.state["x"], self.state["y"] = float(position[0]), float(position[1])
        self._measure(world)

    def _measure(self, world: World) -> None:
        position, rotation = world.pose()
        for sensor in self._body.sensors:
            self.sensors[sensor.name] = _read(sensor, world, position, rotation)


def _told_and_heard(body: Body) -> Iterator[tuple[str, str, str]]:
    """Yield port, path and unit of every field that physics reads or writes."""
    yield from (("state", path, "m") for path in ("x", "y"))
    yield "state", "heading", "rad"
    for hinge in body.hinges:
        yield "command", hinge.name, "rad/s"
    units = {Ray: "m", Gyro: "rad/s", Compass: ""}
    for sensor in body.sensors:
        yield "sensors", sensor.name, units[type(sensor)]


def _read(sensor: Sensor, world: World, position: Array, rotation: Array) -> float:
    match sensor:
        case Ray(_, at, direction, reach):
            start = position + rotation @ np.array(at)
            return world.ray(start, rotation @ np.array(direction), reach)
        case Gyro(_, axis):
            return float(world.spin() @ rotation @ np.array(axis))
        case Compass(_, axis):
            return float(np.array(NORTH) @ rotation @ np.array(axis))


def _yaw(rotation: Array) -> float:
    return float(atan2(float(rotation[1, 0]), float(rotation[0, 0])))


def _wrap(angle: float) -> float:
    return (angle + pi) % (2 * pi) - pi
