"""Model: what can be drawn of a place or a robot that MuJoCo reads from a file."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from rems_net.bodies.body import Body
from rems_net.bodies.files.mjcf import opened, root_of
from rems_net.bodies.parts import Array, Box, Cylinder, Shape, Sphere
from rems_net.bodies.tree import Tree
from rems_net.libraries import load
from rems_net.maths import atan2, hypot
from rems_net.scenes import outline
from rems_net.scenes.scene import Scene, upright

#: MuJoCo's numbers of shapes
SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX, MESH = 2, 3, 4, 5, 6, 7
#: triangles of all meshes of one agent. A mesh for which there is no room left is its
#: convex hull, or the box around it: an answer stays below 400 kB.
TRIANGLES = 8000
#: groups of geoms that MuJoCo's own viewer shows at first
SHOWN = 3


def of_model(scene: Scene) -> dict[str, Any]:
    """Return walls and things of a scene's MuJoCo model, as `view.of_scene` does.

    A wall is anything of the world itself but a floor; a thing is a named body.
    """
    mujoco = load("mujoco", "mujoco")
    model = mujoco.MjModel.from_xml_path(scene.mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    shapes = _Shapes(model, data)
    zero, straight = np.zeros(3), np.eye(3)
    walls = []
    for geom in np.flatnonzero(model.geom_bodyid == 0).tolist():
        points = shapes.points([geom], zero, straight)
        for one in outline.outline_of(points, joined=False):
            solids = shapes.solids([geom], zero, straight)
            walls.append({"outline": one, "solids": solids})
    things = []
    for name in scene.bodies:
        number = model.body(name).id
        at, turn = data.xpos[number], data.xmat[number].reshape(3, 3)
        heading = float(atan2(turn[1, 0], turn[0, 0]))
        geoms = np.flatnonzero(model.body_rootid[model.geom_bodyid] == number).tolist()
        points = shapes.points(geoms, at, upright(heading))
        for one in outline.outline_of(points, joined=True):
            things.append(
                {
                    "name": name,
                    "outline": one,
                    "solids": shapes.solids(geoms, at, turn),
                    "at": [float(v) for v in at],
                    "heading": heading,
                    "pitch": float(atan2(turn[2, 0], hypot(turn[0, 0], turn[1, 0]))),
                    "roll": float(atan2(turn[2, 1], turn[2, 2])),
                    "colour": [0.6, 0.6, 0.6],
                }
            )
    return {
        "radius": 0.0,
        "walls": walls,
        "things": things,
        "meshes": shapes.meshes,
        "flat": bool((np.abs(data.geom_xmat[:, [2, 5]]) < 1e-6).all()),
    }


def of_file(body: Body) -> dict[str, Any]:
    """Return the solids and meshes of a robot's file, as `view.of_body` does."""
    mujoco = load("mujoco", "mujoco")
    assert body.source is not None
    spec = opened(mujoco, body.source)
    name = root_of(spec, body.source).name
    model = spec.compile()
    data = mujoco.MjData(model)
    tree = Tree(body)
    for joint in tree.numbers:
        data.qpos[model.joint(joint).qposadr] = 0.0
    mujoco.mj_kinematics(model, data)
    shapes, root = _Shapes(model, data), model.body(name).id
    numbers = {model.joint(joint).id: n for joint, n in tree.numbers.items()}
    origin = data.xpos[root].copy()
    places, _ = tree.places([0.0] * len(tree.links))
    #: number of the link that each body is part of; -1 is the robot itself
    links = {int(model.body_parentid[root]): -1}
    found = []
    for number in np.flatnonzero(model.body_rootid == root).tolist():
        own = np.flatnonzero(model.jnt_bodyid == number).tolist()
        moved = [numbers[joint] for joint in own if joint in numbers]
        link = moved[-1] if moved else links[int(model.body_parentid[number])]
        links[number] = link
        at = origin + places[link] if link >= 0 else origin
        geoms = np.flatnonzero(model.geom_bodyid == number).tolist()
        found += [{**one, "link": link} for one in shapes.solids(geoms, at, np.eye(3))]
    return {"solids": found, "meshes": shapes.meshes}


class _Shapes:
    """Shapes of a model: as solids to draw, and as points for outlines."""

    def __init__(self, model: Any, data: Any):
        self._model, self._data = model, data
        #: corners, three numbers each in m, and triangles, three corners each
        self.meshes: list[dict[str, Any]] = []
        self._known: dict[int, dict[str, Any]] = {}
        self._left = TRIANGLES

    def points(self, geoms: Iterable[int], at: Array, turn: Array) -> list[Array]:
        """Return points (n, 3) of each of these shapes, in a frame, m."""
        model, found = self._model, []
        for geom in geoms:
            kind = int(model.geom_type[geom])
            place = self._place(geom)
            if (shape := _shape(kind, model.geom_size[geom])) is not None:
                points = outline.corners(shape, *place)
            elif kind == MESH:
                points = place[0] + self._corners(geom) @ place[1].T
            else:
                continue
            found.append((points - at) @ turn)
        return found

    def solids(
        self, geoms: Iterable[int], at: Array, turn: Array
    ) -> list[dict[str, Any]]:
        """Return the solids of the visible ones of these shapes, in a frame."""
        model, found = self._model, []
        for geom in geoms:
            if model.geom_group[geom] >= SHOWN or not model.geom_rgba[geom][3]:
                continue
            place, rotation = self._place(geom)
            a, b, c = model.geom_size[geom].tolist()
            here: Sequence[tuple[dict[str, Any], float]] = ()
            match int(model.geom_type[geom]):
                case kind if kind == BOX:
                    here = (({"box": _numbers((2 * a, 2 * b, 2 * c))}, 0.0),)
                case kind if kind == SPHERE:
                    here = (({"ball": _numbers((a, a, a))}, 0.0),)
                case kind if kind == ELLIPSOID:
                    here = (({"ball": _numbers((a, b, c))}, 0.0),)
                case kind if kind in (CYLINDER, CAPSULE):
                    here = (({"cylinder": _numbers((a, 2 * b))}, 0.0),)
                    if kind == CAPSULE:
                        end = {"ball": _numbers((a, a, a))}
                        here = (*here, (end, b), (end, -b))
                case kind if kind == MESH:
                    here = ((self._mesh(geom), 0.0),)
            for words, along in here:
                middle = place + rotation[:, 2] * along
                own = turn.T @ rotation
                if "box" in words and kind == MESH:  # around a mesh: off its middle
                    middle = middle + rotation @ model.geom_aabb[geom][:3]
                found.append(
                    {
                        **words,
                        "at": _numbers((middle - at) @ turn),
                        "turn": [_numbers(row) for row in own],
                    }
                )
        return found

    def _place(self, geom: int) -> tuple[Array, Array]:
        """Return middle (3,) and rotation (3, 3) of a shape, in the world."""
        return self._data.geom_xpos[geom], self._data.geom_xmat[geom].reshape(3, 3)

    def _corners(self, geom: int) -> Array:
        mesh = int(self._model.geom_dataid[geom])
        first = int(self._model.mesh_vertadr[mesh])
        last = first + int(self._model.mesh_vertnum[mesh])
        return np.asarray(self._model.mesh_vert[first:last], float)

    def _mesh(self, geom: int) -> dict[str, Any]:
        """Return a mesh as it is if there is room, else its hull, else a box."""
        mesh = int(self._model.geom_dataid[geom])
        if mesh not in self._known:
            words: dict[str, Any] = {
                "box": _numbers(2 * self._model.geom_aabb[geom][3:])
            }
            for faces in (self._faces(mesh), self._hull(mesh)):
                if 0 < len(faces) <= self._left:
                    self._left -= len(faces)
                    used, numbers = np.unique(faces, return_inverse=True)
                    corners = self._corners(geom)[used]
                    half = np.abs(corners).max(axis=0)
                    words = {"mesh": len(self.meshes), "half": _numbers(half)}
                    self.meshes.append(
                        {
                            "corners": _numbers(corners.ravel()),
                            "faces": numbers.ravel().tolist(),
                        }
                    )
                    break
            self._known[mesh] = words
        return self._known[mesh]

    def _faces(self, mesh: int) -> Array:
        first = int(self._model.mesh_faceadr[mesh])
        last = first + int(self._model.mesh_facenum[mesh])
        return np.asarray(self._model.mesh_face[first:last])

    def _hull(self, mesh: int) -> Array:
        """Return the triangles (n, 3) of its convex hull; none if it was not needed."""
        first = int(self._model.mesh_graphadr[mesh])
        if first < 0:
            return np.zeros((0, 3), int)
        graph = self._model.mesh_graph[first:]
        corners, faces = int(graph[0]), int(graph[1])
        begin = 2 + 3 * corners + 3 * faces
        return np.asarray(graph[begin : begin + 3 * faces]).reshape(-1, 3)


def _numbers(some: Any) -> list[float]:
    return [round(float(one), 4) for one in some]


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
