"""Model: what can be drawn of a place that is a MuJoCo model."""

from typing import Any

import numpy as np

from rems_net.bodies.parts import Array, Box, Cylinder, Shape, Sphere
from rems_net.libraries import load
from rems_net.maths import atan2
from rems_net.scenes import outline
from rems_net.scenes.scene import Scene

#: MuJoCo's numbers of shapes
SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX, MESH = 2, 3, 4, 5, 6, 7


def of_model(scene: Scene) -> dict[str, Any]:
    """Return walls and things of a scene's MuJoCo model, as `view.of_scene` does.

    A wall is anything of the world itself but a floor; a thing is a named body.
    """
    mujoco = load("mujoco", "mujoco")
    model = mujoco.MjModel.from_xml_path(scene.mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    walls, things = [], []
    fixed = outline.outline_of(
        _points(model, data, 0, np.zeros(3), np.eye(3)), joined=False
    )
    walls = [{"outline": one, "height": 0.1} for one in fixed]
    for name in scene.bodies:
        number = model.body(name).id
        at, turn = data.xpos[number], data.xmat[number].reshape(3, 3)
        heading = float(atan2(turn[1, 0], turn[0, 0]))
        s, c = np.sin(heading), np.cos(heading)
        level = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        points = _points(model, data, number, at, level)
        for one in outline.outline_of(points, joined=True):
            things.append(
                {
                    "name": name,
                    "outline": one,
                    "at": [float(v) for v in at],
                    "heading": heading,
                    "pitch": 0.0,
                    "colour": [0.6, 0.6, 0.6],
                }
            )
    return {"radius": 0.0, "walls": walls, "things": things}


def _points(model: Any, data: Any, top: int, at: Array, turn: Array) -> list[Array]:
    """Return points of each shape of a body with all in it, in a frame."""
    found = []
    for geom in range(model.ngeom):
        body = int(model.geom_bodyid[geom])
        mine = body == 0 if top == 0 else int(model.body_rootid[body]) == top
        place = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
        shape = _shape(int(model.geom_type[geom]), model.geom_size[geom])
        if not mine:
            continue
        if shape is not None:
            points = outline.corners(shape, *place)
        elif int(model.geom_type[geom]) == MESH:
            mesh = int(model.geom_dataid[geom])
            first = int(model.mesh_vertadr[mesh])
            some = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])]
            points = place[0] + some @ place[1].T
        else:
            continue
        found.append((points - at) @ turn)
    return found


def _shape(kind: int, size: Any) -> Shape | None:
    """Return the shape of these half lengths, m; None for a floor or a mesh."""
    a, b, c = map(float, size)
    if kind == BOX:
        return Box((2 * a, 2 * b, 2 * c))
    if kind == ELLIPSOID:
        return Box((2 * a, 2 * b, 2 * c))
    if kind == SPHERE:
        return Sphere(a)
    if kind in (CAPSULE, CYLINDER):
        return Cylinder(a, 2 * b + (2 * a if kind == CAPSULE else 0.0))
    return None
