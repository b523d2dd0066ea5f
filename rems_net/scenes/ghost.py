"""Ghost: a body that follows a pose; robots see and touch it, and nothing moves it."""

from collections.abc import Iterable

from rems_net.bodies.body import Body
from rems_net.bodies.parts import Array
from rems_net.scenes import outline, rays
from rems_net.scenes.outline import TOUCH, Outline, Pose
from rems_net.scenes.rays import Look
from rems_net.scenes.scene import Solid, solids_of

#: m. A ghost that is further inside a robot is reported, and an engine does not push
#: them apart: it would throw the robot away.
DEEP = 0.01


class Ghost:
    """The body of a robot that is elsewhere.

    pose: x and y in m, heading in rad; None if it is not there.
    touches: whether robots can touch it; not while it is inside of one.
    """

    def __init__(self, name: str, body: Body):
        self.name, self.body = name, body
        self.outline = outline.of_body(body)
        self.solids = solids_of(body)
        self.pose: Pose | None = None
        self.touches = False

    def move(
        self, pose: Pose | None, robots: Iterable[tuple[str, Outline]]
    ) -> list[str]:
        """Take a pose; return the keys of the robots that it is inside of."""
        self.pose = pose
        if pose is None:
            self.touches = False
            return []
        mine = self.outline.at(pose)
        depths = {key: mine.depth(robot) for key, robot in robots}
        inside = [key for key, depth in depths.items() if depth > DEEP]
        apart = all(depth <= TOUCH for depth in depths.values())
        self.touches = not inside and (self.touches or apart)
        return inside

    @property
    def heading(self) -> float:
        """Its heading, rad; 0 if it is not there."""
        return self.pose[2] if self.pose is not None else 0.0

    @property
    def place(self) -> tuple[Array, Array]:
        """Position (3,) in m and rotation (3, 3), body to world."""
        return rays.stand(self.pose or (0.0, 0.0, 0.0), self.body.height)

    def here(self) -> Outline:
        """Return its outline at its pose."""
        return self.outline.at(self.pose or (0.0, 0.0, 0.0))

    def stands(self) -> list[Solid]:
        """Return its solids at their places in the world; none if it is not there."""
        if self.pose is None:
            return []
        place = self.place
        return [solid.moved(*place) for solid in self.solids]

    def sensed(self, look: Look) -> dict[str, float | bool]:
        """Return the values of its body's rays and switches, by sensor.

        One that is not there sees nothing.
        """
        if self.pose is None:
            look = nothing
        return rays.sensed(self.body, *self.place, look)


def nothing(start: Array, way: Array, reach: float) -> float:
    """Return the distance if there is no obstacle."""
    return reach
