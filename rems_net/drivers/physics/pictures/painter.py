"""Painter: draws cameras' pictures of a MuJoCo world, without a window."""

import os
import sys
import warnings
from collections.abc import Sequence
from functools import lru_cache
from importlib import import_module
from threading import get_ident
from typing import Any

import numpy as np

from rems_net.bodies.parts import Array
from rems_net.bodies.sensors import Camera
from rems_net.drivers.physics.engine import Picture
from rems_net.drivers.physics.pictures.looks import FAR, NEAR
from rems_net.drivers.physics.pictures.optics import ideal
from rems_net.drivers.physics.pictures.signs import Sign
from rems_net.errors import MissingPartError
from rems_net.libraries import load, look_for

#: for the message if MuJoCo cannot draw: on Linux, and elsewhere
APT, OTHER = "Type: sudo apt install libegl1 libopengl0", "It draws by OpenGL"
#: space for decorations besides the model's own geoms and markers; none is drawn here
ROOM = 100


class Painter:
    """Renderer; OpenGL wants all pictures drawn in the thread of the first one.

    cameras: of all bodies in the world      signs: its markers
    depths: m. Things nearer or further away than these are not drawn.
    """

    def __init__(
        self,
        mujoco: Any,
        model: Any,
        data: Any,
        cameras: Sequence[Camera],
        signs: Sequence[Sign] = (),
        depths: tuple[float, float] = (NEAR, FAR),
    ):
        self._mujoco, self._model, self._data = mujoco, model, data
        self._signs, (self._near, self._far) = signs, depths
        self._width = max((ideal(camera).width for camera in cameras), default=1)
        self._height = max((ideal(camera).height for camera in cameras), default=1)
        self._gl: Any = None
        self._context: Any = None

    def _open(self) -> None:
        mujoco, model = self._mujoco, self._model
        model.vis.global_.offwidth = self._width
        model.vis.global_.offheight = self._height
        model.vis.map.zfar = (
            self._far / model.stat.extent
        )  # also how far floors are drawn
        self._thread = get_ident()
        self._gl = _backend(mujoco)(self._width, self._height)
        self._gl.make_current()
        small = mujoco.mjtFontScale.mjFONTSCALE_50
        self._context = mujoco.MjrContext(model, small.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        most = model.ngeom + len(self._signs) + ROOM
        self._scene = mujoco.MjvScene(model, maxgeom=most)
        self._options, self._view = mujoco.MjvOption(), mujoco.MjvCamera()

    def picture(self, camera: Camera, eye: Array, ahead: Array, up: Array) -> Picture:
        """Return the camera's picture from `eye`, looking along `ahead`."""
        if self._context is None:
            self._open()
        if get_ident() != self._thread:
            raise RuntimeError(
                "OpenGL draws in one thread only: step a robot with a camera in the "
                "thread that opened it."
            )
        mujoco, model, data = self._mujoco, self._model, self._data
        mujoco.mj_camlight(model, data)  # a step moves bodies, but not their lights
        every = mujoco.mjtCatBit.mjCAT_ALL.value
        # MuJoCo draws an endless floor about the last view point, so aim before the
        # update; the update then moves the camera, so aim again.
        self._aim(camera, eye, ahead, up)
        mujoco.mjv_updateScene(
            model, data, self._options, None, self._view, every, self._scene
        )
        self._aim(camera, eye, ahead, up)
        for sign in self._signs:
            sign.show(mujoco, data, self._scene)
        self._gl.make_current()
        area = mujoco.MjrRect(0, 0, camera.width, camera.height)
        mujoco.mjr_render(area, self._scene, self._context)
        drawn = np.empty(camera.shape, np.uint8)
        mujoco.mjr_readPixels(drawn, None, area, self._context)
        return drawn[::-1]  # OpenGL's first row is the lowest

    def _aim(self, camera: Camera, eye: Array, ahead: Array, up: Array) -> None:
        left, right, bottom, top = (self._near * slope for slope in camera.edges)
        for one in self._scene.camera:  # two: one for each eye of a stereo view
            one.pos, one.forward, one.up = eye, ahead, up
            one.frustum_near, one.frustum_far = self._near, self._far
            one.frustum_center = (left + right) / 2
            one.frustum_width = (right - left) / 2
            one.frustum_bottom, one.frustum_top = bottom, top

    def close(self) -> None:
        """Release OpenGL's context."""
        gl, context = self._gl, self._context
        self._gl = self._context = None
        if gl is not None:
            gl.make_current()
            if context is not None:
                context.free()
            gl.free()


def _backend(mujoco: Any) -> Any:
    """Return the class of contexts that draw without a window."""
    if sys.platform == "linux" and not os.environ.get("MUJOCO_GL"):
        # MuJoCo's own choice needs a display; a server has none.
        return import_module("mujoco.egl").GLContext
    return mujoco.GLContext


@lru_cache(maxsize=1)
def look_for_renderer(
    what: str = "A camera",
    other: str = "Or give the robot the driver pybullet, which draws by itself.",
) -> None:
    """Raise MissingPartError if MuJoCo cannot draw, after trying it.

    what: needs a renderer.  other: sentence on what the user can do without one.
    """
    look_for("mujoco", "mujoco")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")  # GLFW's reasons are warnings
        try:
            _draw_something()
        except Exception as error:  # OpenGL's libraries have errors of any kind
            first = said[0].message if said else error
            raise _blind(what, str(first) or repr(first), other) from error


def _draw_something() -> None:
    mujoco = load("mujoco", "mujoco")
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    camera = Camera("trial", (0, 0, 0), (1, 0, 0), 1, 1, 1.0)
    painter = Painter(mujoco, model, mujoco.MjData(model), [camera])
    painter.picture(camera, *np.eye(3))
    painter.close()


def _blind(what: str, why: str, other: str) -> MissingPartError:
    chosen = os.environ.get("MUJOCO_GL")
    hint = APT if sys.platform == "linux" else OTHER
    if chosen:
        hint = f"MUJOCO_GL is {chosen!r}; try without it"
    return MissingPartError(
        f"{what} needs a renderer, and MuJoCo finds none here "
        f"({why.strip().splitlines()[0].rstrip('.')}). {hint}. {other} (R0302)"
    )
