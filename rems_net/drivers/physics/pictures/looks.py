"""Looks: colours, light and the floor's tiles, the same in both engines."""

from collections.abc import Iterable, Iterator

from rems_net.bodies.body import Body, Camera
from rems_net.bodies.joints import Hinge, Joint
from rems_net.scenes.scene import Colour

SKY: Colour = (0.80, 0.88, 0.95)
WALL: Colour = (0.52, 0.58, 0.64)
#: colours of the floor's tiles, in turn, and their edge, m: they meet at the origin
TILES: tuple[Colour, Colour] = ((0.93, 0.93, 0.90), (0.80, 0.80, 0.77))
TILE = 0.1
#: of ghosts, which MuJoCo draws translucent
SHADE: Colour = (0.50, 0.50, 0.75)
WHEEL: Colour = (0.13, 0.13, 0.14)
#: colours of robots, in their order in the world
HULLS: tuple[Colour, ...] = (
    (0.30, 0.62, 0.35),
    (0.56, 0.36, 0.70),
    (0.16, 0.62, 0.66),
    (0.86, 0.66, 0.16),
    (0.70, 0.42, 0.52),
    (0.45, 0.45, 0.22),
)
#: brightness everywhere, and in addition on faces towards the light; its direction
AMBIENT, DIFFUSE = 0.55, 0.45
LIGHT = (-0.2, 0.5, 1.0)
#: m. Things nearer or further away than this are not drawn.
NEAR, FAR = 0.004, 100.0


def cameras(bodies: Iterable[Body]) -> Iterator[Camera]:
    """Yield the cameras of all these bodies."""
    for body in bodies:
        yield from (one for one in body.sensors if isinstance(one, Camera))


def hull(number: int) -> Colour:
    """Return the colour of the robot with this number in its world."""
    return HULLS[number % len(HULLS)]


def is_wheel(joint: Joint | None) -> bool:
    """Return whether a joint turns without end, as a wheel: it is drawn dark."""
    return isinstance(joint, Hinge) and bool(joint.effort) and joint.servo is None
