"""Robots' files as users have them, with what is usual and awkward in such files."""

import struct
from pathlib import Path
from typing import Any

from rems_net.agents.ports import In, Out
from rems_net.agents.robot import Definition
from rems_net.bodies.body import Driven, Encoder, Model, Ray, Servo, Tachometer
from rems_net.defdict import DefDict, Schema, angle, angular_velocity, length, ratio
from rems_net.kinematics.servo import toward
from rems_net.maths import sincos

#: Two hinges that are not along any axis, frames that are fixed and turned, a link
#: without a mass at the end, a mesh in a package, inertias told in turned frames.
ARM = """<?xml version="1.0"?>
<robot name="arm">
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
  <link name="foot"/>
  <link name="base">
    <inertial><origin xyz="0 0 0.05"/><mass value="1"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><mesh filename="package://arm/meshes/base.dae"/></geometry></visual>
    <collision><origin xyz="0 0 0.05"/>
      <geometry><box size="0.1 0.1 0.1"/></geometry></collision>
  </link>
  <joint name="bolts" type="fixed"><parent link="foot"/><child link="base"/>
    <origin xyz="0 0 0.01" rpy="0 0 0.3"/></joint>
  <link name="upper">
    <inertial><origin xyz="0 0.02 0.1" rpy="0.3 0.1 0"/><mass value="0.5"/>
      <inertia ixx="0.003" iyy="0.002" izz="0.0015" ixy="0.0002" ixz="0" iyz="0.0001"/>
    </inertial>
    <collision><origin xyz="0 0 0.1" rpy="0 0.2 0"/>
      <geometry><cylinder radius="0.02" length="0.2"/></geometry></collision>
  </link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.12" rpy="0.1 0 0.2"/><axis xyz="0 2 0"/>
    <limit lower="-1.2" upper="1.5" effort="20" velocity="2"/>
    <dynamics damping="0.1" friction="0.01"/></joint>
  <link name="plate">
    <inertial><origin xyz="0.03 0 0"/><mass value="0.2"/>
      <inertia ixx="0.0004" iyy="0.0003" izz="0.0005" ixy="1e-5" ixz="0" iyz="5e-5"/>
    </inertial>
    <collision><geometry><mesh filename="package://arm/meshes/cube.stl"
      scale="0.02 0.02 0.02"/></geometry></collision>
  </link>
  <joint name="glue" type="fixed"><parent link="upper"/><child link="plate"/>
    <origin xyz="0 0 0.2" rpy="0.4 0.5 0.6"/></joint>
  <link name="hand">
    <inertial><origin xyz="0 0 0.05"/><mass value="0.1"/>
      <inertia ixx="0.0002" iyy="0.0002" izz="0.0001" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <collision><origin xyz="0 0 0.05"/>
      <geometry><sphere radius="0.03"/></geometry></collision>
  </link>
  <joint name="elbow" type="continuous"><parent link="plate"/><child link="hand"/>
    <origin xyz="0 0 0.02"/><axis xyz="1 0 0"/><limit effort="5" velocity="3"/></joint>
  <joint name="left" type="prismatic"><parent link="hand"/><child link="thumb"/>
    <origin xyz="0 0.02 0.08"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.05" effort="10" velocity="0.2"/></joint>
  <link name="thumb">
    <inertial><mass value="0.02"/>
      <inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="right" type="prismatic"><parent link="hand"/><child link="finger"/>
    <origin xyz="0 -0.02 0.08"/><axis xyz="0 1 0"/>
    <limit lower="-0.05" upper="0" effort="10" velocity="0.2"/>
    <mimic joint="left" multiplier="-1"/></joint>
  <link name="finger">
    <inertial><mass value="0.02"/>
      <inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="tool"/>
  <joint name="tip" type="fixed"><parent link="hand"/><child link="tool"/>
    <origin xyz="0 0 0.1"/></joint>
</robot>
"""
#: Degrees, defaults, a floor, a light, motors, a sensor, a key: and an arm.
LIMB = """<mujoco model="limb">
  <compiler angle="degree"/><size memory="9M"/><visual><map zfar="30"/></visual>
  <default><joint damping="0.2" armature="0.01"/><geom friction="0.8"/></default>
  <worldbody>
    <light pos="0 0 1"/>
    <geom name="floor" type="plane" size="0 0 1"/>
    <body name="foot" pos="0.3 0 0.1">
      <geom type="box" size="0.05 0.05 0.05" pos="0 0 -0.05"/>
      <body name="upper">
        <joint name="shoulder" axis="0 1 0" range="-60 90"/>
        <geom type="capsule" size="0.02" fromto="0 0 0 0 0 0.3"/>
        <geom type="sphere" size="0.1" contype="0" conaffinity="0" mass="0"/>
        <body name="hand" pos="0 0 0.3">
          <joint name="elbow" axis="1 0 0"/>
          <geom type="cylinder" size="0.03 0.02" pos="0 0 0.05"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor joint="shoulder" gear="10" ctrlrange="-2 2"/>
    <position joint="elbow" kp="5" forcerange="-5 5"/>
  </actuator>
  <sensor><jointpos joint="shoulder"/></sensor>
  <keyframe><key qpos="0.1 0.2"/></keyframe>
</mujoco>
"""
_WHEEL = """
  <link name="{side}">
    <inertial><mass value="0.1"/>
      <inertia ixx="4e-5" iyy="8e-5" izz="4e-5" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin rpy="1.5707963267948966 0 0"/>
      <geometry><cylinder radius="0.04" length="0.02"/></geometry></collision>
  </link>
  <joint name="{side}" type="continuous"><parent link="chassis"/><child link="{side}"/>
    <origin xyz="0 {y} -0.01"/><axis xyz="0 1 0"/>
    <limit effort="1" velocity="20"/></joint>
"""
#: Two wheels, and a caster that slides; its root is a frame on the floor's level.
CART = f"""<robot name="cart">
  <link name="base_footprint"/>
  <joint name="up" type="fixed"><parent link="base_footprint"/><child link="chassis"/>
    <origin xyz="0 0 0.05"/></joint>
  <link name="chassis">
    <inertial><origin xyz="-0.03 0 0"/><mass value="1"/>
      <inertia ixx="0.002" iyy="0.002" izz="0.003" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><box size="0.16 0.12 0.04"/></geometry></collision>
  </link>
  <joint name="swivel" type="fixed"><parent link="chassis"/><child link="caster"/>
    <origin xyz="-0.06 0 -0.03"/></joint>
  <link name="caster">
    <collision><geometry><sphere radius="0.02"/></geometry></collision>
  </link>{_WHEEL.format(side="left", y=0.08)}{_WHEEL.format(side="right", y=-0.08)}
</robot>
"""


def cube() -> bytes:
    """A cube of 1 m about its middle, as STL."""
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1)]
    faces += [(2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [(f[0], f[i], f[i + 1]) for f in faces for i in (1, 2)]
    data = bytes(80) + struct.pack("<I", len(triangles))
    for triangle in triangles:
        points = [one for corner in triangle for one in corners[corner]]
        data += struct.pack("<12fH", 0, 0, 0, *points, 0)
    return data


def arm(folder: Path, text: str = ARM) -> Path:
    """The arm's file, in a package as ROS has them."""
    file = folder / "arm" / "urdf" / "arm.urdf"
    file.parent.mkdir(parents=True)
    file.write_text(text, encoding="utf-8")
    meshes = folder / "arm" / "meshes"
    meshes.mkdir()
    (meshes / "cube.stl").write_bytes(cube())
    return file


def written(folder: Path, name: str, text: str) -> Path:
    """A file with this text."""
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


TURN = Servo(gain=20.0, speed=1.5, share="share")
SHOULDER = Driven("shoulder", 0.1, armature=0.02, servo=TURN, position="shoulder")
ELBOW = Driven("elbow", 0.1, armature=0.02, servo=TURN, position="elbow")
GRIP = Driven(
    "left",
    0.02,
    command="grip",
    servo=Servo(gain=20.0, speed=0.1, share="share"),
    position="grip",
)


class Limb(Definition):
    """A shoulder and an elbow, whatever file they are in."""

    tolerance = 0.02
    file: Path
    more: dict[str, Any]

    command = In(
        Schema(
            "limb.command",
            {
                "shoulder": angle(range=(-1, 1.5)),
                "elbow": angle(range=(-2, 2)),
                "share": ratio(range=(0, 1)),
            },
        )
    )
    state = Out(Schema("limb.state", {"shoulder": angle(), "elbow": angle()}))
    sensors = Out(Schema("limb.sensors", {"at": angle(), "speed": angular_velocity()}))

    def advance(self, state: DefDict, command: DefDict, dt: float) -> dict[str, Any]:
        most = command["share"] * TURN.speed * dt
        return {
            path: toward(state[path], command[path], most)
            for path in ("shoulder", "elbow")
        }

    def body(self) -> Model:
        sensors = Encoder("at", "elbow"), Tachometer("speed", "elbow")
        joints = SHOULDER, ELBOW
        return Model(self.file, joints, sensors, fixed=True, **self.more)


class Cart(Definition):
    """Two wheels, told how fast to turn; a ray ahead."""

    tolerance = 0.12  # on wheels as wide as these, Bullet turns less than it should

    file: Path

    command = In(
        Schema(
            "cart.command",
            {
                "left": angular_velocity(range=(-10, 10)),
                "right": angular_velocity(range=(-10, 10)),
            },
        )
    )
    state = Out(
        Schema("cart.state", {"x": length(), "y": length(), "heading": angle()})
    )
    sensors = Out(Schema("cart.sensors", {"ahead": length()}))

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        s, c = sincos(state["heading"])
        speed = 0.04 * (command["left"] + command["right"]) / 2
        turn = 0.04 * (command["right"] - command["left"]) / 0.16
        return {"x": speed * c, "y": speed * s, "heading": turn}

    def measure(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        return {"ahead": 2.0}

    def body(self) -> Model:
        wheels = (Driven("left", 0.5), Driven("right", 0.5))
        ray = Ray("ahead", (0.0, 0.0, 0.05), (1.0, 0.0, 0.0), 2.0)
        return Model(self.file, wheels, (ray,), friction={"caster": 0.0})


def made(kind: type[Definition], file: Path, **more: Any) -> type[Definition]:
    """The definition with this file, and this said of its Model besides."""
    return type(kind.__name__, (kind,), {"file": file, "more": more})
