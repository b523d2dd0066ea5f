"""Description: a scene from a world's options."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from rems_net.bodies.arena import WALL_THICKNESS, Arena, Wall
from rems_net.bodies.parts import Box, Cylinder, Sphere, Vector
from rems_net.defdict import (
    DefDict,
    Field,
    Schema,
    angle,
    array,
    boolean,
    length,
    mass,
    number,
    rule,
    text,
    time,
)
from rems_net.errors import SchemaError
from rems_net.maths import atan2, hypot, sincos
from rems_net.scenes.scene import Scene, Thing
from rems_net.system.reading import DESCRIPTION, read_file

#: m. Thickness of the board that a ramp is made of.
BOARD = 0.01

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
#: place of a ghost
HAUNT = Schema(
    "world.ghost",
    {
        **OBJECT.entries,
        "there": boolean(doc="not before its first pose"),
        "age": time(doc="of the pose that it follows"),
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
#: s. A ghost whose pose is older stays where it was.
MAX_AGE = 0.5
GHOST = Schema(
    "world.ghost",
    {
        "name": text(),
        "definition": text(max_len=4096, doc='of the robot: "woodbot"'),
        "follows": text(max_len=256, doc='port with its pose: "robot/real/state"'),
        "max_age": time(default=MAX_AGE, range=(0, 3600), doc="of a pose to follow"),
    },
)
#: fields that a ghost needs to follow
POSE = ("x", "y", "heading")
#: Pose that a ghost follows; the last two are optional.
FOLLOWED = Schema(
    "ghost.followed",
    {
        "x": length(),
        "y": length(),
        "heading": angle(doc="counter-clockwise from +x"),
        "age": time(doc="of the pose, when it was written"),
        "there": boolean(default=True, doc="whether there is a pose"),
    },
)


@rule(
    needs=OBJECT.slice("pose/x", "pose/y", "pose/heading"),
    gives=FOLLOWED.slice(*POSE),
)
def level(thing: DefDict) -> dict[str, float]:
    """Return the pose of a thing as that of a robot."""
    return {path: thing[f"pose/{path}"] for path in POSE}


def described(said: DefDict, folder: Path) -> Scene:
    """Return the scene of a world's options. Raises SchemaError for impossible ones.

    folder: base of relative file names
    """
    arena = Arena(said["radius"], said["wall_height"])
    walls = [*arena.walls(), *_four(said), *map(_wall, said["walls"])]
    things = list(_things(said))
    bodies: tuple[str, ...] = ()
    mjcf = said["mjcf"] and str(folder / said["mjcf"])
    if mjcf:
        if walls or things:
            raise SchemaError(
                f"mjcf = {said['mjcf']!r} is the whole place: write walls and things "
                "in that file, or leave mjcf out. (R0217)"
            )
        bodies = _bodies(Path(mjcf), said["mjcf"])
    ghosts = [ghost["name"] for ghost in said["ghosts"]]
    _check_names([*(thing.name for thing in things), *bodies, *ghosts])
    return Scene(tuple(walls), tuple(things), arena.radius, mjcf, bodies)


def _four(said: DefDict) -> Iterator[Wall]:
    length, width = said["size"]
    if not length and not width:
        return
    if not (length and width):
        raise SchemaError(
            f"size is [{length:g}, {width:g}]; expected length and width, such as "
            "[2.0, 1.0], or neither. (R0217)"
        )
    if said["radius"]:
        raise SchemaError(
            "there is a radius and a size; an arena is round or square: "
            "keep one. (R0217)"
        )
    height = float(said["wall_height"])
    # Walls meet at the corners, outside of the area.
    thick = WALL_THICKNESS
    for sign in (1.0, -1.0):
        across = (thick, float(width) + 2 * thick, height)
        yield Wall(across, (sign * (float(length) + thick) / 2, 0.0, height / 2), 0.0)
        along = (float(length), thick, height)
        yield Wall(along, (0.0, sign * (float(width) + thick) / 2, height / 2), 0.0)


def _wall(said: DefDict) -> Wall:
    (x, y), (to_x, to_y) = said["start"].tolist(), said["end"].tolist()
    length = float(hypot(to_x - x, to_y - y))
    if not length:
        raise SchemaError(
            f"a wall starts and ends at [{x:g}, {y:g}]; give it another end. (R0217)"
        )
    height = said["height"]
    middle = ((x + to_x) / 2, (y + to_y) / 2, height / 2)
    yaw = float(atan2(to_y - y, to_x - x))
    return Wall((length, said["thickness"], height), middle, yaw)


def _things(said: DefDict) -> Iterator[Thing]:
    for box in said["boxes"]:
        size = tuple(box["size"].tolist())
        yield _standing(box, Box(size), size[2])
    for ball in said["balls"]:
        yield _standing(ball, Sphere(ball["radius"]), 2 * ball["radius"])
    for cylinder in said["cylinders"]:
        shape = Cylinder(cylinder["radius"], cylinder["height"])
        yield _standing(cylinder, shape, cylinder["height"])
    yield from map(_ramp, said["ramps"])


def _standing(said: DefDict, shape: Any, height: float) -> Thing:
    at: Vector = (said["x"], said["y"], said["above"] + height / 2)
    return Thing(
        said["name"],
        shape,
        at,
        said["heading"],
        mass=said["mass"],
        friction=said["friction"],
        colour=tuple(said["colour"].tolist()),
    )


def _ramp(said: DefDict) -> Thing:
    """Return a board whose upper side rises from the floor to the height."""
    run, rise = said["length"], said["height"]
    slope = float(hypot(run, rise))
    s, c = sincos(said["heading"])
    # The middle: half way up the slope from the lower end, then half a board down.
    ahead = run / 2 + BOARD / 2 * rise / slope
    up = rise / 2 - BOARD / 2 * run / slope
    return Thing(
        said["name"],
        Box((slope, said["width"], BOARD)),
        (said["x"] + c * ahead, said["y"] + s * ahead, up),
        said["heading"],
        pitch=float(atan2(rise, run)),
        friction=said["friction"],
        colour=tuple(said["colour"].tolist()),
    )


def _check_names(names: Iterable[str]) -> None:
    known: set[str] = set()
    for name in names:
        if not is_chunk(name):
            raise SchemaError(
                f"a thing is called {name!r}; each has a name of letters, digits, '_' "
                "and '-', such as 'crate', at which it can be read. (R0218)"
            )
        if name in known:
            raise SchemaError(
                f"two things are called {name!r}; give one another name. (R0218)"
            )
        known.add(name)


def is_chunk(name: str) -> bool:
    """Return whether a thing of this name can have a key of its own."""
    plain = name.replace("_", "").replace("-", "")
    return name.isascii() and plain.isalnum() and name[0].isalnum() and len(name) < 64


def _bodies(path: Path, said: str) -> tuple[str, ...]:
    """Return the named bodies of a MuJoCo model's worldbody, from its text."""
    from xml.etree import ElementTree  # takes 7 ms to load

    try:
        root = ElementTree.fromstring(read_file(path, DESCRIPTION))
    except OSError as error:
        raise SchemaError(
            f"mjcf is {said!r}, and {path} cannot be read: {error.strerror}. (R0201)"
        ) from None
    except (ElementTree.ParseError, LookupError) as error:
        raise SchemaError(f"{said} is no XML: {error}. (R0202)") from None
    if root.tag != "mujoco":
        raise SchemaError(
            f"{said} begins with <{root.tag}>; a MuJoCo model (MJCF) with "
            "<mujoco>. (R0202)"
        )
    found = root.findall("worldbody/body")
    names = [str(body.get("name")) for body in found if body.get("name")]
    return tuple(name for name in names if is_chunk(name))
