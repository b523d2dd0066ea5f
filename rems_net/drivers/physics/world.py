"""PhysicsWorld: one world of an engine, with all robots in it."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from math import ceil

from rems_net.agents.robot import Robot
from rems_net.agents.tick import Tick
from rems_net.bodies.body import Body
from rems_net.bodies.parts import Array
from rems_net.drivers.physics.engine import Engine
from rems_net.drivers.physics.member import Member
from rems_net.drivers.physics.reading import Moment
from rems_net.errors import AgentError
from rems_net.scenes.outline import Pose, check_free, check_places
from rems_net.scenes.scene import Scene

Build = Callable[[Sequence[Body], Scene], Engine]

#: s. New bodies come to rest on their wheels within this.
SETTLE = 0.5


class PhysicsWorld:
    """An engine's world with its robots: built, stepped, and put back.

    A robot that shares no world is alone in its own.
    """

    #: the robots' present poses and speeds
    _now: Moment
    before: Callable[[Tick], None] | None = None

    def __init__(
        self, build: Build, members: Sequence[Member], scene: Scene, step: float
    ):
        self._build, self.members, self.scene = build, members, scene
        self._feeling = [member for member in members if member.feels]
        self._serving = [n for n, member in enumerate(members) if member.servos]
        #: the longest step of the engine, s, and the most steps between two looks
        self._step = step
        self._most = min(member.look_every for member in members)
        self._uneven = bool(scene.mjcf) or any(thing.pitch for thing in scene.things)
        self._engine: Engine | None = None
        self._starts: list[tuple[float, ...]] = []

    def open(self) -> None:
        """Build the world, and let bodies come to rest at their initial poses; once."""
        if self._engine is not None:
            return
        members, step = self.members, self._step
        engine = self._build([member.body for member in members], self.scene)
        self._engine = engine
        self._now = now = Moment(engine)
        for n, member in enumerate(members):
            member.enter(engine.instances[n], now, n)
        now.settle()
        self._put(engine, members)
        rest = [member.rest() for member in members]
        for count in self._blocks(ceil(SETTLE / step)):
            self._command(engine, rest, step * count)
            engine.advance(step, count)
        # Undo the small motion of coming to rest: t = 0 is the initial pose.
        self._put(engine, members)
        engine.keep()
        self._haunt(engine)
        self._starts = [member.start() for member in members]
        self._look(members)

    def _look(self, members: Sequence[Member]) -> None:
        """Update these robots' poses and sensors."""
        self._now.look()
        self._now.sense()
        for member in members:
            member.look()

    def _put(self, engine: Engine, members: Sequence[Member]) -> None:
        """Put these robots at the poses in their states."""
        if members:
            self._now.look()
            for member in members:
                member.place()
            engine.refresh()

    def advance(self, dt: float) -> None:
        """Step all robots by `dt` seconds, each with the command that acts."""
        self.drive([m.targets(m.robot.acting(dt)) for m in self.members], dt)

    def drive(self, targets: Sequence[Sequence[float]], dt: float) -> None:
        """Advance by `dt` seconds, with the motors of each robot at its targets."""
        for calculate in self.driving(targets, dt):
            calculate()

    def driving(
        self, targets: Sequence[Sequence[float]], dt: float
    ) -> Iterator[Callable[[], None]]:
        """Do `drive`, and yield the engine's calculations instead of making them.

        The caller makes each before it takes the next one; other worlds may make theirs
        at the same time, in other threads.
        """
        engine = self._running()
        # In binary, dt is seldom an exact multiple: ignore a millionth of a step.
        count = max(1, ceil(dt / self._step - 1e-6))
        for some in self._blocks(count):
            self._command(engine, targets, dt / count * some)
            yield partial(engine.advance, dt / count, some)
            self._now.look()
            for member in self.members:
                member.follow()
        self._now.sense()
        for member in self._feeling:
            member.feel(dt)

    def _command(
        self, engine: Engine, targets: Sequence[Sequence[float]], dt: float
    ) -> None:
        told = [*targets]
        for n in self._serving:
            told[n] = self.members[n].told(targets[n], dt)
        engine.command(told)

    def _blocks(self, count: int) -> Iterator[int]:
        """Yield numbers of steps between two updates of servos and headings."""
        for done in range(0, count, self._most):
            yield min(self._most, count - done)

    def reset(self, robots: Sequence[Robot]) -> None:
        """Put robots back to their start; with all of them, everything else, too.

        Raises AgentError if another robot stands where one of them starts, SchemaError
        if something else does.
        """
        back = [member for member in self.members if member.robot in robots]
        others = [member for member in self.members if member not in back]
        for member in back if others else ():
            places = [(one.robot.key, one.outline.at(one.where())) for one in others]
            check_free(member.robot.key, member.outline, member.beginning(), places)
        if not others and len(back) > 1:
            keys = [member.robot.key for member in back]
            bodies = [member.outline for member in back]
            starts = [member.beginning() for member in back]
            check_places(keys, bodies, starts, self.scene)
        for member in back:
            member.robot.rewind()
        engine = self._engine
        if engine is None:
            return
        away = [m for m in back if m.start() != self._starts[self.members.index(m)]]
        if others:
            for member in back:
                member.instance.restore()
            self._put(engine, away)
        elif away and self._uneven:  # a robot comes to rest there in its own way
            self.close()
            self.open()
            return
        else:
            engine.restore()
            self._put(engine, away)
            self._haunt(engine)
        self._look(back)

    def thing(self, number: int) -> tuple[Array, Array]:
        """Return the pose of a thing: position (3,), m, and rotation (3, 3)."""
        return self._running().thing(number)

    def follow(self, number: int, pose: Pose | None) -> list[str]:
        """Put a ghost to a pose; return the keys of robots that it is inside of."""
        ghost = self.scene.ghosts[number]
        if pose is None and ghost.pose is None:
            return []
        robots = ((m.robot.key, m.outline.at(m.where())) for m in self.members)
        inside = ghost.move(pose, robots)
        self._running().haunt(number, ghost)
        return inside

    def look(self, number: int) -> dict[str, float | bool]:
        """Return the values of the rays and switches of a ghost, by sensor."""
        return self.scene.ghosts[number].sensed(partial(self._running().look, number))

    def _haunt(self, engine: Engine) -> None:
        for number, ghost in enumerate(self.scene.ghosts):
            engine.haunt(number, ghost)

    def close(self) -> None:
        """Close the engine's world."""
        engine, self._engine = self._engine, None
        for member in self.members:
            member.leave()
        if engine is not None:
            engine.close()

    def _running(self) -> Engine:
        if self._engine is None:
            raise AgentError(
                self.members[0].robot.key,
                "it has no world yet: call open() first. (R0313)",
            )
        return self._engine
