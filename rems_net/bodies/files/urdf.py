"""URDF: reads a robot's file, and writes a plain URDF for the engines.

Engines disagree on what is usual in such files: links that are fixed to others, links
without a mass, paths that begin with `package://`. So engines get a URDF without any
of these: every link moves, and has the mass, the inertia and the shapes of all links
that are fixed to it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from rems_net.bodies.files import bounds, sheet
from rems_net.bodies.files.elements import Links, Words, end_of, name_of
from rems_net.bodies.files.inertia import Inertia, balanced
from rems_net.bodies.files.meshes import find_mesh
from rems_net.bodies.files.sheet import Box, Moved, Sheet, Solid
from rems_net.bodies.model import Model
from rems_net.bodies.parts import Array
from rems_net.kinematics.pose import Pose
from rems_net.kinematics.rotation import three

#: kinds of joints that move: True for a rotation
TURNS = {"revolute": True, "continuous": True, "prismatic": False}
#: name of a root link that stands for the world, and its name in the engines' URDF
WORLD, BOLTED = "world", "bolted to the world"


def read(model: Model, path: Path, robot: Element) -> Sheet:
    """Return the content of the file. Raises SchemaError."""
    return _Reading(model, path, robot).sheet()


class _Reading:
    def __init__(self, model: Model, path: Path, robot: Element):
        self._model, self._path = model, path
        self._words = Words(path.name)
        self._links = Links(self._words, robot)
        joints = [one for one in robot.findall("joint") if one.get("type") != "fixed"]
        for name in model.held:
            if name not in map(name_of, joints):
                raise sheet.no_joint(
                    path.name, name, [name_of(joint) for joint in joints]
                )
        sheet.check_links(path.name, model.friction, [*self._links.named])
        self._out = Element("robot", name=path.stem)
        self._moved: list[Moved] = []

    def sheet(self) -> Sheet:
        plain = SubElement(SubElement(self._out, "mujoco"), "compiler")
        plain.attrib |= {"strippath": "false", "fusestatic": "false"}
        root = self._links.root
        if bolted := root == WORLD:
            root = BOLTED
            self._links.rename(WORLD, BOLTED)
        base = self._link(root, Pose.of(), -1, bolted or self._model.fixed)
        indent(self._out)  # Bullet reads it by lines of at most 1023 letters
        return Sheet(
            self._path,
            root,
            base,
            tuple(self._moved),
            tostring(self._out, encoding="unicode"),
            bolted=bolted,
            links=tuple(self._links.named),
        )

    def _link(self, name: str, here: Pose, number: int, still: bool) -> Solid:
        """Write a link with all links fixed to it, then the joints they carry.

        here: its frame in that of the first link      still: whether it never moves
        """
        made = SubElement(self._out, "link", name=name)
        whole, boxes = Inertia(), list[Box]()
        joints: list[tuple[Element, Pose]] = []
        for link, pose, moving in self._fixed_to(name, Pose.of()):
            touching = self._own(made, name_of(link))
            whole += self._inertia(link).seen(pose)
            joints += [(joint, pose) for joint in moving]
            for shape in link.findall("collision"):
                box = self._shape(touching, shape, pose, here)
                if box is not None:
                    boxes.append((box[0] - here.position, box[1]))
        self._write_inertia(made, whole, still)
        solid = Solid(whole.mass, tuple(boxes))
        for joint, pose in joints:
            self._joint(name, joint, here, pose, number)
        return solid

    def _own(self, leader: Element, name: str) -> Element:
        """Return the element for the shapes of a link that is fixed to its leader.

        A link with its own friction stays a link, since engines have one friction per
        link; its mass is written with its leader.
        """
        friction = self._model.friction
        if not isinstance(friction, Mapping) or name not in friction:
            return leader
        if name == leader.get("name"):
            return leader
        made = SubElement(self._out, "link", name=name)
        write_inertia(made, 0.0, np.zeros(3), np.zeros((3, 3)))
        joint = SubElement(self._out, "joint", name=f"{name} is fixed", type="fixed")
        SubElement(joint, "parent", link=str(leader.get("name")))
        SubElement(joint, "child", link=name)
        return made

    def _fixed_to(
        self, name: str, pose: Pose
    ) -> Iterator[tuple[Element, Pose, list[Element]]]:
        """Yield a link and the links fixed to it: each with pose and moving joints."""
        joints = self._links.children[name]
        fixed = [joint for joint in joints if self._is_fixed(joint)]
        moving = [joint for joint in joints if joint not in fixed]
        yield self._links.named[name], pose, moving
        for joint in fixed:
            yield from self._fixed_to(
                end_of(joint, "child"), pose @ self._words.pose(joint)
            )

    def _is_fixed(self, joint: Element) -> bool:
        kind, name = joint.get("type"), name_of(joint)
        if kind == "fixed":
            return True
        if kind not in TURNS:
            raise self._words.error(
                f"joint {name!r} is {kind!r}; a robot here has joints that are fixed, "
                f"{', '.join(TURNS)}"
            )
        # A joint that follows a held joint does not move, either.
        mimic = joint.find("mimic")
        leader = None if mimic is None else mimic.get("joint")
        return not {name, leader}.isdisjoint(self._model.held)

    def _joint(
        self, parent: str, joint: Element, carrier: Pose, pose: Pose, number: int
    ) -> None:
        name, kind = name_of(joint), str(joint.get("type"))
        child = end_of(joint, "child")
        local = pose @ self._words.pose(joint)
        here = carrier @ local
        axis = np.array(self._words.numbers(joint.find("axis"), "xyz", "1 0 0"))
        length = float(np.sqrt(axis @ axis))
        if not length:
            raise self._words.error(f"the axis of joint {name!r} is 0 0 0")
        limits = self._limits(joint)
        if kind == "revolute" and limits is None:
            kind = "continuous"
        made = SubElement(self._out, "joint", name=name, type=kind)
        SubElement(made, "parent", link=parent)
        SubElement(made, "child", link=child)
        _write_pose(made, local)
        SubElement(made, "axis", xyz=text(axis / length))
        damping = self._words.number(joint, "dynamics", "damping")
        friction = self._words.number(joint, "dynamics", "friction")
        SubElement(made, "dynamics", damping=repr(damping), friction=repr(friction))
        if limits:
            # The definition states the effort and the speed.
            told = {"lower": repr(limits[0]), "upper": repr(limits[1])}
            SubElement(made, "limit", told, effort="0", velocity="0")
        index = len(self._moved)
        self._moved.append(
            Moved(
                name,
                TURNS[kind],
                number,
                three(here.position - carrier.position),
                three(here.rotation @ (axis / length)),
                Solid(0.0),
                limits,
                max(0.0, self._words.number(joint, "limit", "effort")),
                max(0.0, self._words.number(joint, "limit", "velocity")),
                damping,
                follows=self._mimic(joint),
            )
        )
        solid = self._link(child, here, index, still=False)
        self._moved[index] = replace(self._moved[index], solid=solid)

    def _limits(self, joint: Element) -> tuple[float, float] | None:
        """Return a joint's limits; None for a hinge that has none, of any type."""
        kind, told = joint.get("type"), joint.find("limit")
        said = told is not None and not {*told.keys()}.isdisjoint({"lower", "upper"})
        if kind == "continuous" or (kind == "revolute" and not said):
            return None
        low = self._words.number(joint, "limit", "lower")
        high = self._words.number(joint, "limit", "upper")
        if not low < high:
            raise self._words.error(
                f"joint {name_of(joint)!r} is {kind} from {low:g} to {high:g}; "
                'expected the lower first, or type="continuous" for a hinge without '
                "an end"
            )
        return low, high

    def _mimic(self, joint: Element) -> tuple[str, float] | None:
        mimic = joint.find("mimic")
        if mimic is None:
            return None
        if self._words.number(joint, "mimic", "offset"):
            raise self._words.error(
                f"joint {name_of(joint)!r} follows another with an offset; expected 0"
            )
        ratio = float(self._words.numbers(mimic, "multiplier", "1")[0])
        return str(mimic.get("joint")), ratio

    def _inertia(self, link: Element) -> Inertia:
        inertial = link.find("inertial")
        if inertial is None:
            return Inertia()
        mass = self._words.number(inertial, "mass", "value")
        told = inertial.find("inertia")
        xx, yy, zz, xy, xz, yz = (
            float(self._words.numbers(told, f"i{axes}", "0")[0])
            for axes in ("xx", "yy", "zz", "xy", "xz", "yz")
        )
        own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        return Inertia.of(mass, own, self._words.pose(inertial))

    def _write_inertia(self, made: Element, whole: Inertia, still: bool) -> None:
        """Write mass and inertia of a link, which must have them if it moves."""
        name, mass = made.get("name"), whole.mass
        if still:  # its mass has no effect, but engines need a number
            mass, centre, inertia = 1.0, np.zeros(3), np.eye(3)
        elif not mass > 0:
            raise self._words.error(
                f"link {name!r} moves, and has no mass: give it an <inertial>"
            )
        else:
            inertia, centre = whole.central()
            what = f"{self._path.name}: link {name!r}"
            inertia = balanced(inertia, mass, what, self._model.mend)
        write_inertia(made, mass, centre, inertia)

    def _shape(
        self, made: Element, shape: Element, pose: Pose, link: Pose
    ) -> Box | None:
        """Write a shape at its place on the link, and return the box around it."""
        geometry = shape.find("geometry")
        if geometry is None or not len(geometry):
            return None
        local, told = pose @ self._words.pose(shape), dict(geometry[0].attrib)
        kind = geometry[0].tag
        if kind == "mesh":
            named = str(told.get("filename"))
            mesh = find_mesh(named, self._path, self._model.packages)
            told["filename"] = mesh.as_posix()
        write_shape(made, kind, told, local)
        return bounds.of_shape(self._words, kind, told, link @ local)


def write_shape(link: Element, kind: str, told: Mapping[str, str], pose: Pose) -> None:
    """Write a shape of this kind, with these attributes, at its pose on the link."""
    for purpose in ("visual", "collision"):  # the visible shape is the touching one
        written = SubElement(link, purpose)
        _write_pose(written, pose)
        SubElement(SubElement(written, "geometry"), kind, dict(told))


def _write_pose(element: Element, pose: Pose) -> None:
    """Write the pose of an element as its origin."""
    SubElement(element, "origin", xyz=text(pose.position), rpy=text(pose.rpy))


def write_inertia(link: Element, mass: float, centre: Array, inertia: Array) -> None:
    """Write mass, centre of mass (3,) and inertia (3, 3) about it."""
    written = SubElement(link, "inertial")
    SubElement(written, "origin", xyz=text(centre))
    SubElement(written, "mass", value=repr(float(mass)))
    xx, yy, zz, xy, xz, yz = (
        repr(float(inertia[at]))
        for at in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    )
    SubElement(written, "inertia", ixx=xx, iyy=yy, izz=zz, ixy=xy, ixz=xz, iyz=yz)


def text(numbers: Sequence[float] | Array) -> str:
    """Return numbers in the format of a URDF."""
    return " ".join(repr(float(one)) for one in numbers)
