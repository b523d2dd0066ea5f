"""Mujoco: driver that runs a robot in the MuJoCo physics engine."""

from collections.abc import Sequence
from itertools import chain
from typing import Any

import numpy as np

from rems_net.bodies.body import Array, Body
from rems_net.bodies.files.mjcf import check
from rems_net.drivers.physics.engine import AWAY, Aim
from rems_net.drivers.physics.mjcf import WORLD
from rems_net.drivers.physics.physics import Physics
from rems_net.drivers.physics.pictures.looks import cameras
from rems_net.drivers.physics.pictures.painter import Painter, look_for_renderer
from rems_net.drivers.physics.pictures.signs import signs
from rems_net.drivers.physics.scenery import ROBOTS, compiled, names
from rems_net.drivers.physics.world import PhysicsWorld
from rems_net.libraries import load
from rems_net.maths import cos, sin
from rems_net.scenes.ghost import Ghost
from rems_net.scenes.scene import Scene

#: Group for the geoms of a robot while it sends a ray, which must not meet them.
UNSEEN = 5


class Mujoco(Physics):
    """Driver that runs the definition's body in MuJoCo.

    A motor gives torque / droop for every rad/s that the wheel is short of the command,
    up to `torque`. A contact's friction is the part's own; of two parts that may move,
    the larger one.
    """

    needs = ("mujoco",)

    def build(self, bodies: Sequence[Body], scene: Scene) -> "_Engine":
        """Translate the bodies and the scene into a MuJoCo model."""
        return _Engine(load("mujoco", "mujoco"), bodies, scene)

    def look_for_renderer(self) -> None:
        """Raise MissingPartError if MuJoCo cannot draw cameras' pictures here."""
        look_for_renderer()

    def prepare(self) -> None:
        """Check that MuJoCo accepts the body's file, if it has one."""
        super().prepare()
        source = self.member.body.source
        if source is not None and source.urdf:  # MuJoCo has read an MJCF already
            check(load("mujoco", "mujoco"), source)

    @classmethod
    def share(cls, robots: Sequence[Physics], scene: Scene) -> PhysicsWorld:
        """Return one world of the engine, with all these robots."""
        world = super().share(robots, scene)
        if scene.mjcf:  # raise an error in the user's file before anything starts
            bodies = [member.body for member in world.members]
            compiled(load("mujoco", "mujoco"), bodies, scene)
        return world


class _Engine:
    def __init__(self, mujoco: Any, bodies: Sequence[Body], scene: Scene):
        model = compiled(mujoco, bodies, scene)
        before = ROBOTS if scene.mjcf else ""
        seen = [*cameras(bodies)]
        signed = signs(model, bodies, scene, before) if seen else []
        self._mujoco, self._model = mujoco, model
        # Otherwise MuJoCo writes to the terminal, and to a file in the user's folder.
        mujoco.set_mju_user_warning(_counted)
        self._data = mujoco.MjData(model)
        # Counts of warnings; the first kind, a singular inertia, is harmless.
        self._warned = self._data.warning.number[1:]
        self._all = mujoco.mjtState.mjSTATE_INTEGRATION
        self._kept = np.empty(mujoco.mj_stateSize(model, self._all))
        mujoco.mj_forward(model, self._data)
        self._named = [model.body(name).id for name in names(scene)]
        ghosts = (f"{before}ghost/{number}" for number in range(len(scene.ghosts)))
        self._ghosts = [model.body(name).id for name in ghosts]
        self._painter = Painter(mujoco, model, self._data, seen, signed)
        self.instances = [
            _Instance(mujoco, model, self._data, f"{before}{number}/", self._painter)
            for number in range(len(bodies))
        ]
        # Views of MuJoCo's own arrays: looking them up takes longer than using them.
        self._xpos, self._xmat = self._data.xpos, self._data.xmat.reshape(-1, 3, 3)
        self._qvel, self._ctrl = self._data.qvel, self._data.ctrl
        self._bodies = _places([one.body for one in self.instances])
        #: the bodies' poses: views, unless other bodies are between them
        self._poses = self._xpos[self._bodies], self._xmat[self._bodies]
        self._viewed = isinstance(self._bodies, slice)
        self._motors = _places([n for one in self.instances for n in np.r_[one.motors]])
        #: each body's base and its links' geoms: its rays must not meet them
        self._own = [(one.body, one.geoms) for one in self.instances]
        self._seen = np.ones(6, np.uint8)
        self._seen[UNSEEN] = 0
        self._free = np.flatnonzero([one.free for one in self.instances])
        first = [self.instances[n].dofs.start for n in self._free]
        self._turning = _places([dof + axis for dof in first for axis in (3, 4, 5)])
        #: whether there is one body, which is not bolted down
        self._alone = len(self._free) == len(self.instances) == 1
        self._spins = np.zeros((len(self.instances), 3))
        if self._alone:
            self._spins = self._qvel[self._turning].reshape(1, 3)  # a view
        self._hit = np.zeros(1, np.int32)
        #: arguments of `mj_ray`, reach, body and geoms of the body, for each ray
        self._rays: list[tuple[tuple[Any, ...], float, int, range]] = []
        #: s. The engine's present step.
        self._step = 0.0

    def command(self, targets: Sequence[Sequence[float]]) -> None:
        self._ctrl[self._motors] = [*chain.from_iterable(targets)]

    def advance(self, h: float, count: int) -> None:
        if h != self._step:  # setting it takes as long as half a step
            self._model.opt.timestep = self._step = h
        self._mujoco.mj_step(self._model, self._data, count)
        if any(self._warned.tolist()):
            self._give_up()
        # Bodies' positions and rotations are one step old until this call.
        self._mujoco.mj_kinematics(self._model, self._data)

    def _give_up(self) -> None:
        """Raise an error; MuJoCo would only reset the world, or ignore contacts."""
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

    def poses(self) -> tuple[Array, Array]:
        if not self._viewed:
            self._poses[0][:] = self._xpos[self._bodies]
            self._poses[1][:] = self._xmat[self._bodies]
        return self._poses

    def spins(self) -> Array:
        # MuJoCo has a free joint's angular velocity in the body's own frame.
        if not self._alone:
            self._spins[self._free] = self._qvel[self._turning].reshape(-1, 3)
        return self._spins

    def aim(self, rays: Sequence[Aim]) -> None:
        self._rays = []
        for n, (start, way), reach in rays:
            base, own = self._own[n]
            ray = self._model, self._data, start, way, self._seen, 1, base, self._hit
            self._rays.append((ray, reach, n, own))

    def rays(self) -> list[float]:
        hit, cast, found = self._hit, self._mujoco.mj_ray, []
        for ray, reach, n, own in self._rays:
            distance: float = cast(*ray)  # less than 0 for none
            if hit.item() in own:  # a link, which is another body
                self.instances[n].hide()
                distance = cast(*ray)
                self.instances[n].show()
            found.append(reach if distance < 0 else min(distance, reach))
        return found

    def refresh(self) -> None:
        self._mujoco.mj_forward(self._model, self._data)

    def keep(self) -> None:
        self._mujoco.mj_getState(self._model, self._data, self._kept, self._all)
        for instance in self.instances:
            instance.keep()

    def restore(self) -> None:
        # MuJoCo's integration state is the whole state, and includes the accelerations
        # from which its solver starts; all else is computed from it, and begins at 0.
        self._mujoco.mj_resetData(self._model, self._data)
        self._mujoco.mj_setState(self._model, self._data, self._kept, self._all)
        for instance in self.instances:
            instance.stay()
        self._mujoco.mj_kinematics(self._model, self._data)

    def thing(self, number: int) -> tuple[Array, Array]:
        body, data = self._named[number], self._data
        return data.xpos[body].copy(), data.xmat[body].reshape(3, 3).copy()

    def haunt(self, number: int, ghost: Ghost) -> None:
        model, data, body = self._model, self._data, self._ghosts[number]
        here, mocap = ghost.pose is not None, model.body_mocapid[body]
        data.mocap_pos[mocap] = ghost.place[0] if here else AWAY
        half = ghost.heading / 2
        data.mocap_quat[mocap] = cos(half), 0.0, 0.0, sin(half)
        geoms = model.geom_bodyid == body
        model.geom_group[geoms] = WORLD if here else UNSEEN
        model.geom_contype[geoms] = 2 if ghost.touches else 0
        model.geom_conaffinity[geoms] = 1 if ghost.touches else 0
        self._mujoco.mj_kinematics(model, data)

    def look(self, number: int, start: Array, way: Array, reach: float) -> float:
        hit = np.zeros(1, np.int32)
        ray = start, way, self._seen, 1, self._ghosts[number], hit
        distance: float = self._mujoco.mj_ray(self._model, self._data, *ray)
        return reach if distance < 0 else distance

    def close(self) -> None:
        self.instances.clear()
        self._painter.close()
        del self._data, self._model, self._painter, self._xpos, self._xmat
        del self._qvel, self._ctrl, self._poses, self._spins, self._rays


class _Instance:
    """One body: the places of its values in MuJoCo's arrays."""

    def __init__(
        self, mujoco: Any, model: Any, data: Any, prefix: str, painter: Painter
    ):
        self._mujoco, self._model, self._data = mujoco, model, data
        self.picture = painter.picture
        self.body = int(model.body(f"{prefix}base").id)
        own = np.flatnonzero(model.body_rootid == self.body)
        joints = np.flatnonzero(np.isin(model.jnt_bodyid, own))
        geoms = _run(np.flatnonzero(np.isin(model.geom_bodyid, own)))
        self.geoms = range(geoms.start, geoms.stop)
        self.free = bool(model.body_dofnum[self.body])
        self.dofs = _run(np.flatnonzero(np.isin(model.dof_bodyid, own)))
        places = model.jnt_qposadr[joints]
        self._places = slice(0, 0)
        if len(joints):  # a hinge or a slide has one number, a free joint seven
            last = int(places[-1]) + (7 if self.free and len(joints) == 1 else 1)
            self._places = slice(int(places[0]), last)
        driven = model.actuator_trnid[:, 0]
        self.motors = _run(np.flatnonzero(np.isin(driven, joints)))
        first, speed = (7, 6) if self.free else (0, 0)
        self._joints = slice(self._places.start + first, self._places.stop)
        self._speeds = slice(self.dofs.start + speed, self.dofs.stop)
        self._groups = model.geom_group[geoms]
        self._shown = self._groups.copy()
        self._kept: list[Array] = []

    def joints(self) -> tuple[list[float], list[float]]:
        positions = self._data.qpos[self._joints]
        return positions.tolist(), self._data.qvel[self._speeds].tolist()

    def bend(self, positions: Sequence[float]) -> None:
        self._data.qpos[self._joints] = positions
        self._data.qvel[self.dofs] = 0.0

    def velocity(self) -> Array:
        return self._data.qvel[self.dofs][:3] if self.free else np.zeros(3)

    def move(self, shift: Sequence[float], yaw: float) -> None:
        data, model, first = self._data, self._model, self._places.start
        if self.free:
            place, turn = data.qpos[first : first + 3], data.qpos[first + 3 : first + 7]
        else:
            place, turn = model.body_pos[self.body], model.body_quat[self.body]
        place += shift
        turned = np.zeros(4)
        half = np.array([cos(yaw / 2), 0.0, 0.0, sin(yaw / 2)])
        self._mujoco.mju_mulQuat(turned, half, turn.copy())
        turn[:] = turned
        data.qvel[self.dofs] = 0.0

    def hide(self) -> None:
        """Hide the robot from rays."""
        self._groups[:] = UNSEEN

    def show(self) -> None:
        """Show the robot to rays again."""
        self._groups[:] = self._shown

    def _numbers(self) -> list[Array]:
        data = self._data
        return [
            data.qpos[self._places],
            data.qvel[self.dofs],
            data.qacc_warmstart[self.dofs],
            data.ctrl[self.motors],
        ]

    def keep(self) -> None:
        self._kept = [numbers.copy() for numbers in self._numbers()]
        model, body = self._model, self.body
        self._place = model.body_pos[body].copy(), model.body_quat[body].copy()

    def stay(self) -> None:
        """Put a body that is bolted down back to its kept place, in the model."""
        if not self.free:
            model, body = self._model, self.body
            model.body_pos[body], model.body_quat[body] = self._place

    def restore(self) -> None:
        for numbers, kept in zip(self._numbers(), self._kept, strict=True):
            numbers[:] = kept
        self._mujoco.mj_kinematics(self._model, self._data)


def _counted(warning: str) -> None:
    """Do nothing: MuJoCo counts its warnings, and `advance` checks the counts."""


def _run(numbers: Any) -> slice:
    """Return consecutive numbers as a slice, with which arrays are views."""
    return slice(int(numbers[0]), int(numbers[-1]) + 1) if len(numbers) else slice(0, 0)


def _places(numbers: Sequence[int]) -> Any:
    """Return numbers as a slice if they are consecutive: it is the quickest index."""
    found = np.array(numbers, int)
    return _run(found) if (np.diff(found) == 1).all() else found
