"""Plain: the URDF of a robot in MJCF, for engines that read no MJCF.

Links are at their joints, with the axes of the world. A part of the robot that a URDF
cannot express is refused by its name; options, actuators and sensors are left out.
"""

from collections.abc import Iterator, Sequence
from typing import Any
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from rems_net.bodies.files import urdf
from rems_net.bodies.files.inertia import Inertia
from rems_net.bodies.model import Source
from rems_net.bodies.parts import Array
from rems_net.errors import SchemaError
from rems_net.kinematics.pose import Pose

#: formats of meshes that Bullet reads, too
MESHES = (".stl", ".obj")


class Plain:
    """URDF of a model that MuJoCo has compiled from `spec`, with all joints at zero.

    links: for the base and each joint, the bodies that it moves, and its place (3,) m
    Raises SchemaError for a part that a URDF cannot express.
    """

    def __init__(
        self,
        mujoco: Any,
        spec: Any,
        model: Any,
        data: Any,
        source: Source,
        links: Sequence[tuple[list[int], Array]],
        joints: Sequence[tuple[int, int]],
    ):
        self._mujoco, self._spec, self._model, self._data = mujoco, spec, model, data
        self._source, self._links = source, links
        #: Coulomb's coefficient of each link, by its name
        self.grips: dict[str, float] = {}
        own = [body for bodies, _ in links for body in bodies]
        for part in self._inexpressible(own, [joint for joint, _ in joints]):
            raise SchemaError(
                f"{source.path.name} cannot run in PyBullet, since a URDF cannot "
                f"express {part}; give the robot the driver mujoco. (R0204)"
            )
        self._out = Element("robot", name=source.path.stem)
        for bodies, place in links:
            self._link(bodies, place)
        for number, (joint, parent) in enumerate(joints, 1):
            self._joint(joint, parent + 1, number)
        indent(self._out)  # Bullet reads it by lines of at most 1023 letters

    @property
    def text(self) -> str:
        """The robot as URDF."""
        return tostring(self._out, encoding="unicode")

    def _inexpressible(self, own: list[int], joints: list[int]) -> Iterator[str]:
        """Yield each part of the robot that a URDF cannot express."""
        model, kinds = self._model, self._mujoco.mjtGeom
        for number in range(model.ntendon):
            yield f"the tendon {model.tendon(number).name!r}"
        for number in range(model.neq):
            kind = self._mujoco.mjtEq(model.eq_type[number]).name
            yield f"the equality {model.eq(number).name!r} ({kind[5:].lower()})"
        for number in range(model.nflex):
            yield f"the flex {model.flex(number).name!r}"
        for bodies, _ in self._links[1:]:
            if not bodies:
                yield "a body with several joints, or a joint that moves nothing"
        for body in own:
            if model.body_gravcomp[body]:
                yield f"the gravcomp of body {model.body(body).name!r}"
        for joint in joints:
            if model.jnt_stiffness[joint]:
                yield f"the spring (stiffness) of joint {model.joint(joint).name!r}"
        round_ = (kinds.mjGEOM_SPHERE, kinds.mjGEOM_CAPSULE, kinds.mjGEOM_CYLINDER)
        for geom in self._geoms(own):
            name = model.geom(geom).name or f"of {self._body_of(geom)}"
            kind = kinds(int(model.geom_type[geom]))
            if kind not in (*round_, kinds.mjGEOM_BOX, kinds.mjGEOM_MESH):
                yield f"the {kind.name[7:].lower()} (geom {name})"
            if model.geom_condim[geom] > 3:
                yield f"condim {model.geom_condim[geom]} of geom {name}"
            if kind == kinds.mjGEOM_MESH:
                mesh = self._mesh(geom)
                if not mesh.file.lower().endswith(MESHES):
                    yield f"the mesh {mesh.file or mesh.name!r} (only STL and OBJ)"
                if abs(mesh.refquat[0]) != 1.0:
                    yield f"the refquat of mesh {mesh.name!r}"
        for number in range(model.npair):
            yield f"the contact pair {model.pair(number).name!r}"

    def _geoms(self, bodies: Sequence[int]) -> list[int]:
        """Return the geoms of these bodies that touch."""
        model = self._model
        found = np.flatnonzero(np.isin(model.geom_bodyid, bodies)).tolist()
        return [g for g in found if model.geom_contype[g] or model.geom_conaffinity[g]]

    def _body_of(self, geom: int) -> str:
        return str(self._model.body(self._model.geom_bodyid[geom]).name)

    def _mesh(self, geom: int) -> Any:
        return self._spec.mesh(self._model.mesh(self._model.geom_dataid[geom]).name)

    def _name(self, number: int) -> str:
        return str(self._model.body(self._links[number][0][0]).name)

    def _link(self, bodies: list[int], place: Array) -> None:
        """Write the bodies that a joint moves as one link; or one for each friction."""
        model, data = self._model, self._data
        name = str(model.body(bodies[0]).name)
        made, whole = SubElement(self._out, "link", name=name), Inertia()
        for body in bodies:
            at = Pose(data.xipos[body] - place, data.ximat[body].reshape(3, 3))
            mass, own = float(model.body_mass[body]), model.body_inertia[body]
            whole += Inertia.of(mass, np.diag(own), at)
        if whole.mass:
            inertia, centre = whole.central()
            urdf.write_inertia(made, whole.mass, centre, inertia)
        else:  # of a base that never moves
            urdf.write_inertia(made, 1.0, np.zeros(3), np.eye(3))
        for geom in self._geoms(bodies):
            given = self._source.grip(self._body_of(geom))
            grip = float(model.geom_friction[geom, 0]) if given is None else given
            self._shape(self._gripping(made, name, grip), geom, place)

    def _gripping(self, made: Element, name: str, grip: float) -> Element:
        """Return the element of the link, or of one fixed to it, with this friction."""
        if self.grips.setdefault(name, grip) == grip:
            return made
        other = f"{name}, friction {grip:g}"
        for link in self._out.iter("link"):
            if link.get("name") == other:
                return link
        self.grips[other] = grip
        fixed = SubElement(self._out, "link", name=other)
        urdf.write_inertia(fixed, 0.0, np.zeros(3), np.zeros((3, 3)))
        joint = SubElement(self._out, "joint", name=f"{other} is fixed", type="fixed")
        SubElement(joint, "parent", link=name)
        SubElement(joint, "child", link=other)
        return fixed

    def _shape(self, link: Element, geom: int, place: Array) -> None:
        model, kinds = self._model, self._mujoco.mjtGeom
        turn = self._data.geom_xmat[geom].reshape(3, 3)
        pose = Pose(self._data.geom_xpos[geom] - place, turn)
        radius, half, _ = sizes = model.geom_size[geom].tolist()
        about = {"radius": repr(radius), "length": repr(2 * half)}
        match model.geom_type[geom]:
            case kinds.mjGEOM_SPHERE:
                kind, about = "sphere", {"radius": repr(radius)}
            case kinds.mjGEOM_CYLINDER:
                kind = "cylinder"
            case kinds.mjGEOM_CAPSULE:
                kind = "capsule"
            case kinds.mjGEOM_BOX:
                kind, about = "box", {"size": urdf.text([2 * size for size in sizes])}
            case _:
                kind, mesh, number = "mesh", self._mesh(geom), model.geom_dataid[geom]
                folder = self._source.path.parent.resolve() / self._spec.meshdir
                file = (folder / mesh.file).as_posix()
                about = {"filename": file, "scale": urdf.text(mesh.scale)}
                turn = np.zeros(9)
                self._mujoco.mju_quat2Mat(turn, model.mesh_quat[number])
                # MuJoCo moves the vertices by `refpos`, before the scale, and then to
                # their centre of mass and axes.
                moved = Pose(model.mesh_pos[number], turn.reshape(3, 3))
                pose = pose @ moved.inverse() @ Pose.of(-mesh.scale * mesh.refpos)
        urdf.write_shape(link, kind, about, pose)

    def _joint(self, joint: int, parent: int, number: int) -> None:
        model, dof = self._model, self._model.jnt_dofadr[joint]
        turns = model.jnt_type[joint] == self._mujoco.mjtJoint.mjJNT_HINGE
        limited = bool(model.jnt_limited[joint])
        kind = ("revolute" if limited else "continuous") if turns else "prismatic"
        made = SubElement(self._out, "joint", name=model.joint(joint).name, type=kind)
        SubElement(made, "parent", link=self._name(parent))
        SubElement(made, "child", link=self._name(number))
        at = self._links[number][1] - self._links[parent][1]
        SubElement(made, "origin", xyz=urdf.text(at), rpy="0 0 0")
        SubElement(made, "axis", xyz=urdf.text(self._data.xaxis[joint]))
        rubs = {"damping": model.dof_damping, "friction": model.dof_frictionloss}
        SubElement(made, "dynamics", {k: repr(float(v[dof])) for k, v in rubs.items()})
        low, high = model.jnt_range[joint].tolist() if limited else (1.0, -1.0)
        if limited or not turns:  # for Bullet, an upper end below the lower is none
            ends = {"lower": repr(low), "upper": repr(high)}
            SubElement(made, "limit", ends, effort="0", velocity="0")
