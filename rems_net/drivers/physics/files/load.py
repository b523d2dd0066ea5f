"""Load: adds a robot's file to Bullet's world."""

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree import ElementTree

import numpy as np

from rems_net.bodies.body import Body, Hinge
from rems_net.bodies.files.meshes import made_binary
from rems_net.bodies.model import Source
from rems_net.bodies.tree import Tree
from rems_net.errors import SchemaError

#: collision groups: a ray meets the world, but not the robot that sends it
WORLD, ROBOT = 1, 2
#: Number of the base: Bullet numbers links from 0. As a link's parent, the base is 0.
BASE = -1


def load_file(
    bullet: Any, call: Callable[..., Any], body: Body, source: Source
) -> tuple[int, list[int]]:
    """Add a robot's file, heading along +x; return its number and its joints' numbers.

    call: calls the function of that name in the right world
    The joints' numbers are in the order of the body's `Tree`.
    """
    told = ElementTree.fromstring(source.urdf or source.plain)
    # Bullet reads a file, not text; the paths in it are absolute.
    with TemporaryDirectory() as folder:
        file = Path(folder) / "robot.urdf"
        _write_meshes(told, Path(folder))
        file.write_text(ElementTree.tostring(told, encoding="unicode"), "utf-8")
        try:
            robot = call(
                "loadURDF",
                str(file),
                basePosition=(0, 0, body.height),
                useFixedBase=body.fixed,
                flags=bullet.URDF_USE_INERTIA_FROM_FILE
                | bullet.URDF_USE_IMPLICIT_CYLINDER,
            )
        except bullet.error as error:
            raise SchemaError(
                f"PyBullet does not take {source.path}: "
                f"{str(error).rstrip('.')}. (R0206)"
            ) from None
    every = [call("getJointInfo", robot, n) for n in range(call("getNumJoints", robot))]
    names = [source.root, *(about[12].decode() for about in every)]
    for link in told.iter("link"):
        shapes = link.findall("collision")
        number = names.index(str(link.get("name"))) + BASE
        if len(call("getCollisionShapeData", robot, number)) < len(shapes):
            meshes = [str(mesh.get("filename")) for mesh in link.iter("mesh")]
            raise SchemaError(
                f"PyBullet makes no shape of what touches of link {link.get('name')!r} "
                f"of {source.path.name}: look at "
                f"{' and '.join(sorted({*meshes}))}. (R0211)"
            )
    # Damping first: with a friction in the same call, Bullet gives that to all links.
    call("changeDynamics", robot, BASE, linearDamping=0.0, angularDamping=0.0)
    for number, name in enumerate(names, BASE):
        friction = {"rollingFriction": 0.0, "spinningFriction": 0.0}
        friction["lateralFriction"] = source.grips.get(name, source.grip(name) or 0.0)
        call("changeDynamics", robot, number, **friction)
        call("setCollisionFilterGroupMask", robot, number, ROBOT, WORLD)
    numbers = {about[1].decode(): number for number, about in enumerate(every)}
    links = [link.joint for link in Tree(body).links]
    moved = [numbers[joint.name] for joint in links]
    for number, joint in zip(moved, links, strict=True):
        about = every[number]
        if not joint.effort:
            # A joint in Bullet has a motor that brakes: use it for the file's friction.
            mode, friction = bullet.VELOCITY_CONTROL, about[7]
            call("setJointMotorControl2", robot, number, mode, force=friction)
        if isinstance(joint, Hinge) and joint.armature:
            moments = np.array(call("getDynamicsInfo", robot, number)[2])
            # Bullet takes moments about the axes of the link's inertia: add what makes
            # the armature about the joint's axis, in any direction.
            along = np.array(about[13]) ** 2
            more = moments + joint.armature * along / (along @ along)
            call("changeDynamics", robot, number, localInertiaDiagonal=more.tolist())
    return robot, moved


def _write_meshes(robot: ElementTree.Element, folder: Path) -> None:
    """Write meshes that Bullet cannot read directly into the folder, converted."""
    for number, mesh in enumerate(robot.iter("mesh")):
        path = Path(str(mesh.get("filename")))
        made = made_binary(path)
        if made is not None:
            (folder / f"{number}.stl").write_bytes(made)
            mesh.set("filename", (folder / f"{number}.stl").as_posix())
