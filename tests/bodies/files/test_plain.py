"""An MJCF in PyBullet is the robot that MuJoCo has, or is refused by what it uses."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rems_net.bodies.files.built import built
from rems_net.bodies.model import Driven, Model
from rems_net.drivers.physics.files.load import ROBOT, load_file
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pybullet import Pybullet
from rems_net.errors import SchemaError
from rems_net.libraries import load
from rems_net.testing import check_robot
from tests.bodies.files.robots import LIMB, Cart, Limb, cube, made, written
from tests.drivers.physics.test_physics import needs
from tests.robots.moving import obey, running

pytestmark = [needs("mujoco"), needs("pybullet")]

WHEEL = """<body name="{side}" pos="0 {y} -0.01"><joint name="{side}" axis="0 1 0"/>
  <geom type="cylinder" size="0.04 0.01" zaxis="0 1 0" mass="0.1"
  friction="0.5"/></body>"""
#: The cart of `robots.CART`: its caster slips, its wheels grip.
CART = f"""<mujoco><worldbody><body name="chassis" pos="0 0 0.05"><freejoint/>
  <inertial pos="-0.03 0 0" mass="1" diaginertia="0.002 0.002 0.003"/>
  <geom type="box" size="0.08 0.06 0.02"/>
  <geom name="caster" type="sphere" size="0.02" pos="-0.06 0 -0.03" friction="0"/>
  {WHEEL.format(side="left", y=0.08)}{WHEEL.format(side="right", y=-0.08)}
</body></worldbody></mujoco>"""
#: A body turned, a mesh that is off its centre, a part fixed to another, a slide.
TURNED = """<mujoco><asset><mesh name="cube" file="cube.stl" scale="0.1 0.2 0.05"
    refpos="0.3 0 0"/></asset><worldbody><body name="foot" quat="0.9 0.1 0.3 0.2">
  <geom type="box" size="0.05 0.05 0.05"/>
  <body name="upper" pos="0.1 0 0.2" euler="30 10 40">
    <joint name="shoulder" axis="1 2 0" pos="0 0 0.02" range="-60 90" armature="0.01"/>
    <geom type="mesh" mesh="cube"/>
    <body name="plate" pos="0 0.1 0" euler="0 50 0">
      <geom type="capsule" size="0.03 0.1" friction="0.3"/></body>
    <body name="hand" pos="0 0 0.3"><joint name="elbow" type="slide" axis="0 1 1"
      range="-0.1 0.2" damping="2"/><geom type="cylinder" size="0.03 0.02"/></body>
  </body></body></worldbody></mujoco>"""


class MjcfCart(Cart):
    """The cart, with the friction that its file states."""

    def body(self) -> Model:
        wheels = (Driven("left", 0.5, 1.0), Driven("right", 0.5, 1.0))
        return Model(self.file, wheels, super().body().sensors)


def rays() -> tuple[list[Any], list[Any]]:
    """1 m long rays through the arm along the axes: their starts and their ends."""
    middles = [(0.05 * i, 0.07 * j, 0.06 * k) for i, j, k in np.ndindex(6, 3, 10)]
    ways = [(0.5, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, -0.5)]
    both = [(np.array(m), np.array(way)) for m in middles for way in ways]
    return [m - way for m, way in both], [m + way for m, way in both]


def test_an_arm_is_a_robot(tmp_path: Path) -> None:
    check_robot(made(Limb, written(tmp_path, "limb.xml", LIMB)), Pybullet, alone=True)


def test_masses_and_inertias_are_mujocos(tmp_path: Path) -> None:
    mujoco, bullet = load("mujoco", "mujoco"), load("pybullet", "pybullet")
    (tmp_path / "cube.stl").write_bytes(cube())
    file = written(tmp_path, "turned.xml", TURNED)
    body = built(Model(file, fixed=True), ("pybullet",))
    assert body.source is not None
    assert body.source.grips["upper, friction 0.3"] == 0.3
    client = bullet.connect(bullet.DIRECT)
    try:

        def call(name: str, *args: Any, **more: Any) -> Any:
            return getattr(bullet, name)(*args, **more, physicsClientId=client)

        robot, moved = load_file(bullet, call, body, body.source)
        bent, speeds = [0.4, 0.1], [0.7, -0.3]
        found = np.array(call("calculateMassMatrix", robot, bent))
        call("setGravity", 0, 0, -9.81)
        # Gravity, and what the speeds ask of the motors.
        needed = call("calculateInverseDynamics", robot, bent, speeds, [0.0, 0.0])
        for number, angle in zip(moved, bent, strict=True):
            call("resetJointState", robot, number, angle)
        call("performCollisionDetection")
        hits = call("rayTestBatch", *rays(), collisionFilterMask=ROBOT)
    finally:
        bullet.disconnect(client)
    model = mujoco.MjModel.from_xml_path(str(file))
    data, expected = mujoco.MjData(model), np.zeros((2, 2))
    data.qpos[:], data.qvel[:] = bent, speeds
    mujoco.mj_forward(model, data)
    for column, unit in enumerate(np.eye(2)):
        mujoco.mj_mulM(model, data, expected[column], unit)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-8)
    np.testing.assert_allclose(needed, data.qfrc_bias, rtol=1e-4, atol=1e-6)
    # Shapes are where MuJoCo has them. Bullet gives them a margin, which a ray that
    # grazes them sees several times.
    none = np.zeros(1, np.int32)
    met = [
        mujoco.mj_ray(model, data, start, end - start, None, 1, -1, none)
        for start, end in zip(*rays(), strict=True)
    ]
    shares = [1.0 if one < 0 else min(one, 1.0) for one in met]
    assert sum(share < 1.0 for share in shares) > 20
    np.testing.assert_allclose([hit[2] for hit in hits], shares, atol=0.01)


def test_a_cart_drives_as_in_mujoco(tmp_path: Path) -> None:
    """1 s at 0.2 m/s, then a turn: within 1 cm and 0.12 rad, as `Cart` says."""
    kind = made(MjcfCart, written(tmp_path, "cart.xml", CART))
    ends = []
    for driver in (Mujoco, Pybullet):
        with running(kind, driver) as robot:
            for left, right in [(5.0, 5.0)] * 20 + [(-2.0, 2.0)] * 20:
                obey(robot, {"left": left, "right": right})
            ends.append([robot.state[path] for path in ("x", "y", "heading")])
    assert ends[0] == pytest.approx([0.195, 0.0, 0.95], abs=0.05)
    assert ends[1] == pytest.approx(ends[0], abs=0.12)
    assert ends[1][:2] == pytest.approx(ends[0][:2], abs=0.01)


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        (
            "</worldbody>",
            '</worldbody><tendon><fixed name="cord"><joint joint="elbow" coef="1"/>'
            "</fixed></tendon>",
            "the tendon 'cord'",
        ),
        (
            "</worldbody>",
            '</worldbody><equality><joint name="tied" joint1="elbow" '
            'joint2="shoulder"/></equality>',
            r"the equality 'tied' \(joint\)",
        ),
        (
            'name="elbow"',
            'name="elbow" stiffness="3"',
            "the spring .* of joint 'elbow'",
        ),
        ('name="hand"', 'name="hand" gravcomp="1"', "the gravcomp of body 'hand'"),
        ('"cylinder" size="0.03 0.02"', '"ellipsoid" size="1 2 3"', "the ellipsoid"),
        ('"cylinder"', '"cylinder" name="tip" condim="6"', "condim 6 of geom tip"),
        (
            '<joint name="elbow" axis="1 0 0"/>',
            '<joint name="elbow"/><joint name="twist" axis="1 0 0"/>',
            "a body with several joints",
        ),
    ],
)
def test_what_a_urdf_cannot_express_is_named(
    old: str, new: str, what: str, tmp_path: Path
) -> None:
    file = written(tmp_path, "limb.xml", LIMB.replace(old, new))
    kind = made(Limb, file)
    said = (
        rf"limb.xml cannot run in PyBullet, .* cannot express {what}.* driver mujoco\."
    )
    with pytest.raises(SchemaError, match=said), running(kind, Pybullet):
        pass
    built(Model(file, fixed=True))  # MuJoCo runs it
