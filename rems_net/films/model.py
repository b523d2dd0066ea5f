"""DrawnModel: places and robots in a MuJoCo model that is only drawn.

It is made from the plain values of `scenes/view.py`, as the page's 3-D view is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from math import floor, log10
from typing import Any
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np
from numpy.typing import NDArray

from rems_net.bodies.arena import Arena
from rems_net.bodies.parts import Array
from rems_net.bodies.sensors import Camera
from rems_net.drivers.physics.mjcf import section
from rems_net.drivers.physics.pictures import looks
from rems_net.drivers.physics.pictures.dress import add_light
from rems_net.drivers.physics.pictures.painter import Painter
from rems_net.kinematics.pose import Pose
from rems_net.libraries import load
from rems_net.scenes.scene import upright

Scene = Mapping[str, Any]
#: red, green, blue and opacity, 0 to 1
Ink = tuple[float, float, float, float]

#: m. Height and radius of a robot whose shape is not known.
UNKNOWN = 0.05
#: m. A loop is closed if its ends are this near; rounds of Newton's method until then.
CLOSED, ROUNDS = 1e-5, 20
#: steps in which joints first move from zero, so that loops fold as they should
STEPS = 20
#: share of the brightness of every second link, so that neighbours differ
SHADED = 0.7
#: Ghosts are this much smaller, so that they are inside of a robot at the same place.
SHRUNK = 0.98
#: width of a trail as a share of the reach of all
WIDE = 0.003
#: pixels, in each direction, in which shadows are computed
SHADOWS = 2048
#: as shares of the reach of all: half of the floor's edge, and the distance from the
#: light in which there are shadows; a floor that reaches further is spotted there
FLOOR, SHADED_TO = 2.0, 3.0


class DrawnModel:
    """Bodies at poses that are set. `build` it when all are there."""

    def __init__(self) -> None:
        self.mujoco = load("mujoco", "mujoco")
        root = Element("mujoco")
        add_light(root)
        floor = {"type": "plane", "size": "1 1 1", "material": "tiles"}
        SubElement(section(root, "worldbody"), "geom", floor)
        self._spec = spec = self.mujoco.MjSpec.from_string(tostring(root, "unicode"))
        spec.lights[0].castshadow = True
        spec.visual.quality.offsamples, spec.visual.quality.shadowsize = 4, SHADOWS
        spec.visual.map.shadowclip = SHADED_TO
        #: by body, the number of the first of its joints; of all joints, the positions
        self._first: dict[str, int] = {}
        self._wanted: list[float] = []
        #: names of two bodies, and a point on each, that are to meet
        self._ends: list[tuple[str, Any, str, Any]] = []
        self._free: list[int] = []
        self._trails: list[range] = []

    def place(self, name: str, scene: Scene) -> None:
        """Add the walls of a place."""
        self._meshes(name, scene)
        ink: Ink = (*looks.WALL, 1.0)
        for wall in scene.get("walls", ()):
            for solid in wall.get("solids", ()):
                self._solid(self._spec.worldbody, name, solid, ink)

    def ring(self, radius: float, height: float) -> None:
        """Add a round wall about the origin."""
        for wall in Arena(radius, height).walls():
            box = {"box": wall.size, "at": wall.at, "turn": upright(wall.yaw)}
            self._solid(self._spec.worldbody, "", box, (*looks.WALL, 1.0))

    def body(self, name: str, scene: Scene, ink: Ink, meshes: str = "") -> None:
        """Add a robot or a thing.

        meshes: name of the place whose meshes these are, if they are not its own.
        """
        first = self._first[name] = len(self._wanted)
        self._meshes(name, scene)
        carriers = [self._spec.worldbody.add_body(name=name, mocap=True)]
        links = scene.get("links", ())
        hinge, slide = (
            self.mujoco.mjtJoint.mjJNT_HINGE,
            self.mujoco.mjtJoint.mjJNT_SLIDE,
        )
        for number, link in enumerate(links):
            carrier = carriers[link["parent"] + 1].add_body(
                name=f"{name} {number}",
                pos=link["at"],
                mass=1.0,
                inertia=(1.0, 1.0, 1.0),
                explicitinertial=True,
            )
            kind = slide if link["slides"] else hinge
            carrier.add_joint(type=kind, axis=link["axis"])
            carriers.append(carrier)
        for one, at, other, there in scene.get("loops", ()):
            self._ends.append((f"{name} {one}", at, f"{name} {other}", there))
            for link in {*_under(links, one), *_under(links, other)}:
                if not links[link]["field"] and not links[link]["slides"]:
                    self._free.append(first + link)
        self._wanted += [0.0] * len(links)
        solids = scene.get("solids") or [self._unknown(name, scene)]
        for solid in solids:
            number = int(solid.get("link", -1))
            shade = SHADED if number >= 0 and number % 2 == 0 else 1.0
            red, green, blue, solidity = ink
            own = shade * red, shade * green, shade * blue, solidity
            self._solid(carriers[number + 1], meshes or name, solid, own)

    def trail(self, points: Array, ink: Ink) -> range:
        """Add a way on the floor; return the numbers of its pieces.

        points: (n, 2), m
        """
        world, first = self._spec.worldbody, len(self._spec.worldbody.geoms)
        capsule = self.mujoco.mjtGeom.mjGEOM_CAPSULE
        for (x, y), (there, beside) in pairwise(points.tolist()):
            ends = [x, y, 0.0, there, beside, 0.0]
            world.add_geom(type=capsule, fromto=ends, size=[1e-3, 0, 0], rgba=ink)
        self._trails.append(range(first, len(world.geoms)))
        return self._trails[-1]

    def _unknown(self, name: str, scene: Scene) -> Scene:
        """Return the solid of a robot of which at most the outline is known."""
        outline = scene.get("outline", ())
        if len(outline) < 3:
            return {"cylinder": (UNKNOWN, UNKNOWN), "at": (0.0, 0.0, UNKNOWN / 2)}
        corners = [[x, y, z] for x, y in outline for z in (0.0, UNKNOWN)]
        self._spec.add_mesh(name=f"{name} 0", uservert=np.ravel(corners))
        return {"mesh": 0}

    def _meshes(self, name: str, scene: Scene) -> None:
        for number, mesh in enumerate(scene.get("meshes", ())):
            self._spec.add_mesh(
                name=f"{name} {number}",
                uservert=mesh["corners"],
                userface=mesh["faces"],
                # Those of others may be open or flat; these need no volume.
                inertia=self.mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
            )

    def _solid(self, carrier: Any, name: str, solid: Scene, ink: Ink) -> None:
        """Add a solid to a body of the model; name: of the one with its meshes."""
        kinds, words = self.mujoco.mjtGeom, dict[str, Any]()
        if "box" in solid:
            words = {"type": kinds.mjGEOM_BOX, "size": np.array(solid["box"]) / 2}
        elif "cylinder" in solid:
            radius, long = solid["cylinder"]
            words = {"type": kinds.mjGEOM_CYLINDER, "size": [radius, long / 2, 0.0]}
        elif "ball" in solid:
            words = {"type": kinds.mjGEOM_ELLIPSOID, "size": solid["ball"]}
        else:
            mesh = f"{name} {solid['mesh']}"
            words = {"type": kinds.mjGEOM_MESH, "meshname": mesh}
        size = words.get("size", np.zeros(3)) * np.array(1.0 if ink[3] == 1 else SHRUNK)
        words["size"] = np.maximum(size, 1e-6)  # rounded ones may be 0
        carrier.add_geom(
            **words,
            pos=solid.get("at", (0.0, 0.0, 0.0)),
            quat=self._quaternion(np.array(solid.get("turn", np.eye(3)), float)),
            rgba=ink,
            contype=0,
            conaffinity=0,
        )

    def _quaternion(self, turn: Array) -> Array:
        """Return a rotation (3, 3) as MuJoCo's four numbers."""
        four = np.zeros(4)
        self.mujoco.mju_mat2Quat(four, turn.ravel())
        return four

    def build(self) -> None:
        """Compile it. All joints are at zero then."""
        self.model = model = self._spec.compile()
        self.data = self.mujoco.MjData(model)
        #: opacity of all geoms
        self._opacity = model.geom_rgba[:, 3].copy()
        self._loops = [
            (model.body(one).id, np.array(at), model.body(other).id, np.array(there))
            for one, at, other, there in self._ends
        ]
        self._folded = False

        number = {model.body(name).id: name for name in self._first}
        roots = [number.get(root, "") for root in model.body_rootid.tolist()]
        owners = np.array(roots)[model.geom_bodyid]
        self._geoms = {
            name: np.flatnonzero(owners == name).tolist() for name in self._first
        }

    def fit(self, middle: Array, reach: float) -> None:
        """Fit floor, trails and shadows to where things are.

        middle: (3,) m.  reach: from there to the furthest of them, m.
        """
        model = self.model
        # A texture is two tiles wide.
        model.mat_texrepeat[:] = 10.0 ** -floor(log10(reach / 2))
        for pieces in self._trails:
            model.geom_size[pieces, 0] = WIDE * reach
        model.stat.extent, model.stat.center = reach, middle
        # Shadows are computed around the light.
        model.light_pos[:] = middle + reach * np.array(looks.LIGHT)
        model.geom_size[0, :2] = FLOOR * reach
        model.geom_pos[0, :2] = middle[:2]

    def painter(self, camera: Camera, depths: tuple[float, float]) -> Painter:
        """Return what draws it."""
        return Painter(self.mujoco, self.model, self.data, [camera], depths=depths)

    def uncover(self, geoms: Sequence[int], shown: NDArray[np.bool] | bool) -> None:
        """Show some of the pieces of a trail, and hide the others."""
        opacity = self._opacity[geoms]
        self.model.geom_rgba[geoms, 3] = np.where(shown, opacity, 0.0)

    def show(self, name: str, shown: bool) -> None:
        """Show or hide a body."""
        self.uncover(self._geoms[name], shown)

    def put(self, name: str, pose: Pose) -> None:
        """Give a body a pose."""
        number = self.model.body(name).mocapid[0]
        self.data.mocap_pos[number] = pose.position
        self.data.mocap_quat[number] = self._quaternion(pose.rotation)

    def bend(self, name: str, link: int, position: float) -> None:
        """Give the joint of a body's link a position, rad or m."""
        self._wanted[self._first[name] + link] = position

    def move(self) -> None:
        """Move everything to where it is wanted; joints of closed loops follow."""
        free, data, wanted = self._free, self.data, np.array(self._wanted)
        steps = 1 if self._folded or not free else STEPS
        for step in range(1, steps + 1):
            kept = data.qpos[free].copy()
            data.qpos[:] = wanted * step / steps
            data.qpos[free] = kept
            self._close()
        self._folded = True
        self.mujoco.mj_kinematics(self.model, data)

    def _close(self) -> None:
        """Move the joints that nothing measures until the loops are closed."""
        mujoco, model, data = self.mujoco, self.model, self.data
        for _ in range(ROUNDS if self._loops else 0):
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            gaps, slopes = [], []
            for one, at, other, there in self._loops:
                (near, moves), (far, follows) = (
                    self._end(one, at),
                    self._end(other, there),
                )
                gaps.append(far - near)
                slopes.append(follows - moves)
            gap = np.concatenate(gaps)
            if np.abs(gap).max() < CLOSED:
                return
            data.qpos[self._free] -= np.linalg.lstsq(np.concatenate(slopes), gap)[0]

    def _end(self, body: int, at: Array) -> tuple[Array, Array]:
        """Return a link's point in the world (3,), and its slope by free joints."""
        data, slope = self.data, np.zeros((3, self.model.nv))
        place = data.xpos[body] + data.xmat[body].reshape(3, 3) @ at
        self.mujoco.mj_jac(self.model, data, slope, None, place, body)
        return place, slope[:, self._free]

    def bounds(self) -> tuple[Array, Array]:
        """Return the lowest and the highest corner (3,) of all that is shown, m."""
        model, data = self.model, self.data
        shown = (model.geom_rgba[:, 3] > 0) & (model.geom_type > 0)
        middle, half = model.geom_aabb[shown, :3], model.geom_aabb[shown, 3:]
        turns = data.geom_xmat[shown].reshape(-1, 3, 3)
        at = data.geom_xpos[shown] + np.einsum("nij,nj->ni", turns, middle)
        reach = np.einsum("nij,nj->ni", np.abs(turns), half)
        return (at - reach).min(axis=0), (at + reach).max(axis=0)


def _under(links: Sequence[Scene], link: int) -> Iterator[int]:
    """Yield the number of a link, and of all links that carry it."""
    while link >= 0:
        yield link
        link = links[link]["parent"]
