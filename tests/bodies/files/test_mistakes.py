"""A mistake in a robot's file, or in what is said of it, is told before any start."""

import re
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents.ports import In
from rems_net.bodies.body import Driven, Model, Servo
from rems_net.bodies.files.built import built
from rems_net.defdict import Schema, angle, ratio
from rems_net.errors import ExperimentError, SchemaError
from tests.bodies.files.robots import (
    ARM,
    CART,
    LIMB,
    SHOULDER,
    Limb,
    arm,
    made,
    written,
)
from tests.drivers.physics.test_physics import needs

CIRCLE = """<link name="one"/><link name="two"/>
<joint name="a" type="fixed"><parent link="one"/><child link="two"/></joint>
<joint name="b" type="fixed"><parent link="two"/><child link="one"/></joint>"""


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("<robot>", r"arm.urdf is no XML: no element found: line 1, column 7"),
        ("<sdf/>", r"begins with <sdf>; a URDF with <robot>, an MJCF with <mujoco>"),
        (
            '<robot xmlns:xacro="http://ros.org/wiki/xacro"><xacro:arm/></robot>',
            r"written in xacro.*Type: xacro arm.urdf > arm_made.urdf",
        ),
        ("<robot/>", r"has one link that no joint carries, and this has 0 \(none\)"),
        (
            ARM.replace("</robot>", '<link name="hand"/></robot>'),
            r"two of its links are called 'hand'",
        ),
        (
            ARM.replace('upper="1.5"', 'upper="1e308"'),
            r'<limit> has upper="1e308"; expected numbers as in upper="0"',
        ),
        (ARM.replace('"left"', '"right"'), r"two of its joints are called 'right'"),
        (ARM.replace('name="elbow"', ""), r"one of its joints has no name"),
        (
            ARM.replace("</robot>", CIRCLE + "</robot>"),
            r"its links one, two carry one another in a circle",
        ),
        (
            ARM.replace("</robot>", '<link name="more"/></robot>'),
            r"and this has 2 \(foot, more\)",
        ),
        (
            ARM.replace('<child link="hand"/>', '<child link="hnad"/>'),
            r"joint 'elbow' joins the link 'hnad', which it does not have",
        ),
        (
            ARM.replace('<child link="hand"/>', '<child link="upper"/>'),
            r"two joints carry the link 'upper'",
        ),
        (
            ARM.replace('"continuous"', '"floating"'),
            r"joint 'elbow' is 'floating'; .* fixed, revolute, continuous, prismatic",
        ),
        (
            ARM.replace('lower="-1.2"', 'lower="2"'),
            r"'shoulder' is revolute from 2 to 1.5; .*\"continuous\"",
        ),
        (
            ARM.replace('radius="0.02" length', 'radius="2 cm" length'),
            r"<cylinder> has radius=\"2 cm\"; expected numbers as in radius=\"1\"",
        ),
        (
            ARM.replace('<axis xyz="1 0 0"/>', '<axis xyz="0 0 0"/>'),
            r"the axis of joint 'elbow' is 0 0 0",
        ),
        (
            ARM.replace('<mass value="0.1"/>', '<mass value="0"/>'),
            r"link 'hand' moves, and has no mass: give it an <inertial>",
        ),
        (
            ARM.replace('izz="0.0001"', 'izz="0.01"'),
            r"link 'hand' has the moments of inertia 0.0002, 0.0002, 0.01 kg m2, "
            r"which no body can have.*mend=True",
        ),
        (
            ARM.replace("cube.stl", "cub.stl"),
            r"arm.urdf needs the mesh package://arm/meshes/cub.stl, which would be "
            r".*cub.stl.*packages=",
        ),
        (
            ARM.replace('multiplier="-1"', 'multiplier="-1" offset="0.1"'),
            r"joint 'right' follows another with an offset; expected 0",
        ),
    ],
)
def test_of_a_urdf(text: str, what: str, tmp_path: Path) -> None:
    with pytest.raises(SchemaError, match=what):
        built(Model(arm(tmp_path, text), fixed=True))


@pytest.mark.parametrize(
    ("more", "what"),
    [
        (
            {"joints": (Driven("elbo", 0.1),)},
            r"arm.urdf has no joint 'elbo' that moves. Did you mean 'elbow'\? Its "
            r"joints: shoulder, elbow, left, right",
        ),
        ({"held": ("wrist",)}, r"no joint 'wrist'"),
        ({"joints": (SHOULDER, SHOULDER)}, r"names the joint 'shoulder' twice"),
        ({"joints": (SHOULDER,), "held": ("shoulder",)}, r"'shoulder' twice"),
        (
            {"joints": (Driven("shoulder", 0.1, effort=30.0),)},
            r"'shoulder'\) has an effort of 30 N m, and arm.urdf allows 20",
        ),
        (
            {"joints": (Driven("left", 0.1, servo=Servo(20.0, 1.0)),)},
            r"'left'\) goes at 1 m/s, and arm.urdf allows 0.2",
        ),
        ({"joints": (Driven("shoulder", 0.0),)}, r"torque 20.0 and droop 0.0"),
    ],
)
def test_of_what_is_said_of_it(more: dict[str, Any], what: str, tmp_path: Path) -> None:
    with pytest.raises(SchemaError, match=what):
        built(Model(arm(tmp_path), fixed=True, **more))


def test_the_file_says_how_strong_it_is_or_the_definition(tmp_path: Path) -> None:
    file = arm(tmp_path, ARM.replace('effort="20"', 'effort="0"'))
    with pytest.raises(SchemaError, match=r"no effort for joint 'shoulder': .* N m"):
        built(Model(file, (Driven("shoulder", 0.1),), fixed=True))
    built(Model(file, (Driven("shoulder", 0.1, effort=3.0),), fixed=True))


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(SchemaError, match=r"no.urdf cannot be read: No such file"):
        built(Model(tmp_path / "no.urdf"))


def test_a_robot_that_would_fall(tmp_path: Path) -> None:
    text = re.sub(r"<collision>.*?</collision>", "", CART, flags=re.DOTALL)
    file = written(tmp_path, "cart.urdf", text)
    with pytest.raises(SchemaError, match=r"nothing that touches the floor.*<coll"):
        built(Model(file))


def test_a_robot_that_is_bolted(tmp_path: Path) -> None:
    text = ARM.replace('"foot"', '"world"')
    file = arm(tmp_path, text)
    with pytest.raises(SchemaError, match=r"holds its robot to the world.*fixed=True"):
        built(Model(file))
    built(Model(file, fixed=True))


@needs("mujoco")
@pytest.mark.parametrize(
    ("text", "what"),
    [
        (
            LIMB.replace('type="capsule"', 'type="banana"'),
            r"MuJoCo does not take .*limb.xml: .*banana.*line 11",
        ),
        (
            LIMB.replace('joint="elbow" kp', 'joint="elbwo" kp'),
            r"MuJoCo does not take .*elbwo",
        ),
        (
            LIMB.replace('axis="1 0 0"', 'type="ball"'),
            r"limb.xml: 'elbow' is a ball joint; a robot here has hinges and slides",
        ),
        (
            LIMB.replace("</worldbody>", '<body name="table"/></worldbody>'),
            r"has 2 bodies in its worldbody \(foot, table\); .*Model\(root=...\)",
        ),
        (
            LIMB.replace(
                "</worldbody>", '<body name="a"/>' + 30 * "<body/>" + "</worldbody>"
            ),
            r"has 32 bodies in its worldbody \(foot, a, body 5.*body 14 and 20 more\)",
        ),
        (LIMB.replace("-60 90", "-60 1e300"), r"its jnt_range is beyond 1e\+50"),
        ("<mujoco/>", r"has 0 bodies in its worldbody \(none\)"),
    ],
)
def test_of_an_mjcf(text: str, what: str, tmp_path: Path) -> None:
    with pytest.raises(SchemaError, match=what):
        built(Model(written(tmp_path, "limb.xml", text), fixed=True))


@needs("mujoco")
def test_one_of_several_bodies_is_the_robot(tmp_path: Path) -> None:
    text = LIMB.replace("</worldbody>", '<body name="table"/></worldbody>')
    file = written(tmp_path, "limb.xml", text)
    built(Model(file, fixed=True, root="foot"))
    with pytest.raises(SchemaError, match=r"no body 'fot'.*Did you mean 'foot'"):
        built(Model(file, fixed=True, root="fot"))


class Wide(Limb):
    """Asks for more than its file allows."""

    command = In(
        Schema(
            "wide.command",
            {
                "shoulder": angle(range=(-2, 2)),
                "elbow": angle(range=(-2, 2)),
                "share": ratio(range=(0, 1)),
            },
        )
    )


@pytest.mark.parametrize(
    ("kind", "driver", "text", "what"),
    [
        pytest.param(
            Wide,
            "mujoco",
            ARM,
            r"command 'shoulder' goes from -2 to 2, and joint 'shoulder' of arm.urdf "
            r"from -1.2 to 1.5: write range=\(-1.2, 1.5\)",
            marks=needs("mujoco"),
        ),
        pytest.param(
            Limb,
            "mujoco",
            ARM.replace("cube.stl", "cube.dae"),
            r"arm.urdf needs the mesh cube.dae, and MuJoCo reads STL and OBJ: save",
            marks=needs("mujoco"),
        ),
    ],
)
def test_of_a_robot(
    kind: type[Limb], driver: str, text: str, what: str, tmp_path: Path
) -> None:
    """Before anything starts."""
    file = arm(tmp_path, text)
    (tmp_path / "arm" / "meshes" / "cube.dae").write_text("<COLLADA/>")
    lab = Experiment("mistakes", dt=0.1, duration=1, folder=tmp_path)
    lab.robot("limb", made(kind, file), driver)
    with pytest.raises(ExperimentError, match=what):
        lab.check()
