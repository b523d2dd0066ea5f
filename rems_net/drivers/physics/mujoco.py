"""Mujoco: a robot done by the MuJoCo physics engine."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np

from rems_net.drivers.needs import load
from rems_net.drivers.physics.physics import Physics
from rems_net.maths import cos, sin
from rems_net.worlds.body import (
    GRAVITY,
    Arena,
    Array,
    Body,
    Box,
    Cylinder,
    Part,
    Sphere,
    lump,
)

#: Contacts as stiff as a 1 ms step allows: wheels that sink are smaller wheels.
STIFF = {"solref": "0.004 1", "solimp": "0.99 0.99 0.001"}
#: Geom groups, so that a ray sees the world and not the robot it comes from.
WORLD, ROBOT = 0, 1


class Mujoco(Physics):
    """Runs the definition's body in MuJoCo.

    A motor gives torque / droop for every rad/s that the wheel is short of the command,
    up to `torque`. A contact's friction is the part's own.
    """

    needs = ("mujoco",)

    def build(self, body: Body, arena: Arena) -> _World:
        """Translate the body and the arena into a MuJoCo model."""
        return _World(load("mujoco", "mujoco"), mjcf(body, arena))


class _World:
    def __init__(self, mujoco: Any, xml: str):
        self._mujoco = mujoco
        self._model = mujoco.MjModel.from_xml_string(xml)
        self._data = mujoco.MjData(self._model)
        self._seen = np.zeros(6, np.uint8)
        self._seen[WORLD] = 1
        kinds = mujoco.mjtWarning
        self._lost = (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC)
        self._hit = np.zeros(1, np.int32)
        mujoco.mj_forward(self._model, self._data)

    def advance(self, speeds: Sequence[float], h: float, count: int) -> None:
        self._model.opt.timestep = h
        self._data.ctrl[:] = speeds
        self._mujoco.mj_step(self._model, self._data, count)
        # MuJoCo answers numbers that run away by starting anew, which nobody would see.
        if any(self._data.warning[kind].number for kind in self._lost):
            raise FloatingPointError(
                "The simulation became unstable. Give physics_step a smaller value, "
                "or the body masses and torques that fit together."
            )
        # Positions and rotations of bodies lag one step behind until asked for.
        self._mujoco.mj_kinematics(self._model, self._data)

    def pose(self) -> tuple[Array, Array]:
        base = self._data.body("base")
        return base.xpos.copy(), base.xmat.reshape(3, 3).copy()

    def spin(self) -> Array:
        # A free joint's angular velocity is told in the body's own frame.
        spin: Array = self.pose()[1] @ self._data.qvel[3:6]
        return spin

    def move(self, shift: Sequence[float], yaw: float) -> None:
        data = self._data
        data.qpos[:3] += shift
        turned = np.zeros(4)
        half = np.array([cos(yaw / 2), 0.0, 0.0, sin(yaw / 2)])
        self._mujoco.mju_mulQuat(turned, half, data.qpos[3:7].copy())
        data.qpos[3:7] = turned
        data.qvel[:] = 0.0
        self._mujoco.mj_forward(self._model, data)

    def ray(self, start: Array, direction: Array, reach: float) -> float:
        found = self._mujoco.mj_ray(
            self._model, self._data, start, direction, self._seen, 1, -1, self._hit
        )
        return reach if found < 0 else min(float(found), reach)

    def close(self) -> None:
        del self._data, self._model


def mjcf(body: Body, arena: Arena) -> str:
    """Return the body in its arena as MuJoCo's own XML."""
    root = Element("mujoco")
    SubElement(root, "compiler", angle="radian", inertiafromgeom="false")
    SubElement(
        root,
        "option",
        integrator="implicitfast",
        cone="elliptic",
        gravity=_text([0, 0, GRAVITY]),
    )
    world = SubElement(root, "worldbody")
    _add_arena(world, arena)
    base = SubElement(world, "body", name="base", pos=_text([0, 0, body.height]))
    SubElement(base, "freejoint")
    _add_parts(base, body.parts)
    motors = SubElement(root, "actuator")
    for hinge in body.hinges:
        link = SubElement(base, "body", pos=_text(hinge.at))
        SubElement(
            link,
            "joint",
            name=hinge.name,
            axis=_text(hinge.axis),
            armature=_text(hinge.armature),
        )
        _add_parts(link, hinge.parts)
        SubElement(
            motors,
            "velocity",
            joint=hinge.name,
            kv=_text(hinge.torque / hinge.droop),
            forcerange=_text([-hinge.torque, hinge.torque]),
        )
    return tostring(root, encoding="unicode")


def _add_arena(world: Element, arena: Arena) -> None:
    # MuJoCo takes the larger friction of two: with 0 here, the robot's part decides.
    contact = {"contype": "2", "conaffinity": "1", "friction": "0 0 0", **STIFF}
    contact["group"] = str(WORLD)
    SubElement(world, "geom", contact, type="plane", size="0 0 1")
    for wall in arena.walls():
        SubElement(
            world,
            "geom",
            contact,
            type="box",
            size=_text(np.array(wall.size) / 2),
            pos=_text(wall.at),
            euler=_text([0, 0, wall.yaw]),
        )


def _add_parts(link: Element, parts: Iterable[Part]) -> None:
    whole = lump(parts)
    i = whole.inertia
    SubElement(
        link,
        "inertial",
        mass=_text(whole.mass),
        pos=_text(whole.centre),
        fullinertia=_text([i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]),
    )
    for part in parts:
        if part.friction is None:
            continue
        geom = SubElement(link, "geom", _shape(part), contype="1", conaffinity="2")
        geom.attrib |= {"friction": _text([part.friction, 0, 0]), "group": str(ROBOT)}


def _shape(part: Part) -> dict[str, str]:
    match part.shape:
        case Box(size):
            half = _text(np.array(size) / 2)
            return {"type": "box", "size": half, "pos": _text(part.at)}
        case Sphere(radius):
            return {"type": "sphere", "size": _text(radius), "pos": _text(part.at)}
        case Cylinder(radius, length, axis):
            half_axis = np.array(axis) * length / 2
            ends = [np.array(part.at) - half_axis, np.array(part.at) + half_axis]
            return {"type": "cylinder", "size": _text(radius), "fromto": _text(ends)}


def _text(numbers: Any) -> str:
    """Return numbers as MuJoCo reads them, to the last bit."""
    return " ".join(repr(float(number)) for number in np.ravel(numbers))
