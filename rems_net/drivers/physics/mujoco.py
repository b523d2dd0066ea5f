"""Mujoco: a robot done by the MuJoCo physics engine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np

from rems_net.drivers.needs import load
from rems_net.drivers.physics.mjcf import FLOOR, STIFF, WORLD, add_body, section, text
from rems_net.drivers.physics.physics import Physics
from rems_net.maths import cos, sin
from rems_net.worlds.body import GRAVITY, Arena, Array, Body


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
        self._free = int((self._model.jnt_type == mujoco.mjtJoint.mjJNT_FREE).sum())
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

    def joints(self) -> tuple[list[float], list[float]]:
        count = self._model.njnt - self._free
        positions = self._data.qpos[-count:] if count else ()
        speeds = self._data.qvel[-count:] if count else ()
        return list(map(float, positions)), list(map(float, speeds))

    def bend(self, positions: Sequence[float]) -> None:
        self._data.qpos[len(self._data.qpos) - len(positions) :] = positions
        self._data.qvel[:] = 0.0
        self._mujoco.mj_forward(self._model, self._data)

    def spin(self) -> Array:
        if not self._free:
            return np.zeros(3)
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
        gravity=text([0, 0, GRAVITY]),
    )
    _add_arena(section(root, "worldbody"), arena)
    add_body(root, body)
    return tostring(root, encoding="unicode")


def _add_arena(world: Element, arena: Arena) -> None:
    # MuJoCo takes the larger friction of two: with 0 here, the robot's part decides.
    contact = {"contype": "2", "conaffinity": "1", "friction": "0 0 0", **STIFF}
    contact["group"] = str(WORLD)
    SubElement(world, "geom", contact, name=FLOOR, type="plane", size="0 0 1")
    for wall in arena.walls():
        SubElement(
            world,
            "geom",
            contact,
            type="box",
            size=text(np.array(wall.size) / 2),
            pos=text(wall.at),
            euler=text([0, 0, wall.yaw]),
        )
