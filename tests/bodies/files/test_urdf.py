"""What a URDF says is what engines are given: geometry, masses, axes."""

from pathlib import Path
from typing import Any
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest

from rems_net.bodies.body import Array, Body, Hinge, Model, Slide, lump
from rems_net.bodies.files.built import built
from rems_net.bodies.files.meshes import find_mesh
from rems_net.bodies.tree import Tree
from rems_net.drivers.physics.files.load import load_file
from rems_net.errors import SchemaError
from rems_net.libraries import load
from rems_net.scenes.outline import of_body
from tests.bodies.files.robots import ARM, CART, GRIP, SHOULDER, arm, written
from tests.drivers.physics.test_physics import needs

#: of shoulder, elbow, left, right
BENT = [0.4, -1.1, 0.03, -0.01]
#: A link whose inertia is turned, and that turns.
TURNED = """<robot name="r"><mujoco><compiler fusestatic="false"/></mujoco>
<link name="a"/><link name="b"><inertial><origin rpy="0.3 0 0"/><mass value="1"/>
<inertia ixx="3" iyy="2" izz="1.5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>"""


def body(folder: Path, **more: Any) -> Body:
    return built(Model(arm(folder), (SHOULDER, GRIP), fixed=True, **more))


def inertia(mujoco: Any, text: str) -> Array:
    """The joint-space inertia (4, 4) of a model that is bent, and what gravity asks."""
    model = mujoco.MjModel.from_xml_string(text)
    data, whole = mujoco.MjData(model), np.zeros((5, 4))
    data.qpos[:] = BENT
    mujoco.mj_forward(model, data)
    for column, unit in enumerate(np.eye(4)):
        mujoco.mj_mulM(model, data, whole[column], unit)
    whole[4] = data.qfrc_bias
    return whole


@needs("mujoco")
def test_masses_and_inertias_are_those_of_the_file(tmp_path: Path) -> None:
    """What is fixed to a link weighs there as it did, turned or not."""
    mujoco, source = load("mujoco", "mujoco"), body(tmp_path).source
    assert source is not None
    model = mujoco.MjModel.from_xml_string(TURNED)
    if model.body_iquat[2, 0] == 1.0:
        pytest.skip("this MuJoCo forgets how an inertia in a URDF is turned")
    # The file itself, told only where its mesh is.
    mesh = (tmp_path / "arm" / "meshes" / "cube.stl").as_posix()
    plain = '<mujoco><compiler strippath="false" fusestatic="false"/></mujoco>'
    file = ARM.replace("package://arm/meshes/cube.stl", mesh)
    file = file.replace("<material", f"{plain}<material", 1)
    told = inertia(mujoco, source.urdf)
    np.testing.assert_allclose(told, inertia(mujoco, file), rtol=1e-9, atol=1e-12)


@needs("mujoco")
@needs("pybullet")
def test_both_engines_have_the_same_robot(tmp_path: Path) -> None:
    mujoco, bullet = load("mujoco", "mujoco"), load("pybullet", "pybullet")
    made = body(tmp_path)
    assert made.source is not None
    client = bullet.connect(bullet.DIRECT)
    try:

        def call(name: str, *args: Any, **more: Any) -> Any:
            return getattr(bullet, name)(*args, **more, physicsClientId=client)

        robot, moved = load_file(bullet, call, made, made.source)
        found = np.array(call("calculateMassMatrix", robot, BENT))
    finally:
        bullet.disconnect(client)
    armature = [link.joint.armature for link in Tree(made).links]
    assert moved == [0, 1, 2, 3]
    expected = inertia(mujoco, made.source.urdf)[:4] + np.diag(armature)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9)


def test_the_tree_is_the_files(tmp_path: Path) -> None:
    shoulder, elbow, left, right = (link.joint for link in Tree(body(tmp_path)).links)
    assert isinstance(shoulder, Hinge)
    assert isinstance(right, Slide)
    assert (shoulder.torque, shoulder.limits) == (20.0, (-1.2, 1.5))
    assert (shoulder.damping, shoulder.armature) == (0.1, 0.02)
    assert (elbow.name, elbow.effort, elbow.limits) == ("elbow", 0.0, None)
    # It mimics the left one, and so obeys what that is told, the other way round.
    assert (right.obeys, right.ratio, right.effort) == ("grip", -1.0, 10.0)
    assert left.position == right.position == "grip"
    mass = lump([part for joint in (shoulder, elbow) for part in joint.parts]).mass
    assert mass == pytest.approx(0.5 + 0.2 + 0.1)


def test_a_held_joint_is_none(tmp_path: Path) -> None:
    made = body(tmp_path, held=("elbow",))
    assert list(Tree(made).numbers) == ["shoulder", "left", "right"]
    made = built(Model(arm(tmp_path / "again"), fixed=True, held=("left",)))
    assert list(Tree(made).numbers) == ["shoulder", "elbow"]  # right follows left


def test_a_hinge_without_stops_has_no_end(tmp_path: Path) -> None:
    """Many files call it revolute and say nothing more; and some, continuous, do."""
    text = ARM.replace('lower="-1.2" upper="1.5"', "")
    text = text.replace('<limit effort="5"', '<limit lower="-1" upper="1" effort="5"')
    tree = Tree(built(Model(arm(tmp_path, text), fixed=True)))
    assert [link.joint.limits for link in tree.links[:2]] == [None, None]


@pytest.mark.parametrize(
    ("inertia", "mended"),
    [
        ('ixx="2e-4" iyy="2e-4" izz="1e-2"', (2e-4 + 2e-4 + 1e-2) / 3),
        ('ixx="0" iyy="0" izz="0"', 0.4 * 0.1 * 0.01**2),  # of 0.1 kg and 1 cm
    ],
)
def test_an_inertia_is_mended(inertia: str, mended: float, tmp_path: Path) -> None:
    text = ARM.replace('ixx="0.0002" iyy="0.0002" izz="0.0001"', inertia)
    made = built(Model(arm(tmp_path, text), fixed=True, mend=True))
    assert made.source is not None
    links = {link.get("name"): link for link in fromstring(made.source.urdf)}
    found = links["hand"].find("inertial/inertia")
    assert found is not None
    each = [float(found.get(key, "")) for key in ("ixx", "iyy", "izz", "ixy")]
    assert each == pytest.approx([mended, mended, mended, 0.0])


def test_a_mesh_is_found(tmp_path: Path) -> None:
    """Beside the file, by its whole path, in a package above it or where it is said.

    The package may have another name, as what is unpacked from a ZIP file.
    """
    file = arm(tmp_path)
    cube = tmp_path / "arm" / "meshes" / "cube.stl"
    elsewhere = tmp_path / "x" / "y" / "arm.urdf"
    elsewhere.parent.mkdir(parents=True)
    assert find_mesh("../meshes/cube.stl", file, None) == cube.resolve()
    assert find_mesh(f"file://{cube}", elsewhere, None) == cube.resolve()
    for packages in (None, tmp_path, tmp_path / "arm"):
        named = "package://arm/meshes/cube.stl"
        assert find_mesh(named, elsewhere, packages) == cube.resolve()
    deep = tmp_path / "arm" / "robots" / "one" / "urdf" / "arm.urdf"
    for named in ("package://limb/meshes/cube.stl", "package:///arm/meshes/cube.stl"):
        assert find_mesh(named, deep, None) == cube.resolve()
    with pytest.raises(SchemaError, match=r"needs the mesh package://leg.*packages="):
        find_mesh("package://leg/cube.stl", elsewhere, None)


def test_a_cart_stands_on_its_wheels(tmp_path: Path) -> None:
    """Its frame is as high as it must be; what it covers of the floor is known."""
    made = built(Model(written(tmp_path, "cart.urdf", CART)))
    assert made.height == pytest.approx(0.0)
    outline = of_body(made)
    assert outline.low == pytest.approx(0.0)
    assert outline.high == pytest.approx(0.08)
    low, high = outline.corners.min(axis=0), outline.corners.max(axis=0)
    np.testing.assert_allclose([*low, *high], [-0.08, -0.09, 0.08, 0.09], atol=1e-9)


def test_a_mesh_has_an_outline(tmp_path: Path) -> None:
    plate = next(iter(Tree(body(tmp_path)).links)).joint.parts[1]
    size = np.array(plate.shape.size)  # type: ignore[union-attr]
    assert (size > 0.02).all()  # it is turned
    assert (size < 0.02 * 3**0.5).all()
