"""MJCF: a robot's file in MuJoCo's own XML, read by MuJoCo."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from rems_net.bodies.files import bounds, sheet
from rems_net.bodies.files.elements import MOST
from rems_net.bodies.files.meshes import made_binary, mesh_file
from rems_net.bodies.files.plain import Plain
from rems_net.bodies.files.sheet import Box, Moved, Sheet, Solid
from rems_net.bodies.model import Model, Source
from rems_net.bodies.parts import Array
from rems_net.errors import SchemaError, nearest, some
from rems_net.kinematics.pose import Pose
from rems_net.kinematics.rotation import three

#: file formats of meshes that MuJoCo reads
MESHES = (".stl", ".obj", ".msh")


def read(mujoco: Any, model: Model, path: Path, *, plain: bool = False) -> Sheet:
    """Return the file's content as a sheet; plain: as URDF, too. Raises SchemaError."""
    source = Source(path, "", model.root, model.held, model.friction)
    spec = opened(mujoco, source)
    root = root_of(spec, source)
    try:
        compiled = spec.compile()
    except ValueError as error:
        raise refused(path, error) from None
    return _Reading(mujoco, compiled, source, root.name).sheet(spec if plain else None)


def opened(mujoco: Any, source: Source) -> Any:
    """Return MuJoCo's spec of a robot's file, without sensors and held joints.

    Raises SchemaError for a file that MuJoCo refuses.
    """
    if source.urdf:
        return _of_urdf(mujoco, source)
    try:
        spec = mujoco.MjSpec.from_file(str(source.path))
    except ValueError as error:
        raise refused(source.path, error) from None
    for kind, each in (("body", spec.bodies), ("joint", spec.joints)):
        for number, one in enumerate(each):
            one.name = one.name or f"{kind} {number}"
    known = [joint.name for joint in spec.joints]
    for name in source.held:
        if name not in known:
            raise sheet.no_joint(source.path.name, name, known)
    moved = [one for one in spec.actuators if one.target in source.held]
    gone = [one for one in spec.joints if one.name in source.held]
    for one in (*moved, *gone, *spec.sensors, *spec.keys):
        spec.delete(one)
    return spec


def root_of(spec: Any, source: Source) -> Any:
    """Return the body that is the robot; other bodies are left out."""
    roots = list(_children(spec.worldbody))
    names = [body.name for body in roots]
    if source.root:
        if source.root not in names:
            raise SchemaError(
                f"{source.path.name} has no body {source.root!r} in its worldbody."
                f"{nearest(source.root, names)} Its bodies: {some(names)}. (R0207)"
            )
        return roots[names.index(source.root)]
    if len(roots) != 1:
        raise SchemaError(
            f"{source.path.name} has {len(roots)} bodies in its worldbody "
            f"({some(names)}); name that of the robot: Model(root=...), "
            "or --root of rems new. (R0208)"
        )
    return roots[0]


def refused(path: object, error: ValueError) -> SchemaError:
    """Return the error for a file that MuJoCo refuses."""
    what = ", ".join(line for line in str(error).splitlines() if line.strip())
    return SchemaError(f"MuJoCo does not take {path}: {what.rstrip(' ,.')}. (R0206)")


def check(mujoco: Any, source: Source) -> None:
    """Raise SchemaError for a URDF that MuJoCo cannot compile."""
    spec = opened(mujoco, source)
    try:
        spec.compile()
    except ValueError as error:
        raise refused(source.path, error) from None


def _of_urdf(mujoco: Any, source: Source) -> Any:
    robot = ElementTree.fromstring(source.urdf)
    names, meshes = dict[Path, str](), dict[str, bytes]()
    for mesh in robot.iter("mesh"):
        path = Path(mesh.get("filename", ""))
        if path.suffix.lower() not in MESHES:
            raise SchemaError(
                f"{source.path.name} needs the mesh {path.name}, and MuJoCo reads STL "
                "and OBJ: save it as one of these, or give the robot the driver "
                "pybullet. (R0211)"
            )
        if path not in names:
            # MuJoCo takes two meshes with the same name for one, even in two folders.
            names[path] = str(path.with_stem(f"{path.stem}-{len(names)}"))
            meshes[names[path]] = made_binary(path) or mesh_file(path)
        mesh.set("filename", names[path])
    text = ElementTree.tostring(robot, encoding="unicode")
    try:
        spec = mujoco.MjSpec.from_string(text, assets=meshes)
    except ValueError as error:
        raise refused(source.path, error) from None
    for mesh in spec.meshes:  # the link has its own inertia: no mesh needs a volume
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    return spec


def _children(body: Any) -> Iterator[Any]:
    child = body.first_body()
    while child is not None:
        yield child
        child = body.next_body(child)


class _Reading:
    """Reader of MuJoCo's model of the file, with all joints at zero."""

    def __init__(self, mujoco: Any, model: Any, source: Source, root: str):
        self._mujoco, self._model, self._source = mujoco, model, source
        self._root = model.body(root).id
        self._data = data = mujoco.MjData(model)
        self._own = np.flatnonzero(model.body_rootid == self._root)
        joints = np.flatnonzero(np.isin(model.jnt_bodyid, self._own))
        kinds = mujoco.mjtJoint
        self._free = False
        self._joints: list[int] = []
        for number in joints.tolist():
            kind = model.jnt_type[number]
            if kind == kinds.mjJNT_FREE:
                self._free = True
            elif kind == kinds.mjJNT_BALL:
                raise SchemaError(
                    f"{source.path.name}: {model.joint(number).name!r} is a ball "
                    "joint; a robot here has hinges and slides. (R0212)"
                )
            else:
                self._joints.append(number)
                data.qpos[model.jnt_qposadr[number]] = 0.0
        mujoco.mj_kinematics(model, data)
        for told in ("body_pos", "body_mass", "geom_pos", "geom_size", "jnt_range"):
            if not (np.abs(getattr(model, told)) <= MOST).all():
                raise SchemaError(
                    f"{source.path.name}: a number of its {told} is beyond {MOST:g}, "
                    "or none at all. (R0212)"
                )
        links = [model.body(body).name for body in self._own.tolist()]
        sheet.check_links(source.path.name, source.friction, links)

    def sheet(self, spec: Any = None) -> Sheet:
        """Return the sheet. spec: of the file, for a sheet that has the URDF, too."""
        model, data = self._model, self._data
        origin = data.xpos[self._root].copy()
        #: number of the last joint on the way from the root to each body; -1: none
        last = {int(model.body_parentid[self._root]): -1}
        places, parents = [origin], list[int]()
        for body in self._own.tolist():
            last[body] = last[int(model.body_parentid[body])]
            for joint in (n for n in self._joints if model.jnt_bodyid[n] == body):
                parents.append(last[body])
                places.append(data.xanchor[joint])
                last[body] = len(parents) - 1
        moved = [
            ([body for body, n in last.items() if n == number], place)
            for number, place in enumerate(places, -1)
        ]
        solids = [self._solid(bodies, place) for bodies, place in moved]
        plain, grips = "", dict[str, float]()
        if spec is not None:
            own = [([b for b in bodies if b in self._own], at) for bodies, at in moved]
            joints = [*zip(self._joints, parents, strict=True)]
            about = self._mujoco, spec, model, data, self._source
            made = Plain(*about, own, joints)
            plain, grips = made.text, made.grips
        return Sheet(
            self._source.path,
            model.body(self._root).name,
            solids[0],
            tuple(
                self._moved(joint, parent, place - places[parent + 1], solid)
                for joint, parent, place, solid in zip(
                    self._joints, parents, places[1:], solids[1:], strict=True
                )
            ),
            height=float(origin[2]),
            bolted=not self._free,
            plain=plain,
            grips=grips,
        )

    def _moved(self, joint: int, parent: int, at: Array, solid: Solid) -> Moved:
        model, dof = self._model, self._model.jnt_dofadr[joint]
        limits = None
        if model.jnt_limited[joint]:
            low, high = model.jnt_range[joint].tolist()
            limits = low, high
        return Moved(
            model.joint(joint).name,
            model.jnt_type[joint] == self._mujoco.mjtJoint.mjJNT_HINGE,
            parent,
            three(at),
            three(self._data.xaxis[joint]),
            solid,
            limits,
            self._effort(joint),
            damping=float(model.dof_damping[dof]),
            armature=float(model.dof_armature[dof]),
            **self._servo(joint),
        )

    def _effort(self, joint: int) -> float:
        """Return the most that the joint's motors give, N m or N; 0 if not stated."""
        model, most = self._model, [0.0]
        if model.jnt_actfrclimited[joint]:
            return float(model.jnt_actfrcrange[joint].max())
        fixed = self._mujoco.mjtBias.mjBIAS_NONE
        for one in self._actuators(joint):
            gear = abs(float(one.gear[0]))
            if one.forcelimited[0]:
                most.append(gear * float(one.forcerange.max()))
            elif one.ctrllimited[0] and one.biastype[0] == fixed:
                gain = float(one.gainprm[0])
                most.append(gear * gain * float(one.ctrlrange.max()))
        return max(most)

    def _servo(self, joint: int) -> dict[str, Any]:
        """Return the servo's values from a <position>, a <velocity> and so on."""
        told: dict[str, Any] = {}
        for one in self._actuators(joint):
            gear, gain = float(one.gear[0]), float(one.gainprm[0])
            _, stiff, brake, *_ = one.biasprm.tolist()
            if one.biastype[0] != self._mujoco.mjtBias.mjBIAS_AFFINE or not gear:
                continue
            ends = sorted(float(end) / gear for end in one.ctrlrange)
            if brake < 0:
                told["brake"] = -brake * gear * gear
            if stiff < 0:
                told |= {"asked": (ends[0], ends[1])} if one.ctrllimited[0] else {}
                told |= {"gain": gain / -brake} if brake < 0 else {}
            elif brake < 0 and one.ctrllimited[0]:
                told["speed"] = max(map(abs, ends))
        return told

    def _actuators(self, joint: int) -> Iterator[Any]:
        kinds = self._mujoco.mjtTrn
        for number in range(self._model.nu):
            one = self._model.actuator(number)
            if one.trntype[0] == kinds.mjTRN_JOINT and one.trnid[0] == joint:
                yield one

    def _solid(self, bodies: list[int], place: Array) -> Solid:
        model = self._model
        boxes = [
            (box[0] - place, box[1])
            for geom in np.flatnonzero(np.isin(model.geom_bodyid, bodies)).tolist()
            if model.geom_contype[geom] or model.geom_conaffinity[geom]
            for box in self._boxes(geom)
        ]
        own = [body for body in bodies if body in self._own]
        return Solid(float(model.body_mass[own].sum()), tuple(boxes))

    def _boxes(self, geom: int) -> Iterator[Box]:
        model, data, kinds = self._model, self._data, self._mujoco.mjtGeom
        pose = Pose(data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3))
        radius, half, _ = model.geom_size[geom].tolist()
        match model.geom_type[geom]:
            case kinds.mjGEOM_SPHERE:
                yield bounds.of_ball(pose, radius)
            case kinds.mjGEOM_CYLINDER:
                yield bounds.of_cylinder(pose, radius, 2 * half)
            case kinds.mjGEOM_CAPSULE:
                yield bounds.of_cylinder(pose, radius, 2 * (half + radius))
            case kinds.mjGEOM_PLANE | kinds.mjGEOM_HFIELD:
                return
            case _:
                middle, size = model.geom_aabb[geom][:3], 2 * model.geom_aabb[geom][3:]
                there = pose @ Pose(middle, np.eye(3))
                yield bounds.of_box(there, size)
