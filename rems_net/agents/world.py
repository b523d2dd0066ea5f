"""World: a place that robots share, with its walls and things."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol

from rems_net.agents.agent import Agent
from rems_net.agents.ports import Settings
from rems_net.agents.robot import Driver, Robot, driver_of
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick
from rems_net.agents.verbs import verb
from rems_net.bodies.arena import Arena
from rems_net.defdict import (
    Field,
    Schema,
    angle,
    array,
    length,
    many,
    mass,
    number,
    text,
)
from rems_net.errors import SchemaError
from rems_net.maths import atan2, hypot
from rems_net.scenes.description import described
from rems_net.scenes.scene import Scene

#: position and angles of a thing
OBJECT = Schema(
    "world.object",
    {
        "pose": {
            "x": length(doc="of its middle"),
            "y": length(doc="of its middle"),
            "z": length(doc="of its middle"),
            "heading": angle(doc="counter-clockwise from +x, -pi to pi"),
            "pitch": angle(doc="up from the floor, -pi/2 to pi/2"),
            "roll": angle(doc="about its own x, -pi to pi"),
        }
    },
)

_AT = {
    "x": length(doc="of its middle"),
    "y": length(doc="of its middle"),
    "above": length(doc="of its lowest point above the floor"),
    "heading": angle(doc="counter-clockwise from +x"),
    "mass": mass(range=(0, 1e4), doc="at 0 it stays where it is"),
    "friction": number(default=0.5, range=(0, 5), doc="Coulomb"),
}


def _colour(*default: float) -> Field:
    """Return a colour for cameras; by default each kind of thing has another."""
    return array(3, default=default, range=(0, 1), doc="red, green, blue")


_EDGE = length(default=0.1, range=(1e-4, 1e3))
_EDGES = array(3, "m", default=(0.1, 0.1, 0.1), range=(1e-4, 1e3))
BOX = Schema(
    "world.box",
    {"name": text(), "size": _EDGES, **_AT, "colour": _colour(0.64, 0.42, 0.20)},
)
BALL = Schema(
    "world.ball",
    {"name": text(), "radius": _EDGE, **_AT, "colour": _colour(0.88, 0.14, 0.10)},
)
CYLINDER = Schema(
    "world.cylinder",
    {
        "name": text(),
        "radius": _EDGE,
        "height": _EDGE,
        **_AT,
        "colour": _colour(0.14, 0.30, 0.80),
    },
)
RAMP = Schema(
    "world.ramp",
    {
        "name": text(),
        "length": length(range=(1e-3, 1e3), default=0.5, doc="along the floor"),
        "width": length(range=(1e-3, 1e3), default=0.3),
        "height": length(range=(1e-3, 1e3), default=0.05, doc="of its upper end"),
        "x": length(doc="of the middle of its lower end"),
        "y": length(doc="of the middle of its lower end"),
        "heading": angle(doc="uphill, counter-clockwise from +x"),
        "friction": number(default=0.5, range=(0, 5), doc="Coulomb"),
        "colour": _colour(0.60, 0.60, 0.60),
    },
)
WALL = Schema(
    "world.wall",
    {
        "start": array(2, "m", doc="on the floor, in its middle"),
        "end": array(2, "m", doc="on the floor, in its middle"),
        "height": _EDGE,
        "thickness": length(range=(1e-4, 1e3), default=0.01),
    },
)


class Shared(Protocol):
    """World of a driver, with all the robots in it."""

    scene: Scene

    def advance(self, dt: float) -> None:
        """Let the commands of all these robots act for `dt` seconds."""

    def reset(self, robots: Sequence[Any]) -> None:
        """Put robots back to their start; if all, everything else, too.

        Raises AgentError if another robot stands at the start of one.
        """

    def thing(self, number: int) -> tuple[Any, Any]:
        """Return where the scene's thing of that number is.

        Its position (3,) in m and its rotation (3, 3), thing to world.
        """


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
    )
    scene: Scene
    #: number and name of each thing that may move
    _moving: Sequence[tuple[int, str]] = ()
    #: names of its own ports
    _own: frozenset[str] = frozenset()
    _shared: Shared | None = None
    _robots: Sequence[Robot] = ()

    def prepare(self) -> None:
        """Find the things in it; each has a port of its name."""
        super().prepare()
        self.scene = described(self.options, self.folder)
        taken = {*dir(self)} - self._own
        self._own = frozenset(self.scene.names)
        for name in self.scene.names:
            if name in taken:
                raise SchemaError(
                    f"a thing is called {name!r}, and every world has something else "
                    "by that name; give it another one. (R0432)"
                )
            self.settle(name, OBJECT)
        still = {thing.name for thing in self.scene.things if not thing.mass}
        names = enumerate(self.scene.names)
        self._moving = [(i, name) for i, name in names if name not in still]
        for thing in self.scene.things:
            self._tell(thing.name, thing.at, thing.rotation())

    def schemas(self) -> dict[str, Schema]:
        """Return a schema for everything that has a name."""
        return dict.fromkeys(self.scene.names, OBJECT)

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
        if scene == Scene():  # it has no settings
            arena: Arena = getattr(first, "arena", Arena)()
            scene = Scene(tuple(arena.walls()), radius=arena.radius)
        self._shared = type(first).share(robots, scene)
        self._robots = robots
        for robot in robots:
            robot.shared = robot._world = self._shared

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
