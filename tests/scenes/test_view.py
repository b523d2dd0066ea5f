"""What programs can draw: places, things and robots as plain values."""

import json
from math import pi
from pathlib import Path

import numpy as np
import pytest

from rems_net import Create2, Woodbot, YoubotArm
from rems_net.agents.about.scenery import scene_of
from rems_net.agents.robot import combine
from rems_net.bodies.arena import Wall
from rems_net.bodies.body import Model
from rems_net.bodies.files.built import built
from rems_net.bodies.parts import Box
from rems_net.bodies.tree import Tree
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.robots.scaler import Scaler
from rems_net.scenes import view
from rems_net.scenes.ghost import Ghost
from rems_net.scenes.scene import Scene, Thing
from tests.bodies.files.robots import ARM, arm

PLACE = """<mujoco><worldbody>
  <geom type="plane" size="5 5 0.1"/>
  <geom type="box" size="1 0.1 0.2" pos="0 2 0.2"/>
  <body name="crate" pos="1 1 0.1" euler="0 0 90"><freejoint/>
    <geom type="box" size="0.2 0.1 0.1"/></body>
</worldbody></mujoco>"""


def area(corners: list[list[float]]) -> float:
    """The area inside, m2; positive if the corners run counter-clockwise."""
    x, y = np.array(corners).T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)


def test_a_scene_has_its_walls_and_its_things_in_their_own_frame() -> None:
    crate = Thing("crate", Box((0.4, 0.2, 0.1)), (1.0, 2.0, 0.05), heading=pi / 2)
    scene = Scene((Wall((2.0, 0.1, 0.3), (0.0, 1.0, 0.15), 0.0),), (crate,))
    said = json.loads(json.dumps(view.of_scene(scene)))
    assert said["radius"] == 0
    (wall,), (thing,) = said["walls"], said["things"]
    assert area(wall["outline"]) == pytest.approx(0.2)
    assert max(x for x, _ in thing["outline"]) == pytest.approx(0.2)
    assert max(y for _, y in thing["outline"]) == pytest.approx(0.1)
    assert thing["at"] == [1, 2, 0.05]
    assert thing["solids"] == [{"box": [0.4, 0.2, 0.1]}]
    assert wall["solids"] == [{"box": [2.0, 0.1, 0.3], "at": [0.0, 1.0, 0.15]}]


@pytest.mark.parametrize("definition", [Woodbot, Create2])
def test_a_robot_has_an_outline_and_an_arena(definition: type[Woodbot]) -> None:
    robot = combine(definition, Kinematic)("sim")
    robot.prepare()
    said = json.loads(json.dumps(scene_of(robot)))
    assert area(said["outline"]) > 0.005
    names = {ray["name"] for ray in said["rays"]}
    assert names <= set(robot.sensors.schema.paths)
    assert said["solids"]


def test_a_place_that_is_a_model_is_drawn(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    from rems_net.scenes.model import of_model

    file = tmp_path / "place.xml"
    file.write_text(PLACE, encoding="utf-8")
    said = of_model(Scene(mjcf=str(file), bodies=("crate",)))
    (wall,), (thing,) = said["walls"], said["things"]
    assert area(wall["outline"]) == pytest.approx(0.4)
    assert max(y for _, y in wall["outline"]) == pytest.approx(2.1)
    assert max(x for x, _ in thing["outline"]) == pytest.approx(0.2)
    assert thing["heading"] == pytest.approx(pi / 2)
    assert thing["at"] == pytest.approx([1, 1, 0.1])


def test_a_robot_from_a_file_has_its_meshes_where_its_boxes_are(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    body = built(Model(arm(tmp_path, ARM), fixed=True))
    said = json.loads(json.dumps(view.of_body(body)))
    links = [body.parts, *(link.stated.parts for link in Tree(body).links)]
    found = [one for one in said["solids"] if "mesh" in one]
    assert found
    for one in found:
        mesh = said["meshes"][one["mesh"]]
        assert max(mesh["faces"]) < len(mesh["corners"]) / 3
        turned = np.reshape(mesh["corners"], (-1, 3)) @ np.transpose(one["turn"])
        points = turned + one["at"]
        size = np.ptp(points, axis=0)
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        assert any(
            isinstance(part.shape, Box)
            and np.allclose(part.shape.size, size, atol=1e-3)
            and np.allclose(part.at, middle, atol=1e-3)
            for part in links[one["link"] + 1]
        )


def test_a_mesh_that_is_too_large_is_its_hull_or_a_box(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pytest.importorskip("mujoco")
    from rems_net.scenes import model

    body = built(Model(arm(tmp_path, ARM), fixed=True))
    monkeypatch.setattr(model, "TRIANGLES", 1)
    said = view.of_body(body)
    assert said["meshes"] == []
    assert len(said["solids"]) == len(view.of_body(body)["solids"])


@pytest.mark.parametrize(
    ("definition", "flat"), [(Woodbot, True), (YoubotArm, False), (Scaler, False)]
)
def test_arms_are_not_flat(definition: type[Woodbot], flat: bool) -> None:
    robot = combine(definition, Kinematic)("sim")
    robot.prepare()
    assert scene_of(robot)["flat"] is flat


def test_a_ramp_is_not_flat() -> None:
    ramp = Thing("ramp", Box((0.4, 0.2, 0.01)), (0.0, 0.0, 0.05), pitch=0.3)
    assert view.of_scene(Scene(things=(ramp,)))["flat"] is False
    assert view.of_scene(Scene())["flat"] is True


def test_a_ghost_is_a_thing_at_its_own_height() -> None:
    """Whoever draws it puts it to the pose that the world publishes."""
    robot = Woodbot("real")
    robot.prepare()
    scene = Scene(ghosts=(Ghost("real", robot.body()),))
    (thing,) = view.of_scene(scene)["things"]
    assert (thing["name"], thing["ghost"]) == ("real", True)
    assert thing["at"] == [0.0, 0.0, 0.02]
    assert thing["outline"] == view.of_body(robot.body())["outline"]
    kinds = [next(iter(solid)) for solid in thing["solids"]]
    assert sorted(kinds) == ["ball", "box", "cylinder", "cylinder"]
