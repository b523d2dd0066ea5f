"""Dress: colours, light and a tiled floor for a MuJoCo model with cameras."""

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

from rems_net.bodies.body import Body
from rems_net.bodies.tree import Tree
from rems_net.drivers.physics.mjcf import FLOOR, section, text
from rems_net.drivers.physics.pictures import looks, signs
from rems_net.scenes.scene import Colour, Scene


def dress(root: Element, bodies: Sequence[Body], scene: Scene) -> None:
    """Give a model the colours and light of `looks`, if a body has a camera.

    A scene from the user's own file keeps its looks; the robots in it get theirs.
    """
    if not any(looks.cameras(bodies)):
        return
    signs.add(root, bodies, scene)
    colours: dict[str, Colour] = {}
    for number, body in enumerate(bodies):
        colours[f"{number}/base"] = looks.hull(number)
        for link in Tree(body).links:
            colour = looks.WHEEL if looks.is_wheel(link.joint) else looks.hull(number)
            colours[f"{number}/{link.joint.name}"] = colour
    for number, thing in enumerate(scene.things):
        colours[f"thing/{number}"] = thing.colour
    world = section(root, "worldbody")
    for one in world.iter("body"):
        _paint(one, colours[str(one.get("name"))])
    if not scene.mjcf:
        _paint(world, looks.WALL)
        add_light(root)


def _paint(body: Element, colour: Colour) -> None:
    for geom in body.findall("geom"):
        if geom.get("name") == FLOOR:
            geom.set("material", "tiles")
        else:
            geom.set("rgba", text([*colour, 1]))


def add_light(root: Element) -> None:
    """Give a model light, a sky and the material `tiles`."""
    visual, asset = section(root, "visual"), section(root, "asset")
    ambient, diffuse = (text([share] * 3) for share in (looks.AMBIENT, looks.DIFFUSE))
    # No headlight: it moves with the camera, so it would not belong to the place.
    head = {"ambient": ambient, "diffuse": "0 0 0", "specular": "0 0 0"}
    SubElement(visual, "headlight", head)
    SubElement(visual, "quality", offsamples="0", shadowsize="0")
    sky = {"type": "skybox", "builtin": "flat", "width": "16", "height": "16"}
    SubElement(asset, "texture", sky, rgb1=text(looks.SKY))
    first, second = map(text, looks.TILES)
    tiles = {"type": "2d", "builtin": "checker", "width": "64", "height": "64"}
    SubElement(asset, "texture", tiles, name="tiles", rgb1=first, rgb2=second)
    repeat = text([1 / looks.TILE] * 2)  # for half the texture, which is two tiles wide
    about = {"texture": "tiles", "texuniform": "true", "texrepeat": repeat}
    SubElement(asset, "material", about, name="tiles", specular="0")
    SubElement(
        section(root, "worldbody"),
        "light",
        directional="true",
        castshadow="false",
        dir=text([-part for part in looks.LIGHT]),
        ambient="0 0 0",
        diffuse=diffuse,
        specular="0 0 0",
    )
