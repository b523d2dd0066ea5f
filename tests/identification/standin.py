"""A stand-in for hardware, of its own: a robot in MuJoCo that no definition describes.

Its motors answer 60 ms late, with a lag of 90 ms that MuJoCo's own filter has; friction
in the gears makes a dead band, and the right motor is weak. Nothing here is shared with
the project's drivers.
"""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rems_net.identification.drive import Drive

mujoco: Any = pytest.importorskip("mujoco")

#: s. Step of the physics, time between two rows, and the motors' delay and lag.
STEP, ROW, DELAY, LAG = 0.001, 0.05, 0.06, 0.09
#: rad/s. Full speed, of which a command is a share.
TOP = 7.0
#: N m s, share of full speed, share of the left motor's speed.
GRIP, BAND, WEAK = 0.02, 0.05, 0.93

MODEL = f"""
<mujoco>
  <option timestep="{STEP}" integrator="implicitfast" cone="elliptic" impratio="10"/>
  <default>
    <joint armature="2e-5" frictionloss="{GRIP * BAND * TOP}"/>
    <geom friction="0.9 0.001 0.00001"/>
    <general dyntype="filter" dynprm="{LAG}" biastype="affine"
             biasprm="0 0 -{GRIP}"/>
  </default>
  <worldbody>
    <geom type="plane" size="5 5 0.1"/>
    <body pos="0 0 0.0196">
      <freejoint/>
      <geom type="box" size="0.045 0.035 0.005" pos="-0.02 0 0" mass="0.1"/>
      <geom type="sphere" size="0.004" pos="-0.07 0 -0.0156" mass="0.002"
            friction="0.01 0 0"/>
      <body pos="0 0.0535 0">
        <joint name="left" axis="0 1 0"/>
        <geom type="cylinder" size="0.0196 0.0015" euler="90 0 0" mass="0.003"/>
      </body>
      <body pos="0 -0.0535 0">
        <joint name="right" axis="0 1 0"/>
        <geom type="cylinder" size="0.0196 0.0015" euler="90 0 0" mass="0.003"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <general joint="left" gainprm="{GRIP}"/>
    <general joint="right" gainprm="{GRIP * WEAK}"/>
  </actuator>
</mujoco>
"""


def run(seed: int, seconds: float = 10.0) -> Drive:
    """Return a drive as of a person with keys, with the robot's own seed."""
    random = np.random.default_rng(seed)
    rows = round(seconds / ROW)
    shares = np.array([_pressed(random, rows), _pressed(random, rows)])
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 300)  # it comes to rest on its wheels
    late = deque([np.zeros(2)] * round(DELAY / STEP))
    read, told = [_pose(data, 0.0)], [np.zeros(2)]
    for share in shares.T:
        for _ in range(round(ROW / STEP)):
            late.append(share * TOP)
            data.ctrl[:] = late.popleft()
            mujoco.mj_step(model, data)
        read.append(_pose(data, read[-1][2]))
        told.append(share)
    pose, commands = np.array(read).T, np.array(told).T
    return Drive(
        f"run {seed}",
        ROW * np.arange(rows + 1, dtype=np.float64),
        dict(zip(("wheel/left", "wheel/right"), commands, strict=True)),
        dict(zip(("x", "y", "heading"), pose, strict=True)),
    )


def _pressed(random: np.random.Generator, rows: int) -> NDArray[np.float64]:
    """Return shares of full speed, each held for 0.3 to 1.2 s."""
    pressed: list[float] = []
    while len(pressed) < rows:
        share = float(random.choice([-1.0, -0.6, -0.3, 0.0, 0.3, 0.6, 1.0]))
        pressed += [share] * int(random.integers(6, 25))
    return np.array(pressed[:rows])


def _pose(data: Any, before: float) -> tuple[float, float, float]:
    """Return x, y and the heading, which goes on past a full turn."""
    w, x, y, z = data.qpos[3:7]
    heading = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    turned = (heading - before + np.pi) % (2 * np.pi) - np.pi
    return float(data.qpos[0]), float(data.qpos[1]), float(before + turned)
