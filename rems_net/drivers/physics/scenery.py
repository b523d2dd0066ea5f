"""Scenery: bodies and the scene they are in, as one model in MuJoCo's own XML."""

from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import Any
from xml.etree.ElementTree import Element, SubElement, fromstring, tostring

import numpy as np

from rems_net.bodies.body import GRAVITY, Body, Part, Sphere
from rems_net.bodies.files.mjcf import refused
from rems_net.drivers.physics.engine import APART, AWAY, ROLLING
from rems_net.drivers.physics.files.attach import agree, attach
from rems_net.drivers.physics.mjcf import (
    FLOOR,
    STIFF,
    WORLD,
    add_body,
    add_mass,
    section,
    shape,
    text,
)
from rems_net.drivers.physics.pictures.dress import dress
from rems_net.drivers.physics.pictures.looks import SHADE
from rems_net.scenes.ghost import Ghost
from rems_net.scenes.scene import Scene, Thing

#: prefix of robots' names in a scene from the user's own file
ROBOTS = "robots/"
#: A ghost that moves into a robot pushes it away in some 10 ms: in less it would throw.
SOFT = {"solref": "0.01 1", "solimp": "0.99 0.99 0.001"}
#: opacity of ghosts in pictures
THIN = 0.4


def compiled(mujoco: Any, bodies: Sequence[Body], scene: Scene) -> Any:
    """Return MuJoCo's model of the bodies in their scene.

    Raises SchemaError for a user's file that MuJoCo refuses.
    """
    text = mjcf(bodies, scene)
    files = [(n, body) for n, body in enumerate(bodies) if body.source is not None]
    if not scene.mjcf and not files:
        return mujoco.MjModel.from_xml_string(text)
    root = fromstring(text)
    rolling = root.findall("contact/pair") if scene.mjcf else []
    for pair in rolling:
        section(root, "contact").remove(pair)
    robots = mujoco.MjSpec.from_string(tostring(root, encoding="unicode"))
    for number, body in files:
        attach(mujoco, robots, body, number, _meet(bodies, scene))
    if not scene.mjcf:
        try:
            return robots.compile()
        except ValueError as error:
            paths = {str(body.source.path) for _, body in files if body.source}
            raise refused(" and ".join(sorted(paths)), error) from None
    for geom in robots.geoms:
        # In a scene from the user's own file, too, the robot's friction decides.
        geom.priority = 1
    try:
        place = mujoco.MjSpec.from_file(scene.mjcf)
        # Robots are tuned for these; all other options are the file's own.
        place.option.integrator = robots.option.integrator
        place.option.cone = robots.option.cone
        agree(robots, place)
        place.attach(robots, frame=place.worldbody.add_frame(), prefix=ROBOTS)
        floors = [g for g in place.geoms if g.type == mujoco.mjtGeom.mjGEOM_PLANE]
        _let_roll(floors, rolling, place)
        return place.compile()
    except ValueError as error:
        raise refused(scene.mjcf, error) from None


def _meet(bodies: Sequence[Body], scene: Scene) -> bool:
    """Return whether robots can touch anything except floor and walls."""
    return len(bodies) > 1 or bool(scene.things) or bool(scene.mjcf)


def mjcf(bodies: Sequence[Body], scene: Scene) -> str:
    """Return the bodies in their scene as MuJoCo's own XML.

    Names of body 3's elements begin with `3/`, and its frame is `3/base`; in a scene
    from the user's own file, `ROBOTS` is put before them.
    """
    root = Element("mujoco")
    SubElement(root, "compiler", angle="radian", inertiafromgeom="false")
    SubElement(
        root,
        "option",
        integrator="implicitfast",
        cone="elliptic",
        gravity=text([0, 0, GRAVITY]),
    )
    world = section(root, "worldbody")
    if not scene.mjcf:
        _add_scene(world, scene)
    for number, body in enumerate(bodies):
        add_body(root, body, f"{number}/")
        base = world[-1]
        if not body.fixed:
            base.set("pos", text([APART * number, 0, body.height]))
        # Parts of one robot never touch each other, but other robots and things.
        if _meet(bodies, scene):
            _let_touch(root, base)
    for number, ghost in enumerate(scene.ghosts):
        _add_ghost(world, ghost, f"ghost/{number}")
    dress(root, bodies, scene)
    return tostring(root, encoding="unicode")


def _let_touch(root: Element, base: Element) -> None:
    """Let a robot touch other robots and things, but not its own links each other.

    By itself, MuJoCo excludes only a link and the link that carries it.
    """
    for geom in base.iter("geom"):
        geom.set("conaffinity", "3")
    names = [str(link.get("name")) for link in base.iter("body")]
    for first, second in combinations(names, 2):
        SubElement(section(root, "contact"), "exclude", body1=first, body2=second)


def _let_roll(floors: Sequence[Any], rolling: Iterable[Element], place: Any) -> None:
    """Let wheels with rollers roll on the floors of the user's own file."""
    for number, floor in enumerate(floors):
        floor.name = floor.name or f"{ROBOTS}floor {number}"
        for pair in rolling:
            made = place.add_pair()
            made.geomname1 = floor.name
            made.geomname2 = ROBOTS + str(pair.get("geom2"))
            made.condim = int(str(pair.get("condim")))
            for key in ("friction", "solref", "solimp"):
                numbers = [float(one) for one in str(pair.get(key)).split()]
                getattr(made, key)[: len(numbers)] = numbers


def names(scene: Scene) -> list[str]:
    """Return the names of the things and bodies with a pose to read, by number."""
    return [*(f"thing/{n}" for n in range(len(scene.things))), *scene.bodies]


def _add_scene(world: Element, scene: Scene) -> None:
    # MuJoCo takes the larger friction of two: with 0 here, the robot's part decides.
    contact = {"contype": "2", "conaffinity": "1", "friction": "0 0 0", **STIFF}
    contact["group"] = str(WORLD)
    SubElement(world, "geom", contact, name=FLOOR, type="plane", size="0 0 1")
    for wall in scene.walls:
        SubElement(
            world,
            "geom",
            contact,
            type="box",
            size=text(np.array(wall.size) / 2),
            pos=text(wall.at),
            euler=text([0, 0, wall.yaw]),
        )
    for number, thing in enumerate(scene.things):
        _add_thing(world, thing, f"thing/{number}")


def _add_ghost(world: Element, ghost: Ghost, name: str) -> None:
    """Add a body that no force moves, below the floor: it is not there yet."""
    body = SubElement(world, "body", name=name, mocap="true", pos=text(AWAY))
    for solid in ghost.solids:
        part = Part(solid.shape, 1.0, tuple(solid.at.tolist()))
        geom = SubElement(body, "geom", shape(part), rgba=text([*SHADE, THIN]))
        # As the floor: it touches robots and things. Without friction, also if theirs
        # is larger: no wheel climbs up on it.
        geom.attrib |= {"contype": "2", "conaffinity": "1", "friction": "0 0 0"}
        geom.set("priority", "2")
        geom.attrib |= {"group": str(WORLD), "mass": "0", **SOFT}


def _add_thing(world: Element, thing: Thing, name: str) -> None:
    body = SubElement(world, "body", name=name, pos=text(thing.at))
    x, y, _ = thing.solid.turn.T
    body.set("xyaxes", text([x, y]))
    part = Part(thing.shape, thing.mass or 1.0, friction=thing.friction)
    if thing.mass:
        SubElement(body, "freejoint")
        add_mass(body, (part,))
    geom = SubElement(body, "geom", shape(part), contype="3", conaffinity="3")
    geom.attrib |= {"group": str(WORLD), **STIFF}
    rolling = 0.0
    if isinstance(thing.shape, Sphere):
        rolling = ROLLING * thing.shape.radius
        geom.set("condim", "6")
    geom.set("friction", text([thing.friction, 0, rolling]))
