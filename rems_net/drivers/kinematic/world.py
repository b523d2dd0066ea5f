"""KinematicWorld: kinematic robots that obstacles stop, and that sense obstacles."""

from collections.abc import Callable, Sequence
from math import ceil

from rems_net.agents.robot import Robot
from rems_net.agents.tick import Tick
from rems_net.bodies.body import Body, Box, Embodied
from rems_net.bodies.files.built import built
from rems_net.bodies.parts import Array
from rems_net.defdict import DefDict
from rems_net.drivers.kinematic.model import POSE, Model
from rems_net.drivers.needs import BODY, missing
from rems_net.errors import SchemaError
from rems_net.maths import hypot
from rems_net.scenes import outline, rays
from rems_net.scenes.outline import (
    TOUCH,
    Outline,
    Pose,
    check_free,
    check_places,
)
from rems_net.scenes.rays import Look
from rems_net.scenes.scene import Scene, solids_of

#: halvings of the way to an obstacle: to a millionth of a step
HALVINGS = 20


class KinematicWorld:
    """World in which an obstacle stops a robot. Nothing is ever pushed.

    The robots move one after the other, in the order of their names. A robot that has
    met something stands there until it drives or turns away. Rays and switches of the
    body sense walls, things and other robots, and override `measure`. A robot inside
    of which a ghost stands can only drive out of it.
    """

    before: Callable[[Tick], None] | None = None

    def __init__(self, robots: Sequence[Model], scene: Scene):
        self.robots, self.scene = robots, scene
        self._bodies = [_body(robot) for robot in self.robots]
        self._outlines = [outline.of_body(body) for body in self._bodies]
        self._solids = [solids_of(body) for body in self._bodies]
        self._place = outline.of_scene(scene)
        solids = scene.solids
        self._boxes = rays.Boxes(solids)
        self._others = [s for s in solids if not isinstance(s.shape, Box)]
        keys = [robot.key for robot in self.robots]
        poses = [_pose(robot) for robot in self.robots]
        check_places(keys, self._outlines, poses, scene)

    def advance(self, dt: float) -> None:
        """Step all robots by `dt` seconds, each up to the first obstacle."""
        for number, robot in enumerate(self.robots):
            before = _pose(robot)
            robot.drive(robot.acting(dt), dt)
            after = _pose(robot)
            if after != before:
                pose = self._stopped(number, before, after)
                if pose != after:
                    robot.state.update(dict(zip(POSE, pose, strict=True)))
                    robot.halt()

    def _stopped(self, number: int, before: Pose, after: Pose) -> Pose:
        """Return the last free pose on the straight way from one pose to another."""
        mine = self._outlines[number]
        there = [*self._place, *self._but(number)]
        ghosts = [one.here() for one in self.scene.ghosts if one.pose is not None]
        least = [(one, max(TOUCH, mine.at(before).depth(one))) for one in ghosts]

        def meets(share: float) -> bool:
            here = mine.at(_between(before, after, share))
            deeper = any(here.depth(one) > depth for one, depth in least)
            return deeper or bool(outline.met(here, there))

        way = float(hypot(after[0] - before[0], after[1] - before[1]))
        way += abs(after[2] - before[2]) * mine.reach
        looks = max(1, ceil(2 * way / max(mine.reach, 1e-6)))
        free = 0.0
        for look in range(1, looks + 1):
            share = look / looks
            if meets(share):
                return _between(before, after, _nearest(meets, free, share))
            free = share
        return after

    def see(self, robot: Model) -> dict[str, float | bool]:
        """Return the values of the rays and switches of a robot's body, by sensor."""
        number = self.robots.index(robot)
        body = self._bodies[number]
        place = rays.stand(_pose(robot), body.height)
        return rays.sensed(body, *place, self._past(robot=number))

    def follow(self, number: int, pose: Pose | None) -> list[str]:
        """Put a ghost to a pose; return the keys of robots that it is inside of."""
        return self.scene.ghosts[number].move(pose, self._but())

    def look(self, number: int) -> dict[str, float | bool]:
        """Return the values of the rays and switches of a ghost, by sensor."""
        return self.scene.ghosts[number].sensed(self._past(ghost=number))

    def _past(self, robot: int = -1, ghost: int = -1) -> Look:
        """Return a function that measures rays, which pass through one of them."""
        solids = [*self._others]
        for other, one in enumerate(self.robots):
            if other != robot:
                place = rays.stand(_pose(one), self._bodies[other].height)
                solids += [solid.moved(*place) for solid in self._solids[other]]
        for other, shade in enumerate(self.scene.ghosts):
            if other != ghost:
                solids += shade.stands()

        def look(start: Array, ahead: Array, reach: float) -> float:
            still = self._boxes.distance(start, ahead)
            return min(still, rays.distance(start, ahead, solids))

        return look

    def _but(self, *numbers: int) -> list[tuple[str, Outline]]:
        """Return keys and outlines of all robots except these."""
        pairs = zip(self.robots, self._outlines, strict=True)
        return [
            (robot.key, body.at(_pose(robot)))
            for other, (robot, body) in enumerate(pairs)
            if other not in numbers
        ]

    def reset(self, robots: Sequence[Model]) -> None:
        """Put robots back to their start poses.

        Raises AgentError if another robot stands where one of them starts, SchemaError
        if something else does.
        """
        numbers = [self.robots.index(robot) for robot in robots]
        others = self._but(*numbers)
        bodies = [self._outlines[number] for number in numbers]
        starts = [_start(robot, robot.begins()) for robot in robots]
        check_places([robot.key for robot in robots], bodies, starts, self.scene)
        for robot, body, start in zip(robots, bodies, starts, strict=True):
            check_free(robot.key, body, start, others)
        for robot in robots:
            robot.rewind()
        for robot in robots:  # only now do all robots stand where others sense them
            robot.sense()
            robot.begin_noise()

    def thing(self, number: int) -> tuple[Array, Array]:
        """Return the pose of one of the scene's things: things never move here."""
        solid = self.scene.things[number].solid
        return solid.at, solid.turn


def _body(robot: Robot) -> Body:
    if not isinstance(robot, Embodied):
        raise missing(robot, "body()", "what walls are to stop", BODY)
    schema = robot.state.schema
    units = [getattr(schema.find(path), "unit", None) for path in POSE]
    body = built(robot.body())
    if units != [*POSE.values()] and not body.fixed:
        raise SchemaError(
            f"{robot.key}: a world needs x and y of the state in m and heading in rad; "
            f"{schema.name} has {', '.join(schema.paths)}. (R0306)"
        )
    return body


def _pose(robot: Robot) -> Pose:
    return _start(robot, robot.state)


def _start(robot: Robot, state: DefDict) -> Pose:
    if robot.initial_schema is not robot.state.schema:
        return robot.place  # it is bolted down
    return state["x"], state["y"], state["heading"]


def _between(before: Pose, after: Pose, share: float) -> Pose:
    if share == 1.0:
        return after
    x, y, heading = (a + share * (b - a) for a, b in zip(before, after, strict=True))
    return x, y, heading


def _nearest(meets: Callable[[float], bool], free: float, met: float) -> float:
    """Return the share of the way up to the obstacle between two shares."""
    for _ in range(HALVINGS):
        middle = (free + met) / 2
        if meets(middle):
            met = middle
        else:
            free = middle
    return free
