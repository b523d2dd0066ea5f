"""The pictures and the tables of docs/robots.md: `python -m tests.robots.gallery`.

MuJoCo draws without a window, by EGL on Linux (Mesa's will do: libegl1) and by the
system elsewhere. The pictures are kept with the page; the tables are tested.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, fromstring, tostring

from rems_net.agents import registry
from rems_net.agents.parts import by_name
from rems_net.agents.robot import Definition
from rems_net.cli.part import about
from rems_net.drivers.physics.mjcf import shape
from rems_net.drivers.physics.scenery import mjcf
from rems_net.worlds.body import Body, Embodied, Joint
from rems_net.worlds.scenes.scene import Scene
from rems_net.worlds.tree import Tree

ROOT = Path(__file__).parent.parent.parent
PAGE = ROOT / "docs" / "robots.md"
PICTURES = ROOT / "docs" / "robots"
BEGIN, END = "<!-- from here on: python -m tests.robots.gallery -->", "<!-- end -->"
WIDTH, HEIGHT, COLOURS = 420, 280, 48
#: of hulls, by robot; tyres are dark, what is slippery is light
PAINT = {
    "woodbot": (0.85, 0.68, 0.45),
    "create2": (0.55, 0.62, 0.60),
    "epuck": (0.30, 0.62, 0.35),
    "pioneer3dx": (0.75, 0.15, 0.15),
    "pioneer3at": (0.75, 0.15, 0.15),
    "moose": (0.90, 0.55, 0.12),
}
Colour = tuple[float, float, float]
#: where joints are, unless at the state's default
POSES = {
    "arm/joint/2": 0.5,
    "arm/joint/3": 0.9,
    "arm/joint/4": 0.9,
    "arm/gripper": 0.0115,
    "left/top": 0.5,
    "right/wrist/1": 0.6,
}
OTHER, TYRE, SLIPPERY = (0.90, 0.45, 0.15), (0.13, 0.13, 0.14), (0.85, 0.85, 0.88)


def names() -> list[str]:
    """The built-in robots that have a body."""
    return [n for n in registry.BUILT_IN["definition"] if isinstance(made(n), Embodied)]


def made(name: str) -> Definition:
    """A robot of that name, without a driver."""
    (part,) = by_name("definition")[name]
    cls = part.load()
    assert issubclass(cls, Definition)
    return cls(name)


def scene(name: str) -> str:
    """A robot on a floor of tiles, with light, as MuJoCo's own XML."""
    robot = made(name)
    assert isinstance(robot, Embodied)
    body = robot.body()
    root = fromstring(mjcf([body], Scene()))
    _light(root)
    _dress(root, body, PAINT.get(name, OTHER))
    return tostring(root, encoding="unicode")


def _light(root: Element) -> None:
    visual = SubElement(root, "visual")
    SubElement(visual, "global", offwidth=str(2 * WIDTH), offheight=str(2 * HEIGHT))
    SubElement(visual, "headlight", ambient=".35 .35 .35", diffuse=".35 .35 .35")
    SubElement(visual, "quality", shadowsize="4096")
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
        texrepeat="5 5",  # tiles of 0.1 m
    )
    world = root.find("worldbody")
    assert world is not None
    SubElement(
        world,
        "light",
        directional="true",
        pos="0 0 5",
        dir="-.4 .5 -1",
        diffuse=".6 .6 .6",
        specular=".2 .2 .2",
    )


def _dress(root: Element, body: Body, paint: Colour) -> None:
    """Show each part as it is told, and not as what touches the floor for it."""
    touching = root.find("contact")
    if touching is not None:
        root.remove(touching)
    parts = {"base": body.parts}
    parts |= {joint.name: joint.parts for joint in _joints(body.hinges)}
    for link in root.iter("body"):
        for geom in link.findall("geom"):
            link.remove(geom)
        name = str(link.get("name")).partition("/")[2]
        for part in parts[name]:
            if part.friction is not None:
                colour = SLIPPERY if part.friction < 0.05 else paint
                colour = TYRE if "wheel" in name else colour
                rgba = " ".join(map(str, (*colour, 1)))
                SubElement(link, "geom", shape(part), rgba=rgba)
    for geom in root.iter("geom"):
        if geom.get("type") == "plane":
            geom.set("material", "tiles")


def _joints(some: Iterable[Joint]) -> Iterator[Joint]:
    for joint in some:
        yield joint
        yield from _joints(joint.joints)


def pose(name: str) -> dict[str, float]:
    """Where a robot's joints are in its picture, by their names."""
    robot = made(name)
    assert isinstance(robot, Embodied)
    schema = type(robot).state.schema_for(robot.parameters)
    assert schema is not None
    state, tree = schema(), Tree(robot.body())
    state.update({path: q for path, q in POSES.items() if path in schema})
    wanted = {
        n: state[link.joint.position]
        for n, link in enumerate(tree.links)
        if link.joint.position
    }
    closed = tree.closed(wanted)
    return {k.joint.name: q for k, q in zip(tree.links, closed, strict=True)}


def draw(name: str, path: Path) -> None:
    """Write a picture of a robot, from ahead and above."""
    os.environ.setdefault("MUJOCO_GL", "egl" if sys.platform == "linux" else "")
    import mujoco
    import numpy as np
    from PIL import Image

    model = mujoco.MjModel.from_xml_string(scene(name))
    data = mujoco.MjData(model)
    for joint, position in pose(name).items():
        data.joint(f"0/{joint}").qpos[0] = position
    mujoco.mj_forward(model, data)
    own = np.flatnonzero(model.geom_bodyid > 0)
    middle = data.geom_xpos[own].mean(axis=0)
    reach = (
        np.linalg.norm(data.geom_xpos[own] - middle, axis=1) + model.geom_rbound[own]
    )
    size = float(reach.max())
    camera = mujoco.MjvCamera()
    camera.lookat[:] = middle
    camera.distance, camera.azimuth, camera.elevation = 2.9 * size, 140, -22
    model.stat.extent, model.stat.center[:] = 4 * size, middle
    model.mat_texrepeat[:] = 0.5 / _tile(size)
    # Twice as large, then halved: edges without steps.
    renderer = mujoco.Renderer(model, 2 * HEIGHT, 2 * WIDTH)
    try:
        renderer.update_scene(data, camera)
        picture = Image.fromarray(renderer.render())
    finally:
        renderer.close()
    small = picture.resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS)
    small.quantize(COLOURS).save(path, optimize=True)


def _tile(size: float) -> float:
    """Edge of the floor's tiles, m: 1, 10 or 100 cm, as it suits the robot."""
    return 0.01 if size < 0.06 else 0.1 if size < 1 else 1.0


def tables(name: str) -> Iterator[str]:
    """What the page says of a robot, from the definition itself."""
    (part,) = by_name("definition")[name]
    plain = about(part)
    yield f"## {name}\n"
    yield f"![{name}](robots/{name}.png)\n"
    yield plain["doc"] + "\n"
    yield "| parameter | default | unit | what it is, and its source |"
    yield "|---|---|---|---|"
    for path, field in plain["parameters"].items():
        default = f"{field['default']:.6g}"
        yield f"| `{path}` | {default} | {field['unit']} | {field['doc']} |"
    yield "\n| port | field | unit | range | what it is |\n|---|---|---|---|---|"
    for port in ("command", "state", "sensors"):
        fields = plain["ports"].get(port, {}).get("fields", {})
        for path, field in fields.items():
            span = " to ".join(f"{end:.4g}" for end in field.get("range", ()))
            unit = field["unit"] or field["type"].replace("float", "")
            yield f"| {port} | `{path}` | {unit} | {span} | {field['doc']} |"
    yield ""


def page() -> str:
    """docs/robots.md, its tables as the definitions are now."""
    before = PAGE.read_text(encoding="utf-8").partition(BEGIN)[0]
    robots = "\n".join(line for name in names() for line in tables(name))
    return f"{before}{BEGIN}\n\n{robots}\n{END}\n"


def main() -> None:
    """Draw all robots, or those that are named, and write the page."""
    PICTURES.mkdir(exist_ok=True)
    for name in sys.argv[1:] or names():
        draw(name, PICTURES / f"{name}.png")
        size = (PICTURES / f"{name}.png").stat().st_size
        print(f"docs/robots/{name}.png: {size / 1000:.0f} kB")
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
