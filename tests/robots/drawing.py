"""Pictures of robots: what MuJoCo draws of a body, without a window.

By EGL on Linux (Mesa's will do: libegl1), by the system elsewhere.
"""

import os
import sys
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, fromstring, tostring

import numpy as np

from rems_net.agents.robot import Definition
from rems_net.bodies.body import Array, Body, Camera, Embodied, Ray
from rems_net.bodies.files.built import built
from rems_net.bodies.tree import Tree
from rems_net.drivers.physics.mjcf import shape
from rems_net.drivers.physics.scenery import mjcf
from rems_net.libraries import load
from rems_net.scenes.scene import Scene
from tests.robots.looks import look
from tests.robots.looks.shapes import Look, joints

WIDTH, HEIGHT, COLOURS = 420, 280, 128
#: where joints are, unless at the state's default
POSES = {
    "arm/joint/2": 0.5,
    "arm/joint/3": 0.9,
    "arm/joint/4": 0.9,
    "arm/gripper": 0.0115,
    "left/top": 0.5,
    "right/wrist/1": 0.6,
}
#: of rays, which no robot has, and the words about them in the picture
RAY, CAPTION = (0.05, 0.35, 1.0, 0.45), "blue: where its sensors look, not a part of it"
TYRE, FINGER = (0.11, 0.11, 0.12), (0.72, 0.72, 0.73)


def draw(robot: Definition, path: Path) -> None:
    """Write a picture of a robot, from ahead and above, its rays in blue.

    A ray is cut where it would leave the picture. Those of switches, which are
    shorter than a robot's shell is thick, are left out.
    """
    os.environ.setdefault("MUJOCO_GL", "egl" if sys.platform == "linux" else "")
    from PIL import Image, ImageDraw, ImageFont

    mujoco = load("mujoco", "mujoco")
    assert isinstance(robot, Embodied)
    body = built(robot.body())
    worn = look(robot.name, body)
    model, data = placed(robot, body, worn)
    found = corners(model, data)
    low, high = found.min(axis=0), found.max(axis=0)
    middle = (low + high) / 2
    size = float(np.linalg.norm(found - middle, axis=1).max())
    camera = mujoco.MjvCamera()
    camera.lookat[:] = middle
    camera.distance, camera.azimuth, camera.elevation = 2.3 * size, 140, worn.elevation
    model.stat.extent, model.stat.center[:] = size, middle
    model.light_pos[:] = middle - 4 * size * model.light_dir
    model.mat_texrepeat[:] = 0.5 / _tile(size)
    # Twice as large, then halved: edges without steps.
    with mujoco.Renderer(model, 2 * HEIGHT, 2 * WIDTH) as renderer:
        renderer.update_scene(data, camera)
        base = data.body("0/base")
        rays = list(_rays(body))
        for start, way, reach in rays:
            at = base.xpos + base.xmat.reshape(3, 3) @ start
            end = at + min(reach, worn.rays * size) * (base.xmat.reshape(3, 3) @ way)
            geom = renderer.scene.geoms[renderer.scene.ngeom]
            kind = mujoco.mjtGeom.mjGEOM_CAPSULE
            mujoco.mjv_initGeom(
                geom, kind, np.zeros(3), np.zeros(3), np.zeros(9), np.array(RAY)
            )
            mujoco.mjv_connector(geom, kind, 0.006 * size, at, end)
            renderer.scene.ngeom += 1
        picture = Image.fromarray(renderer.render())
    small = picture.resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS)
    if rays:
        font = ImageFont.load_default(12)
        ImageDraw.Draw(small).text((8, HEIGHT - 20), CAPTION, (20, 60, 160), font)
    # Means, or the few pixels of a small wheel would take another part's colour.
    small.quantize(COLOURS, kmeans=2).save(path, optimize=True)


def placed(robot: Definition, body: Body, worn: Look) -> tuple[Any, Any]:
    """Return MuJoCo's model and data of a robot as its picture shows it."""
    mujoco = load("mujoco", "mujoco")
    model = mujoco.MjModel.from_xml_string(_dressed(body, worn))
    data = mujoco.MjData(model)
    for joint, position in _pose(robot, body).items():
        data.joint(f"0/{joint}").qpos[0] = position
    mujoco.mj_forward(model, data)
    return model, data


def corners(model: Any, data: Any) -> Array:
    """Return the corners of the boxes around all geoms but the floor, (n, 3)."""
    signs = np.array(list(product((-1, 1), repeat=3)))
    found = []
    for geom in np.flatnonzero(model.geom_bodyid > 0):
        centre, half = np.split(model.geom_aabb[geom], 2)
        turned = data.geom_xmat[geom].reshape(3, 3)
        found.append(data.geom_xpos[geom] + (centre + signs * half) @ turned.T)
    return np.concatenate(found)


def _rays(body: Body) -> Iterator[tuple[Array, Array, float]]:
    """Where each begins, its direction and its reach."""
    for sense in body.sensors:
        if isinstance(sense, Ray):
            yield np.array(sense.at), np.array(sense.direction), sense.reach
        elif isinstance(sense, Camera):  # the edges of what it sees
            ahead, up, (_, right, _, top) = sense.direction, sense.up, sense.edges
            for x, y in product((-right, right), (-top, top)):
                edge = ahead + x * np.cross(ahead, up) + y * np.array(up)
                yield np.array(sense.at), edge / np.linalg.norm(edge), np.inf


def _tile(size: float) -> float:
    """Half the edge of the floor's tiles, m: 1, 10 or 100 cm, as it suits the robot."""
    return 0.01 if size < 0.06 else 0.1 if size < 1 else 1.0


def _dressed(body: Body, worn: Look) -> str:
    """A robot on a floor of tiles, with light, as MuJoCo's own XML."""
    # With a camera it would be dressed already, for what the camera sees.
    root = fromstring(mjcf([replace(body, sensors=())], Scene()))
    _light(root)
    _dress(root, body, worn)
    return tostring(root, encoding="unicode")


def _light(root: Element) -> None:
    visual = SubElement(root, "visual")
    SubElement(visual, "global", offwidth=str(2 * WIDTH), offheight=str(2 * HEIGHT))
    SubElement(visual, "headlight", ambient=".4 .4 .4", diffuse=".4 .4 .4")
    SubElement(visual, "quality", shadowsize="4096", numslices="64")
    SubElement(visual, "map", shadowclip="4")
    assets = SubElement(root, "asset")
    sky = {"type": "skybox", "builtin": "gradient", "width": "64", "height": "64"}
    SubElement(assets, "texture", sky, rgb1="1 1 1", rgb2=".82 .87 .92")
    tiles = {"type": "2d", "builtin": "checker", "width": "64", "height": "64"}
    SubElement(
        assets, "texture", tiles, name="tiles", rgb1=".93 .93 .91", rgb2=".84 .84 .82"
    )
    SubElement(
        assets,
        "material",
        name="tiles",
        texture="tiles",
        texuniform="true",
        texrepeat="5 5",  # tiles of 0.2 m
    )
    world = root.find("worldbody")
    assert world is not None
    SubElement(
        world,
        "light",
        directional="true",
        dir=".2 -.5 -1",
        diffuse=".45 .45 .45",
        specular=".2 .2 .2",
    )


def _dress(root: Element, body: Body, worn: Look) -> None:
    """Show each part as it is told, not as what touches the floor for it, and more."""
    touching = root.find("contact")
    if touching is not None:
        root.remove(touching)
    parts = {"base": body.parts}
    parts |= {joint.name: joint.parts for joint in joints(body.joints)}
    for link in root.iter("body"):
        for geom in link.findall("geom"):
            link.remove(geom)
        name = str(link.get("name")).partition("/")[2]
        touch = [part for part in parts[name] if part.friction is not None]
        if not name.startswith(worn.bare or ("/",)):
            paints = (
                worn.paint if name == "base" else (TYRE if "wheel" in name else FINGER,)
            )
            for number, part in enumerate(touch):
                paint = paints[min(number, len(paints) - 1)]
                if paint is not None:
                    rgba = " ".join(map(str, (*paint, 1)))
                    SubElement(link, "geom", shape(part), rgba=rgba)
        for more in worn.links.get(name, []):
            SubElement(link, "geom", more)
    for geom in root.iter("geom"):
        if geom.get("type") == "plane":
            geom.set("material", "tiles")


def _pose(robot: Definition, body: Body) -> dict[str, float]:
    """Where a robot's joints are in its picture, by their names."""
    schema = type(robot).state.schema_for(robot.parameters)
    assert schema is not None
    state, tree = schema(), Tree(body)
    state.update({path: q for path, q in POSES.items() if path in schema})
    wanted = {
        n: state[link.joint.position]
        for n, link in enumerate(tree.links)
        if link.joint.position
    }
    closed = tree.closed(wanted)
    return {k.joint.name: q for k, q in zip(tree.links, closed, strict=True)}
