"""Writing: poses and inertias in a URDF, to the last bit."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

from rems_net.kinematics.pose import Pose
from rems_net.worlds.parts import Array


def write_pose(element: Element, pose: Pose) -> None:
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
    """Return numbers as a URDF has them."""
    return " ".join(repr(float(one)) for one in numbers)
