"""Meshes as users have them: an engine is given all that touches, or it is told."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rems_net.agents.ports import In, Out
from rems_net.agents.robot import Definition, Driver
from rems_net.bodies.body import Driven, Model
from rems_net.bodies.files.built import built
from rems_net.bodies.files.mjcf import check
from rems_net.defdict import Schema, angle, angular_velocity, length
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pybullet import Pybullet
from rems_net.errors import SchemaError
from rems_net.libraries import load
from tests.bodies.files.robots import ARM, arm, cube, written
from tests.drivers.physics.test_physics import needs
from tests.robots.moving import obey, running

_LINK = """<link name="{name}">
    <inertial><mass value="1"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><mesh filename="{name}/part.stl"/></geometry></collision>
  </link>"""
#: Two cubes whose lower faces are level, in files of one name.
CUBES = f"""<robot name="cubes">
  {_LINK.format(name="small")}
  {_LINK.format(name="large")}
  <joint name="axle" type="continuous"><parent link="small"/><child link="large"/>
    <origin xyz="0.4 0 0.05"/><axis xyz="1 0 0"/>
    <limit effort="5" velocity="3"/></joint>
</robot>
"""


class Cubes(Definition):
    """They lie on the floor."""

    file: Path
    command = In(
        Schema("cubes.command", {"axle": angular_velocity(range=(-1, 1))}),
    )
    state = Out(
        Schema("cubes.state", {"x": length(), "y": length(), "heading": angle()})
    )

    def body(self) -> Model:
        return Model(self.file, (Driven("axle", 0.1),))


def as_text(edge: float) -> str:
    """A cube as an STL that is text."""
    kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", 9), ("own", "<u2")])
    lines = ["solid cube"]
    for corners in np.frombuffer(cube(), kind, offset=84)["corners"] * edge:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex {:g} {:g} {:g}".format(*c) for c in corners.reshape(3, 3)]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid cube"])


@pytest.mark.parametrize(
    "engine",
    [
        pytest.param(Mujoco, marks=needs("mujoco")),
        pytest.param(Pybullet, marks=needs("pybullet")),
    ],
)
def test_meshes_of_text_and_of_one_name_touch(
    engine: type[Driver], tmp_path: Path
) -> None:
    """As their files say: nothing sinks, and nothing is lifted."""
    for name, edge in (("small", 0.2), ("large", 0.3)):
        (tmp_path / name).mkdir()
        written(tmp_path / name, "part.stl", as_text(edge))
    kind = type("Cubes", (Cubes,), {"file": written(tmp_path, "c.urdf", CUBES)})
    with running(kind, engine) as robot:
        for _ in range(10):
            obey(robot, {"axle": 0.0})
        world: Any = robot._world
        (at,), (turn,) = world._engine.poses()
    assert at[2] == pytest.approx(0.1, abs=0.005)
    np.testing.assert_allclose(turn, np.eye(3), atol=0.01)


@needs("mujoco")
def test_a_mesh_needs_no_volume_and_may_have_more_behind_it(tmp_path: Path) -> None:
    """The link says what it weighs."""
    text = ARM.replace('scale="0.02 0.02 0.02"', 'scale="8e-6 8e-6 8e-6"')
    file = arm(tmp_path, text)
    (tmp_path / "arm" / "meshes" / "cube.stl").write_bytes(cube() + b"more")
    source = built(Model(file, fixed=True)).source
    assert source is not None
    check(load("mujoco", "mujoco"), source)


@pytest.mark.parametrize("text", ["", "hello", "vertex a b c", "vertex nan 0 0"])
def test_what_is_no_mesh(text: str, tmp_path: Path) -> None:
    file = arm(tmp_path, ARM)
    written(tmp_path / "arm" / "meshes", "cube.stl", text)
    with pytest.raises(SchemaError, match=r"cube.stl is no STL with corners that are"):
        built(Model(file, fixed=True))
