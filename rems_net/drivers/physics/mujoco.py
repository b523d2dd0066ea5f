"""Mujoco: a robot done by the MuJoCo physics engine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rems_net.drivers.models.mjcf import check
from rems_net.drivers.needs import load
from rems_net.drivers.physics.physics import Physics
from rems_net.drivers.physics.pictures.looks import cameras
from rems_net.drivers.physics.pictures.painter import Painter, look_for_renderer
from rems_net.drivers.physics.scenery import ROBOTS, compiled, names
from rems_net.drivers.physics.world import PhysicsWorld
from rems_net.maths import cos, sin
from rems_net.worlds.body import Array, Body
from rems_net.worlds.scenes.scene import Scene
from rems_net.worlds.sensors import Camera

#: Group of the geoms of a robot that sends out a ray: it does not see itself.
UNSEEN = 5


class Mujoco(Physics):
    """Runs the definition's body in MuJoCo.

    A motor gives torque / droop for every rad/s that the wheel is short of the command,
    up to `torque`. A contact's friction is the part's own; of two parts that may move,
    the larger one.
    """

    needs = ("mujoco",)

    def build(self, bodies: Sequence[Body], scene: Scene) -> _Engine:
        """Translate the bodies and the scene into a MuJoCo model."""
        mujoco = load("mujoco", "mujoco")
        model = compiled(mujoco, bodies, scene)
        before = ROBOTS if scene.mjcf else ""
        prefixes = [f"{before}{number}/" for number in range(len(bodies))]
        return _Engine(mujoco, model, prefixes, names(scene), [*cameras(bodies)])

    def look_for_renderer(self) -> None:
        """Raise MissingPartError if MuJoCo cannot draw here what a camera sees."""
        look_for_renderer()

    def prepare(self) -> None:
        """Check that MuJoCo takes the file of a body that has one."""
        super().prepare()
        source = self.member.body.source
        if source is not None and source.urdf:  # an MJCF was read by it
            check(load("mujoco", "mujoco"), source)

    @classmethod
    def share(cls, robots: Sequence[Physics], scene: Scene) -> PhysicsWorld:
        """Return the engine's world with all these robots."""
        world = super().share(robots, scene)
        if scene.mjcf:  # a mistake in the user's file is told before anything starts
            bodies = [member.body for member in world.members]
            compiled(load("mujoco", "mujoco"), bodies, scene)
        return world


class _Engine:
    def __init__(
        self,
        mujoco: Any,
        model: Any,
        prefixes: Sequence[str],
        names: Sequence[str],
        cameras: Sequence[Camera],
    ):
        self._mujoco, self._model = mujoco, model
        # Else it writes to the terminal, and to a file where the user works.
        mujoco.set_mju_user_warning(_counted)
        self._data = mujoco.MjData(model)
        # How often it warned of what; a singular inertia, the first, does no harm.
        self._warned = self._data.warning.number[1:]
        self._all = mujoco.mjtState.mjSTATE_INTEGRATION
        self._kept = np.empty(mujoco.mj_stateSize(model, self._all))
        mujoco.mj_forward(model, self._data)
        self._named = [model.body(name).id for name in names]
        self._painter = Painter(mujoco, model, self._data, cameras)
        self.instances = [
            _Instance(mujoco, model, self._data, prefix, self._painter)
            for prefix in prefixes
        ]

    def advance(self, h: float, count: int) -> None:
        self._model.opt.timestep = h
        self._mujoco.mj_step(self._model, self._data, count)
        if self._warned.any():
            self._give_up()
        # Positions and rotations of bodies lag one step behind until asked for.
        self._mujoco.mj_kinematics(self._model, self._data)

    def _give_up(self) -> None:
        """Raise what MuJoCo would answer by starting anew, or by a push left out."""
        contacts, constraints, *_ = self._warned
        if contacts or constraints:
            raise FloatingPointError(
                "More things touch than MuJoCo has room for. Move robots and things "
                'apart, or give a place of your own more: <size memory="100M"/>.'
            )
        raise FloatingPointError(
            "The simulation became unstable. Give physics_step a smaller value, "
            "or the body masses and torques that fit together."
        )

    def refresh(self) -> None:
        self._mujoco.mj_forward(self._model, self._data)

    def keep(self) -> None:
        self._mujoco.mj_getState(self._model, self._data, self._kept, self._all)
        for instance in self.instances:
            instance.keep()

    def restore(self) -> None:
        # What MuJoCo integrates is the whole state, with the accelerations from which
        # its solver starts; everything else is computed from it, and begins at zero.
        self._mujoco.mj_resetData(self._model, self._data)
        self._mujoco.mj_setState(self._model, self._data, self._kept, self._all)
        self._mujoco.mj_kinematics(self._model, self._data)

    def thing(self, number: int) -> tuple[Array, Array]:
        body, data = self._named[number], self._data
        return data.xpos[body].copy(), data.xmat[body].reshape(3, 3).copy()

    def close(self) -> None:
        self.instances.clear()
        self._painter.close()
        del self._data, self._model, self._painter


class _Instance:
    """One body, by where its numbers are among those of all."""

    def __init__(
        self, mujoco: Any, model: Any, data: Any, prefix: str, painter: Painter
    ):
        self._mujoco, self._model, self._data = mujoco, model, data
        self.picture = painter.picture
        self._body = model.body(f"{prefix}base").id
        own = np.flatnonzero(model.body_rootid == self._body)
        joints = np.flatnonzero(np.isin(model.jnt_bodyid, own))
        self._geoms = _run(np.flatnonzero(np.isin(model.geom_bodyid, own)))
        self._free = bool(model.body_dofnum[self._body])
        self._dofs = _run(np.flatnonzero(np.isin(model.dof_bodyid, own)))
        places = model.jnt_qposadr[joints]
        self._places = slice(0, 0)
        if len(joints):  # a hinge or a slide has one number, a free joint seven
            last = int(places[-1]) + (7 if self._free and len(joints) == 1 else 1)
            self._places = slice(int(places[0]), last)
        driven = model.actuator_trnid[:, 0]
        self._motors = _run(np.flatnonzero(np.isin(driven, joints)))
        first, speed = (7, 6) if self._free else (0, 0)
        self._joints = slice(self._places.start + first, self._places.stop)
        self._speeds = slice(self._dofs.start + speed, self._dofs.stop)
        # Parts of MuJoCo's own arrays: finding them anew takes longer than using them.
        self._pose = data.xpos[self._body], data.xmat[self._body].reshape(3, 3)
        self._turning = data.qvel[self._dofs][3:6]
        self._told = data.ctrl[self._motors]
        self._groups = model.geom_group[self._geoms]
        self._shown = self._groups.copy()
        self._seen = np.ones(6, np.uint8)
        self._seen[UNSEEN] = 0
        self._hit = np.zeros(1, np.int32)
        self._kept: list[Array] = []

    def command(self, targets: Sequence[float]) -> None:
        self._told[:] = targets

    def pose(self) -> tuple[Array, Array]:
        return self._pose

    def joints(self) -> tuple[list[float], list[float]]:
        positions = self._data.qpos[self._joints]
        return positions.tolist(), self._data.qvel[self._speeds].tolist()

    def bend(self, positions: Sequence[float]) -> None:
        self._data.qpos[self._joints] = positions
        self._data.qvel[self._dofs] = 0.0

    def velocity(self) -> Array:
        return self._data.qvel[self._dofs][:3] if self._free else np.zeros(3)

    def spin(self) -> Array:
        if not self._free:
            return np.zeros(3)
        # A free joint's angular velocity is told in the body's own frame.
        spin: Array = self._pose[1].dot(self._turning)
        return spin

    def move(self, shift: Sequence[float], yaw: float) -> None:
        data, model, first = self._data, self._model, self._places.start
        if self._free:
            place, turn = data.qpos[first : first + 3], data.qpos[first + 3 : first + 7]
        else:
            place, turn = model.body_pos[self._body], model.body_quat[self._body]
        place += shift
        turned = np.zeros(4)
        half = np.array([cos(yaw / 2), 0.0, 0.0, sin(yaw / 2)])
        self._mujoco.mju_mulQuat(turned, half, turn.copy())
        turn[:] = turned
        data.qvel[self._dofs] = 0.0

    def ray(self, start: Array, direction: Array, reach: float) -> float:
        found = self._cast(start, direction)
        own = self._geoms
        if own.start <= self._hit[0] < own.stop:  # a link, which is another body
            self._groups[:] = UNSEEN
            found = self._cast(start, direction)
            self._groups[:] = self._shown
        return reach if found < 0 else min(float(found), reach)

    def _cast(self, start: Array, direction: Array) -> float:
        """How far the nearest geom is, but those of the base; less than 0 for none."""
        base = self._body
        found: float = self._mujoco.mj_ray(
            self._model, self._data, start, direction, self._seen, 1, base, self._hit
        )
        return found

    def _numbers(self) -> list[Array]:
        data = self._data
        return [
            data.qpos[self._places],
            data.qvel[self._dofs],
            data.qacc_warmstart[self._dofs],
            data.ctrl[self._motors],
        ]

    def keep(self) -> None:
        self._kept = [numbers.copy() for numbers in self._numbers()]

    def restore(self) -> None:
        for numbers, kept in zip(self._numbers(), self._kept, strict=True):
            numbers[:] = kept
        self._mujoco.mj_kinematics(self._model, self._data)


def _counted(warning: str) -> None:
    """Leave it at what MuJoCo counts: `advance` looks at that."""


def _run(numbers: Any) -> slice:
    """Numbers that follow one another, as a slice: it leads to themselves."""
    return slice(int(numbers[0]), int(numbers[-1]) + 1) if len(numbers) else slice(0, 0)
