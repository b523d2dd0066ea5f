"""Signs: markers of a MuJoCo world, which only its pictures have.

A marker is a texture of the model, and a plate that is added to each picture: the
world's physics, and its bytes, are the same with and without markers.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from numpy.typing import NDArray

from rems_net.bodies.body import Body
from rems_net.bodies.marker import Marker
from rems_net.bodies.parts import Array
from rems_net.drivers.physics.mjcf import section
from rems_net.eyes.drawn import cells
from rems_net.scenes.scene import Scene, upright

#: m. Thickness of a marker's paper.
PAPER = 4e-4
#: texels along the edge of a cell: enough for a marker that fills a picture
TEXELS = 16
#: the owner of a marker on the floor
FLOOR = "world"
#: brightness of black and white paint, of 255
INKS = np.array([20, 235], np.uint8)


@dataclass(frozen=True, slots=True)
class Sign:
    """A marker of MuJoCo's body with this number, and the number of its material."""

    marker: Marker
    body: int
    material: int

    def show(self, mujoco: Any, data: Any, scene: Any) -> None:
        """Add the marker to what is drawn."""
        turn = data.xmat[self.body].reshape(3, 3)
        at, own = place(self.marker)
        half = self.marker.paper / 2
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(
            geom,
            mujoco.mjtGeom.mjGEOM_BOX,
            np.array([half, half, PAPER / 2]),
            data.xpos[self.body] + turn @ at,
            (turn @ own).ravel(),
            np.ones(4, np.float32),
        )
        geom.matid = self.material
        geom.specular = 0.0
        scene.ngeom += 1


def place(marker: Marker) -> tuple[Array, Array]:
    """Return the middle of a marker's paper, m, and its rotation (3, 3).

    Its x is to the right of its picture, y to the top, in the frame of its owner.
    """
    turned = upright(marker.heading) @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]])
    return np.array(marker.at) - (0, 0, PAPER / 2), turned


def owners(bodies: Sequence[Body], scene: Scene) -> Iterator[tuple[str, Marker]]:
    """Yield each marker, and the name of its body in MuJoCo's model."""
    for number, body in enumerate(bodies):
        for marker in body.markers:
            yield f"{number}/base", marker
    for number, marker in scene.markers:
        yield (f"thing/{number}" if number >= 0 else FLOOR), marker


def painted(marker: Marker) -> NDArray[np.uint8]:
    """Return a marker's paper as a picture (n, n, 3), its top row first."""
    grey = INKS[np.kron(cells(marker), np.ones((TEXELS, TEXELS), np.uint8))]
    return np.repeat(grey[:, :, None], 3, axis=2)


def _name(marker: Marker) -> str:
    return f"marker/{marker.family}/{marker.id}"


def add(root: Element, bodies: Sequence[Body], scene: Scene) -> None:
    """Give a model a texture and a material for each marker."""
    markers = {_name(one): one for _, one in owners(bodies, scene)}
    for name, marker in markers.items():
        size = str(TEXELS * (marker.cells + 2))
        about = {"type": "2d", "builtin": "flat", "width": size, "height": size}
        SubElement(section(root, "asset"), "texture", about, name=name)
        SubElement(section(root, "asset"), "material", name=name, texture=name)


def signs(
    model: Any, bodies: Sequence[Body], scene: Scene, before: str = ""
) -> list[Sign]:
    """Return the markers of a compiled model, and fill their textures.

    before: a prefix of all names
    """
    made = []
    for owner, marker in owners(bodies, scene):
        name = before + _name(marker)
        texture = model.texture(name).id
        first = model.tex_adr[texture]
        texels = painted(marker).ravel()
        model.tex_data[first : first + len(texels)] = texels
        body = model.body(owner if owner == FLOOR else before + owner).id
        material = model.material(name).id
        made.append(Sign(marker, body, material))
    return made
