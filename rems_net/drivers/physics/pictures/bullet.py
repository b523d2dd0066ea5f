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
#: pixels. Points of a pixel, from its corner, at which a marker is looked at: no two in
#: one row or column, so level edges are as smooth as others.
POINTS = (np.column_stack([np.arange(32), 13 * np.arange(32) % 32]) + 0.5) / 32
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
    x, y, z = (own.T @ (eye - at - turn @ marker.at)).tolist()
    if z <= 0:
        return  # seen from below
    count = marker.cells + 2
    cell, half = marker.paper / count, count / 2
    left, right, bottom, top = camera.edges
    across, down = (right - left) / camera.width, (bottom - top) / camera.height
    # From a pixel to its ray, from there to the paper's plane, and to cells there.
    slopes = np.array([(across, 0, left), (0, down, top), (0, 0, 1)])
    meets = np.array([(-z, 0, x), (0, -z, y), (0, 0, 1)])
    counts = np.array([(1 / cell, 0, half), (0, -1 / cell, half), (0, 0, 1)])
    to_cells = counts @ meets @ own.T @ axes @ slopes
    corners = np.array([(i, j, 1) for i in (0, count) for j in (0, count)])
    u, v, w = np.linalg.inv(to_cells) @ corners.T
    columns, rows = slice(0, camera.width), slice(0, camera.height)
    if (-z * w > looks.NEAR).all():
        columns, rows = _around(u / w, camera.width), _around(v / w, camera.height)
    beside = np.arange(columns.start, columns.stop)[:, None] + POINTS[:, 0]
    below = np.arange(rows.start, rows.stop)[:, None, None] + POINTS[:, 1]
    column, row, ray = (a * beside + (b * below + c) for a, b, c in to_cells)
    ray = np.minimum(ray, -TINY)
    column, row = np.floor(column / ray), np.floor(row / ray)
    inside = (np.minimum(column, row) >= 0) & (np.maximum(column, row) < count)
    inside &= (depth[rows, columns] > -z / ray.mean(axis=-1) - COVERS)[..., None]
    number = np.where(inside, count * row + column, 0).astype(int)
    light = looks.AMBIENT + looks.DIFFUSE * max(0.0, float(own[:, 2] @ _LIGHT))
    inks = light * INKS[cells(marker)].ravel()
    ink = (inks[number] * inside).mean(axis=-1)[..., None]
    rest = 1.0 - inside.mean(axis=-1)[..., None]
    drawn[rows, columns] = np.round(rest * drawn[rows, columns] + ink)


def _around(places: Array, most: int) -> slice:
    """Return the pixels from the first of these places to the last, in the picture."""
    first, last = np.clip([np.floor(places.min()), np.ceil(places.max())], 0, most)
    return slice(int(first), int(last))
