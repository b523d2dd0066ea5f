"""Description: a scene from a world's options."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from rems_net.bodies.arena import WALL_THICKNESS, Arena, Wall
from rems_net.bodies.parts import Box, Cylinder, Sphere, Vector
from rems_net.defdict import DefDict
from rems_net.errors import SchemaError
from rems_net.maths import atan2, hypot, sincos
from rems_net.reading import DESCRIPTION, read_file
from rems_net.scenes.scene import Scene, Thing

#: m. Thickness of the board that a ramp is made of.
BOARD = 0.01


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
    _check_names([*(thing.name for thing in things), *bodies])
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
