"""What an MJCF says holds; its floor, motors, sensors and options stay out."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.bodies.body import Driven, Model
from rems_net.bodies.files.built import built
from rems_net.bodies.tree import Tree
from rems_net.drivers.physics.mujoco import Mujoco
from tests.bodies.files.robots import LIMB, Limb, cube, made, written
from tests.drivers.physics.test_physics import needs
from tests.robots.moving import obey, running

pytestmark = needs("mujoco")


def limb(folder: Path, text: str = LIMB) -> Path:
    return written(folder, "limb.xml", text)


def test_its_joints_are_the_trees(tmp_path: Path) -> None:
    joints = (Driven("shoulder", 0.1), Driven("elbow", 0.1))
    tree = Tree(built(Model(limb(tmp_path), joints, fixed=True)))
    shoulder, elbow = (link.joint for link in tree.links)
    # Degrees are rad; a motor's control and gear, or its force, say how strong it is.
    assert shoulder.limits == pytest.approx((-1.0472, 1.5708), abs=1e-4)
    assert (shoulder.effort, elbow.effort) == (20.0, 5.0)
    assert (elbow.limits, elbow.damping, elbow.armature) == (None, 0.2, 0.01)
    assert elbow.at == pytest.approx((0, 0, 0.3))
    assert elbow.axis == pytest.approx((1, 0, 0))
    assert len(shoulder.parts) == 1  # what touches nothing has no outline


@contextmanager
def model(folder: Path, file: Path, **more: Any) -> Iterator[Any]:
    """MuJoCo's model of the world that a robot with this file is in."""
    with running(made(Limb, file, **more), Mujoco) as robot:
        yield robot.member.instance._model  # type: ignore[attr-defined]


def test_what_stays_out(tmp_path: Path) -> None:
    with model(tmp_path, limb(tmp_path)) as one:
        assert (one.nu, one.nsensor, one.nkey, one.nlight) == (2, 0, 0, 0)
        assert list(one.geom_type).count(0) == 1  # floors
        assert one.opt.integrator == 3  # implicitfast, as of every world here
    assert not Path("MUJOCO_LOG.TXT").exists()


def test_what_holds(tmp_path: Path) -> None:
    """Where it stands, what it weighs, how it rubs."""
    with model(tmp_path, limb(tmp_path)) as one:
        assert one.body("0/base").pos.tolist() == [0.0, 0.0, 0.1]
        assert one.body("0/file/hand").mass[0] == pytest.approx(0.1131, abs=1e-4)
        assert set(one.geom_friction[1:, 0]) == {0.8}
    rubs = {"hand": 0.1}
    with model(tmp_path, limb(tmp_path), friction=rubs, height=0.7) as one:
        assert one.body("0/base").pos[2] == 0.7
        assert one.geom_friction[1:, 0].tolist() == [0.8, 0.8, 0.8, 0.1]


def test_a_held_joint_goes_with_its_motor(tmp_path: Path) -> None:
    joints = (Driven("shoulder", 0.1),)
    made = built(Model(limb(tmp_path), joints, fixed=True, held=("elbow",)))
    assert list(Tree(made).numbers) == ["shoulder"]


def test_what_has_no_name_is_given_one(tmp_path: Path) -> None:
    text = LIMB.replace('name="hand"', "").replace('name="foot"', "")
    file = limb(tmp_path, text)
    with running(made(Limb, file), Mujoco) as robot:
        obey(robot, {"shoulder": 0.5, "elbow": 0.5, "share": 1.0}, 1.0)
        assert robot.state["elbow"] == pytest.approx(0.5, abs=0.01)


def test_meshes_and_other_files_beside_it(tmp_path: Path) -> None:
    """As from the folder of the file, wherever that is."""
    there = tmp_path / "robots"
    (there / "meshes").mkdir(parents=True)
    (there / "meshes" / "cube.stl").write_bytes(cube())
    text = LIMB.replace(
        "<default>",
        '<compiler meshdir="meshes"/><asset><mesh name="cube" file="cube.stl" '
        'scale="0.02 0.02 0.02"/></asset><include file="more.xml"/><default>',
    ).replace('type="sphere" size="0.1"', 'type="mesh" mesh="cube"')
    written(there, "more.xml", "<mujoco><option timestep='0.01'/></mujoco>")
    with model(tmp_path, limb(there, text)) as one:
        assert one.nmesh == 1


def test_it_is_in_a_place_of_ones_own(tmp_path: Path) -> None:
    """Two files: one is the place, the other one the robot in it."""
    room = """<mujoco><option gravity="0 0 -1.62"/><visual><map zfar="9"/></visual>
      <worldbody><geom type="plane" size="0 0 1"/></worldbody></mujoco>"""
    written(tmp_path, "room.xml", room)
    lab = Experiment("room", dt=0.05, duration=1, folder=tmp_path)
    lab.world("room", options={"mjcf": "room.xml"})
    for name in ("a", "b"):
        kind = made(Limb, limb(tmp_path)) if name == "a" else "woodbot"
        start = {} if name == "a" else {"x": 1.0}
        lab.robot(name, kind, "mujoco", world="room", initial=start)
    agents: dict[str, Any] = dict(lab.check())
    a, b = agents["robot/a"], agents["robot/b"]
    try:
        a.open()
        b.open()
        for _ in range(40):
            a.command = {"shoulder": 0.5, "elbow": 0.5, "share": 1.0}
            a.shared.advance(0.05)
        a.sense()
        assert a.state["elbow"] == pytest.approx(0.5, abs=0.01)
        assert a.state["shoulder"] == pytest.approx(0.5, abs=0.01)
    finally:
        a.close()
        b.close()
