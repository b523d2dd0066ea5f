"""Cameras' pictures of a Bullet world, by Bullet's own renderer, without OpenGL."""

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from rems_net.bodies.marker import Marker
from rems_net.bodies.parts import Array
from rems_net.bodies.sensors import Camera
from rems_net.drivers.physics.engine import Picture
from rems_net.drivers.physics.pictures import looks
from rems_net.drivers.physics.pictures.signs import PAPER, painted
from rems_net.pictures import png
from rems_net.scenes.scene import Colour

Call = Callable[..., Any]
#: m. The floor is drawn up to this distance from the origin.
FLOOR = looks.FAR
LINK = -1
_SKY = np.round(255 * np.array(looks.SKY)).astype(np.uint8)


def floor(bullet: Any, call: Call) -> int:
    """Return Bullet's number for the visible shape of a floor with tiles."""
    edges = (-FLOOR, FLOOR)
    corners = [(x, y, 0.0) for y in edges for x in edges]
    return int(
        call(
            "createVisualShape",
            bullet.GEOM_MESH,
            vertices=corners,
            indices=[0, 1, 3, 0, 3, 2],
            uvs=[(x / looks.TILE / 2, y / looks.TILE / 2) for x, y, _ in corners],
            normals=[(0.0, 0.0, 1.0)] * 4,
        )
    )


def lay_tiles(call: Call, body: int) -> None:
    """Put the pattern on a floor; Bullet reads it from a file."""
    first, second = np.round(255 * np.array(looks.TILES)).astype(np.uint8)
    _dress(call, body, np.array([[first, second], [second, first]]))


def _dress(call: Call, body: int, texels: Picture) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "texture.png"
        path.write_bytes(png(texels))
        texture = call("loadTexture", str(path))
    call("changeVisualShape", body, LINK, textureUniqueId=texture)


def paint(call: Call, body: int, colour: Colour, link: int = LINK) -> None:
    """Give a body, or one of its links, a colour."""
    call("changeVisualShape", body, link, rgbaColor=(*colour, 1.0))


def sign(bullet: Any, call: Call, marker: Marker) -> int:
    """Return Bullet's number for a marker: a square that touches nothing."""
    half = marker.paper / 2
    corners = [(x, y, PAPER) for y in (-half, half) for x in (-half, half)]
    shape = call(
        "createVisualShape",
        bullet.GEOM_MESH,
        vertices=corners,
        indices=[0, 1, 3, 0, 3, 2],
        uvs=[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)],
        normals=[(0.0, 0.0, 1.0)] * 4,
    )
    made = int(call("createMultiBody", 0, -1, shape))
    _dress(call, made, painted(marker))
    return made


def picture(
    bullet: Any, call: Call, camera: Camera, eye: Array, ahead: Array, up: Array
) -> Picture:
    """Return the camera's picture from `eye`, looking along `ahead`."""
    looks_at = (eye + ahead).tolist()
    view = bullet.computeViewMatrix(eye.tolist(), looks_at, up.tolist())
    left, right, bottom, top = camera.edges
    # Bullet samples each pixel at its lower left corner, we mean its middle.
    aside, up_ = (right - left) / camera.width / 2, (top - bottom) / camera.height / 2
    slopes = (left + aside, right + aside, bottom + up_, top + up_)
    edges = (looks.NEAR * slope for slope in slopes)
    shape = bullet.computeProjectionMatrix(*edges, looks.NEAR, looks.FAR)
    _, _, colours, depth, _ = call(
        "getCameraImage",
        camera.width,
        camera.height,
        view,
        shape,
        shadow=0,
        lightDirection=looks.LIGHT,
        lightColor=(1.0, 1.0, 1.0),
        lightAmbientCoeff=looks.AMBIENT,
        lightDiffuseCoeff=looks.DIFFUSE,
        lightSpecularCoeff=0.0,
        renderer=bullet.ER_TINY_RENDERER,
        flags=bullet.ER_NO_SEGMENTATION_MASK,
    )
    height, width, _ = camera.shape
    drawn = np.reshape(colours, (height, width, 4)).astype(np.uint8)[:, :, :3]
    nothing = np.reshape(depth, (height, width)) >= 1.0
    return np.where(nothing[:, :, None], _SKY, drawn)
