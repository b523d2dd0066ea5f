"""Cameras' pictures of a Bullet world, by Bullet's own renderer, without OpenGL."""

from collections.abc import Callable, Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from rems_net.bodies.marker import Marker
from rems_net.bodies.parts import Array
from rems_net.bodies.sensors import Camera
from rems_net.drivers.physics.engine import Picture
from rems_net.drivers.physics.pictures import looks
from rems_net.drivers.physics.pictures.signs import INKS, place
from rems_net.eyes.drawn import cells
from rems_net.pictures import png
from rems_net.scenes.scene import Colour

Call = Callable[..., Any]
#: position (3,) and rotation (3, 3) of a marker's owner, as they are now
Pose = Callable[[], tuple[Array, Array]]
Sign = tuple[Pose, Marker]
#: m. The floor is drawn up to this distance from the origin.
FLOOR = looks.FAR
LINK = -1
_SKY = np.round(255 * np.array(looks.SKY)).astype(np.uint8)
_LIGHT = np.array(looks.LIGHT) / np.sqrt(np.square(looks.LIGHT).sum())
#: pixels. Points of a pixel, from its middle, at which a marker is looked at: no two in
#: one row or column, so level edges are as smooth as others.
POINTS = (np.column_stack([np.arange(32), 13 * np.arange(32) % 32]) - 15.5) / 32
#: m. Something that is nearer than a marker by this covers it; its owner is below it.
COVERS = 0.002
#: a slope so small that a ray meets no paper
TINY = 1e-9


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
    with TemporaryDirectory() as folder:
        path = Path(folder) / "texture.png"
        path.write_bytes(png(np.array([[first, second], [second, first]])))
        texture = call("loadTexture", str(path))
    call("changeVisualShape", body, LINK, textureUniqueId=texture)


def paint(call: Call, body: int, colour: Colour, link: int = LINK) -> None:
    """Give a body, or one of its links, a colour."""
    call("changeVisualShape", body, link, rgbaColor=(*colour, 1.0))


def picture(
    bullet: Any,
    call: Call,
    camera: Camera,
    eye: Array,
    ahead: Array,
    up: Array,
    signs: Iterable[Sign],
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
    depth = np.reshape(depth, (height, width))
    drawn = np.where((depth >= 1.0)[:, :, None], _SKY, drawn)
    depth = looks.NEAR * looks.FAR / (looks.FAR - (looks.FAR - looks.NEAR) * depth)
    axes = np.column_stack([np.cross(ahead, up), up, ahead])
    for sign in signs:
        _lay(drawn, depth, camera, eye, axes, *sign)
    return drawn


def _lay(
    drawn: Picture,
    depth: Array,
    camera: Camera,
    eye: Array,
    axes: Array,
    pose: Pose,
    marker: Marker,
) -> None:
    """Draw a marker into a picture, with smooth edges: Bullet's would be stairs.

    axes: right, up and ahead of the camera, as columns
    """
    (at, turn), (_, own) = pose(), place(marker)
    own = turn @ own  # right, top and up of the paper, as columns
    start = own.T @ (eye - at - turn @ marker.at)
    if start[2] <= 0:
        return  # seen from below
    left, right, bottom, top = camera.edges
    pitch = (right - left) / camera.width, (top - bottom) / camera.height
    half = marker.paper / 2
    corners = np.array([(x, y, 0) for x in (-half, half) for y in (-half, half)])
    x, y, z = axes.T @ own @ (corners - start).T
    rows, columns = slice(0, camera.height), slice(0, camera.width)
    if (z > looks.NEAR).all():
        columns = _around((x / z - left) / pitch[0], camera.width)
        rows = _around((top - y / z) / pitch[1], camera.height)
    down, aside = np.mgrid[rows, columns] + 0.5
    slopes = left + pitch[0] * (aside[..., None] + POINTS[:, 0])
    rises = top - pitch[1] * (down[..., None] + POINTS[:, 1])
    ways = np.stack([slopes, rises, np.ones_like(slopes)])
    way = np.tensordot(own.T @ axes, ways, 1)
    far = -start[2] / np.minimum(way[2], -TINY)
    count = marker.cells + 2
    column = np.floor((start[0] + far * way[0] + half) / marker.paper * count)
    row = np.floor((half - start[1] - far * way[1]) / marker.paper * count)
    inside = (np.minimum(column, row) >= 0) & (np.maximum(column, row) < count)
    inside &= (depth[rows, columns] > far.mean(axis=-1) - COVERS)[..., None]
    row, column = (np.clip(n, 0, count - 1).astype(int) for n in (row, column))
    light = looks.AMBIENT + looks.DIFFUSE * max(0.0, float(own[:, 2] @ _LIGHT))
    ink = (light * INKS[cells(marker)[row, column]] * inside).mean(axis=-1)[..., None]
    rest = (1.0 - inside.mean(axis=-1))[..., None]
    drawn[rows, columns] = np.round(rest * drawn[rows, columns] + ink)


def _around(places: Array, most: int) -> slice:
    """Return the pixels from the first of these places to the last, in the picture."""
    first, last = np.clip([np.floor(places.min()), np.ceil(places.max())], 0, most)
    return slice(int(first), int(last))
