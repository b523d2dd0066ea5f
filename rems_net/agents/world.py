"""World: a place that robots share, with its walls and things."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

from rems_net.agents import registry
from rems_net.agents.agent import Agent
from rems_net.agents.ports import Settings
from rems_net.agents.robot import Driver, Robot, driver_of
from rems_net.agents.runtime import SAME, runtime
from rems_net.agents.tick import Tick, time_of
from rems_net.agents.verbs import verb
from rems_net.bodies.arena import Arena
from rems_net.bodies.body import Embodied, Ray, Switch
from rems_net.defdict import DefDict, Schema, array, length, many, text
from rems_net.errors import SchemaError
from rems_net.events import warn
from rems_net.maths import atan2, hypot
from rems_net.scenes import marking
from rems_net.scenes.description import (
    BALL,
    BOX,
    CYLINDER,
    GHOST,
    HAUNT,
    OBJECT as OBJECT,
    RAMP,
    WALL,
    described,
    level,
)
from rems_net.scenes.ghost import Ghost
from rems_net.scenes.scene import Scene
from rems_net.scenes.shared import Shared

#: before the name of a ghost: the port that reads its pose
GHOSTS = "@ghosts"


class World(Agent):
    """A place, with its walls and things.

    Robots that name it are in it together, in one process: they touch and see each
    other. A world without settings is the arena of its robots' definition. Each thing
    that has a name can be read at `world/<name>/<thing>/pose`.
    """

    kind = "world"
    options = Settings(
        radius=length(range=(0, 1e3), doc="of a round wall; 0 for none"),
        size=array(2, "m", range=(0, 1e3), doc="inside of four walls; 0, 0 for none"),
        wall_height=length(default=0.1, range=(1e-3, 100)),
        walls=many(WALL, max_len=1000, doc="from a start to an end, thickness, height"),
        boxes=many(BOX, max_len=1000, doc="name, size, x, y, mass, ..."),
        balls=many(BALL, max_len=1000, doc="name, radius, x, y, mass, ..."),
        cylinders=many(CYLINDER, max_len=1000, doc="upright: radius, height, ..."),
        ramps=many(RAMP, max_len=1000, doc="length, width, height, x, y, ..."),
        mjcf=text(max_len=4096, doc="a file that is the place, for MuJoCo"),
        ghosts=many(GHOST, max_len=100, doc="name, definition, follows, max_age"),
        markers=many(marking.ON, max_len=100, doc="on a thing, or on the floor"),
    )
    scene: Scene
    #: number and name of each thing that may move
    _moving: Sequence[tuple[int, str]] = ()
    #: names of its own ports
    _own: tuple[str, ...] = ()
    _shared: Shared | None = None
    _robots: Sequence[Robot] = ()

    def prepare(self) -> None:
        """Find the things in it; each has a port of its name."""
        super().prepare()
        scene = described(self.options, self.folder)
        made = [_ghost(said, self.folder) for said in self.options["ghosts"]]
        scene = replace(scene, ghosts=tuple(ghost for ghost, _ in made))
        self.scene = marking.in_scene(self.options["markers"], scene)
        ports = dict.fromkeys(self.scene.names, OBJECT)
        for ghost, sensors in made:
            ports |= {ghost.name: HAUNT, f"{ghost.name}_sensors": sensors}
        taken = {*dir(self)} - {*self._own}
        self._own = tuple(ports)
        for name, schema in ports.items():
            if name in taken:
                raise SchemaError(
                    f"a thing is called {name!r}, and every world has something else "
                    "by that name; give it another one. (R0432)"
                )
            self.settle(name, schema)
        runtime(self).rules = (level,)
        self._reported: set[tuple[str, str]] = set()
        still = {thing.name for thing in self.scene.things if not thing.mass}
        names = enumerate(self.scene.names)
        self._moving = [(i, name) for i, name in names if name not in still]
        for thing in self.scene.things:
            self._tell(thing.name, thing.at, thing.solid.turn)

    def schemas(self) -> dict[str, Schema]:
        """Return a schema for everything that has a name."""
        return {name: self.__dict__[name].schema for name in self._own}

    def published(self) -> dict[str, Schema]:
        return self.schemas()

    def gather(self, robots: Sequence[Robot]) -> None:
        """Put these prepared robots into it. Raises SchemaError."""
        robots = sorted(robots, key=lambda robot: robot.key)
        first, *others = robots
        if not isinstance(first, Driver):
            raise SchemaError(f"{first.key} has no driver. (R0432)")
        for other in others:
            _check_alike(self.key, first, other)
        scene = self.scene
        if replace(scene, ghosts=(), markers=()) == Scene():  # it has no settings
            arena: Arena = getattr(first, "arena", Arena)()
            walls = tuple(arena.walls())
            scene = replace(scene, walls=walls, radius=arena.radius)
        self._shared = type(first).share(robots, scene)
        self._robots = robots
        for robot in robots:
            robot.shared = robot._world = self._shared
        self._shared.before = self._follow if scene.ghosts else None

    @verb
    def reset(
        self,
        seed: int | None = None,
        initial: Mapping[str, Mapping[str, Any]] | None = None,
    ) -> None:
        """Put it back to the start, with all that is in it.

        seed: of its robots, as in `Robot.reset`.  initial: their starts from now on, by
        the key of the robot.
        """
        for robot in self._robots:
            robot.begin_at(seed, (initial or {}).get(robot.key))
        if self._shared is not None:
            self._shared.reset(self._robots)
            self._look()

    def step(self, tick: Tick) -> None:
        """Publish the poses of its things."""
        self._look()

    def _look(self) -> None:
        if self._shared is not None:
            for number, name in self._moving:
                self._tell(name, *self._shared.thing(number))
            for number, ghost in enumerate(self.scene.ghosts):
                seen = self._shared.look(number)
                self.__dict__[f"{ghost.name}_sensors"].update(seen)

    def _follow(self, tick: Tick) -> None:
        """Put each ghost to its newest pose, before the robots step."""
        run, dt = runtime(self), runtime(self._robots[0]).dt
        assert self._shared is not None
        for number, ghost in enumerate(self.scene.ghosts):
            said = self.options["ghosts"][number]
            port = f"{GHOSTS}/{ghost.name}"
            pose, age = ghost.pose, 0.0
            if known := run.source_ticks.get(port, 0):  # 0: nothing was written yet
                new = self.__dict__[port]
                # A value is as old as what it was computed from, such as a picture.
                age = max(tick.t - time_of(known, dt), new.get("age", 0.0))
                if age > said["max_age"] + SAME:
                    self._report(ghost.name, "", tick)
                elif new.get("there", True):
                    self._reported.discard((ghost.name, ""))
                    pose = new["x"], new["y"], _wrapped(new["heading"])
            for robot in self._shared.follow(number, pose):
                self._report(ghost.name, robot, tick)
            value = {"there": pose is not None, "age": age}
            if pose is not None:
                at = zip(("x", "y", "heading"), pose, strict=True)
                value |= {f"pose/{path}": number for path, number in at}
                value["pose/z"] = ghost.body.height
            self.__dict__[ghost.name].update(value)

    def _report(self, ghost: str, robot: str, tick: Tick) -> None:
        """Warn once that a ghost is inside a robot; without one, that it stays."""
        if (ghost, robot) in self._reported:
            return
        self._reported.add((ghost, robot))
        where = runtime(self).sources.get(f"{GHOSTS}/{ghost}", "")
        text = (
            f"{self.key}/{ghost} is inside {robot}, at {tick.t:g} s: {where} is where "
            "that robot stands. They do not touch until they are apart."
        )
        if not robot:
            text = (
                f"{self.key}/{ghost} stays where it is, at {tick.t:g} s: the pose of "
                f"{where} is too old (max_age)."
            )
        warn("ghost", text, self.key, tick.n)

    def _tell(self, name: str, at: Any, rotation: Any) -> None:
        x, y, z = map(float, at)
        (a, _, _), (b, _, _), (c, d, e) = rotation.tolist()
        pose = {
            "x": x,
            "y": y,
            "z": z,
            "heading": float(atan2(b, a)),
            "pitch": float(atan2(c, hypot(a, b))),
            "roll": float(atan2(d, e)),
        }
        self.__dict__[name].update({f"pose/{path}": v for path, v in pose.items()})


def _ghost(said: DefDict, folder: Path) -> tuple[Ghost, Schema]:
    """Return a ghost, and the schema of its rays and switches. Raises RemsError."""
    # Imported here, or each process of a run would load the readers of robots' files.
    from rems_net.bodies.files.built import built

    name = said["name"]
    made: Any = registry.load(said["definition"], folder)
    robot: Robot = made(name)
    robot.prepare()
    if not isinstance(robot, Embodied):
        raise SchemaError(
            f"the ghost {name!r} is a {type(robot).__name__}, which has no body(), so "
            "nothing can see it; name a definition with one, such as "
            'definition = "woodbot". (R0223)'
        )
    body = built(robot.body())
    sensors = robot.__dict__.get("sensors")
    own = Schema("sensors", {}) if sensors is None else sensors.schema
    rays = [one.name for one in body.sensors if isinstance(one, Ray | Switch)]
    seen = [path for path in own.paths if path in rays]
    return Ghost(name, body), own.slice(*seen)


def _wrapped(heading: float) -> float:
    """Return a heading from -pi to pi rad; one that is there already, to the bit."""
    return heading if -pi <= heading <= pi else (heading + pi) % (2 * pi) - pi


def contents(world: World) -> tuple[Scene, Sequence[Robot]]:
    """Return the place, or its robots' arena if it has no settings; and the robots."""
    shared = world._shared
    return world.scene if shared is None else shared.scene, world._robots


def gather(agents: Iterable[Agent]) -> None:
    """Put the robots of one host into the host's world, if there is one."""
    agents = list(agents)
    for world in agents:
        if isinstance(world, World):
            world.gather([a for a in agents if isinstance(a, Robot)])


def _sharer(robot: Driver) -> type:
    """Return the class that makes the worlds of a robot's driver."""
    return next(base for base in type(robot).__mro__ if "share" in vars(base))


def _check_alike(world: str, first: Driver, other: Robot) -> None:
    """Refuse robots that have different drivers, or step at different ticks."""
    if not isinstance(other, Driver) or _sharer(other) is not _sharer(first):
        names = [driver_of(type(robot)).__name__ for robot in (first, other)]
        raise SchemaError(
            f"{first.key} is done by {names[0]} and {other.key} by {names[1]}, and a "
            f"world is made by one of them: give all robots of {world} the same driver."
            " (R0432)"
        )
    mine, its = runtime(first).every, runtime(other).every
    if mine != its:
        raise SchemaError(
            f"{first.key} steps at every {mine} ticks and {other.key} at every "
            f"{its}; robots of one world move together: give all of {world} "
            "the same `every`. (R0432)"
        )
