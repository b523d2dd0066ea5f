"""What the pictures of robots show besides the shapes that touch: wheels' hubs, servos,
buttons, a mecanum wheel's rollers. None of it is in the physics, and no sensor sees it.

Sources: the figures of the definitions, the e-Manual's drawings of the servos (28.5 x
46.5 x 34 mm), the makers' photographs.
"""

from collections.abc import Callable

from rems_net.bodies.body import Body
from tests.robots.looks import arms, wheeled
from tests.robots.looks.shapes import Look

LOOKS: dict[str, Callable[[Body], Look]] = {
    "scaler": arms.scaler,
    "scaler_left": arms.scaler,
    "woodbot": wheeled.woodbot,
    "create2": wheeled.create2,
    "dynabot": wheeled.dynabot,
    "epuck": wheeled.epuck,
    "epuck_camera": wheeled.epuck,
    "pioneer3dx": wheeled.pioneer3dx,
    "pioneer3at": wheeled.pioneer3at,
    "moose": wheeled.moose,
    "youbot": arms.youbot,
    "youbot_base": arms.youbot_base,
    "youbot_arm": arms.youbot_arm,
}


def look(name: str, body: Body) -> Look:
    """Return how a robot of that name is drawn."""
    return LOOKS[name](body) if name in LOOKS else Look()
