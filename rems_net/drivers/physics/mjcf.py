"""MJCF: a body in MuJoCo's own XML."""

from collections.abc import Iterable
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from rems_net.bodies.body import Body
from rems_net.bodies.joints import Hinge, Joint
from rems_net.bodies.parts import Box, Cylinder, Part, Sphere, lump
from rems_net.bodies.tree import Tree

#: Contacts as stiff as a 1 ms step allows: wheels that sink are smaller wheels.
STIFF = {"solref": "0.004 1", "solimp": "0.99 0.99 0.001"}
STOPS = {f"{name}limit": value for name, value in STIFF.items()}
#: geom groups: a ray meets the world, but not the robot that sends it
WORLD, ROBOT = 0, 1
FLOOR = "floor"
#: A robot touches the world, but no robot.
TOUCH = {"contype": "1", "conaffinity": "2", "group": str(ROBOT)}
#: Friction of a wheel with rollers along its axle, as a share of that across: 0 is not
#: possible in MuJoCo's solver.
BEARING = 0.01
#: m. Length of the capsule that is a wheel with rollers: as near to a ball as possible.
RIM = 1e-4


def section(root: Element, name: str) -> Element:
    """Return the section of a model with this name, a new one if there is none."""
    found = root.find(name)
    return SubElement(root, name) if found is None else found


def add_body(root: Element, body: Body, prefix: str = "") -> None:
    """Add a robot's body, heading along +x, to a model.

    Its base is the body `<prefix>base`, its links and their joints are
    `<prefix><joint>`, in the order of the body's `Tree`; its actuators are the motors
    among them, in the same order. The floor is the geom "floor".
    """
    at = text([0, 0, body.height])
    base = SubElement(section(root, "worldbody"), "body", name=f"{prefix}base", pos=at)
    if not body.fixed:
        SubElement(base, "freejoint")
    if body.source is not None:
        return  # `files.attach` adds the rest
    _add_parts(base, body.parts)
    tree = Tree(body)
    links: list[Element] = []
    for link in tree.links:
        joint, carrier = link.joint, base if link.parent < 0 else links[link.parent]
        name = prefix + joint.name
        links.append(SubElement(carrier, "body", name=name, pos=text(joint.at)))
        _add_joint(links[-1], joint, name)
        if isinstance(joint, Hinge) and joint.rollers is not None:
            _add_rim(root, links[-1], joint, name)
        else:
            _add_parts(links[-1], joint.parts)
        if joint.effort:
            SubElement(
                section(root, "actuator"),
                "velocity",
                joint=name,
                kv=text(joint.effort / joint.droop),
                forcerange=text([-joint.effort, joint.effort]),
            )
    for first, point, second, _ in tree.loops:
        SubElement(
            section(root, "equality"),
            "connect",
            STIFF,
            body1=prefix + tree.links[first].joint.name,
            body2=prefix + tree.links[second].joint.name,
            anchor=text(point),
        )


def _add_joint(link: Element, joint: Joint, name: str) -> None:
    made = SubElement(link, "joint", name=name, axis=text(joint.axis))
    made.set("armature", text(joint.armature))
    if not isinstance(joint, Hinge):
        made.set("type", "slide")
    if joint.damping:
        made.set("damping", text(joint.damping))
    if joint.limits is not None:
        made.attrib |= {"range": text(joint.limits), **STOPS}


def _add_rim(root: Element, link: Element, wheel: Hinge, name: str) -> None:
    """Add the shape of a wheel with rollers, which grips across its axle only.

    A capsule's contact with a plane has its first direction of friction along the
    capsule, and so along the axle, however far the wheel has turned.
    """
    add_mass(link, wheel.parts)
    (part,) = wheel.parts
    if part.friction is None:
        return
    assert isinstance(part.shape, Cylinder)
    half = np.array(part.shape.axis) * RIM / 2
    SubElement(
        link,
        "geom",
        TOUCH,
        name=f"{name} rim",
        type="capsule",
        size=text(part.shape.radius),
        fromto=text([np.array(part.at) - half, np.array(part.at) + half]),
        friction=text([part.friction * BEARING, 0, 0]),
    )
    SubElement(
        section(root, "contact"),
        "pair",
        STIFF,
        geom1=FLOOR,
        geom2=f"{name} rim",
        condim="3",
        friction=text([part.friction * BEARING, part.friction, 0, 0, 0]),
    )


def _add_parts(link: Element, parts: Iterable[Part]) -> None:
    parts = tuple(parts)
    add_mass(link, parts)
    for part in parts:
        if part.friction is None:
            continue
        friction = text([part.friction, 0, 0])
        SubElement(link, "geom", shape(part), friction=friction, **TOUCH)


def add_mass(link: Element, parts: Iterable[Part]) -> None:
    """Give a link the mass and the inertia of all its parts."""
    whole = lump(parts)
    i = whole.inertia
    SubElement(
        link,
        "inertial",
        mass=text(whole.mass),
        pos=text(whole.centre),
        fullinertia=text([i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]),
    )


def shape(part: Part) -> dict[str, str]:
    """Return the attributes of a geom for a part's shape and place."""
    match part.shape:
        case Box(size):
            half = text(np.array(size) / 2)
            return {"type": "box", "size": half, "pos": text(part.at)}
        case Sphere(radius):
            return {"type": "sphere", "size": text(radius), "pos": text(part.at)}
        case Cylinder(radius, length, axis):
            half_axis = np.array(axis) * length / 2
            ends = [np.array(part.at) - half_axis, np.array(part.at) + half_axis]
            return {"type": "cylinder", "size": text(radius), "fromto": text(ends)}


def text(numbers: Any) -> str:
    """Return numbers in MuJoCo's format, exact to the last bit."""
    return " ".join(repr(float(number)) for number in np.ravel(numbers))
