"""What cameras see, in both engines, by the same tests."""

from dataclasses import replace
from math import pi, radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rems_net.agents.experiment.file import load
from rems_net.agents.ports import Out
from rems_net.bodies.body import Body, Camera
from rems_net.bodies.model import Model
from rems_net.defdict import DefDict, Schema, array
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pybullet import Pybullet
from rems_net.robots.epuck import Epuck, EpuckWithCamera
from tests.bodies.files.robots import CART, Cart, written
from tests.commands import ROOT
from tests.drivers.physics.eyes import Engine, Eye, looking, middle, seen, why_not
from tests.pages import blocks
from tests.robots.moving import obey, running

BALL = {"name": "ball", "radius": 0.03, "x": 0.3, "y": 0.05}
CRATE = {"name": "crate", "size": [0.06, 0.06, 0.06], "x": 0.3, "y": -0.07}


@pytest.fixture(params=[Mujoco, Pybullet])
def engine(request: pytest.FixtureRequest) -> Engine:
    found: Engine = request.param
    if why := why_not(found):
        pytest.skip(why)
    return found


def test_a_ball_is_where_the_lens_puts_it(engine: Engine) -> None:
    picture = seen(Eye, engine, balls=[BALL], boxes=[CRATE])
    assert picture.shape == (24, 32, 3)
    pixel = 16 / np.tan(radians(30))  # of a slope of 1, from the middle
    column, row = middle(picture, "red")
    assert column == pytest.approx(15.5 - pixel * 0.05 / 0.3, abs=1.0)
    assert row == pytest.approx(11.5 + pixel * 0.02 / 0.3, abs=1.0)
    crate, _ = middle(picture, "brown")
    assert crate > 18  # to the right


def test_a_camera_turns_with_its_robot(engine: Engine) -> None:
    ball = {**BALL, "x": 0.0, "y": 0.3}
    column, _ = middle(
        seen(Eye, engine, initial={"heading": pi / 2}, balls=[ball]), "red"
    )
    assert column == pytest.approx(15.5, abs=0.6)


def test_ahead_is_up_where_it_looks_down(engine: Engine) -> None:
    above = looking((0.3, 0.0, 0.45), (0.0, 0.0, -1.0))
    picture = seen(
        above, engine, balls=[{**BALL, "x": 0.4, "y": 0.0}], boxes=[{**CRATE, "x": 0.3}]
    )
    column, row = middle(picture, "red")
    assert column == pytest.approx(15.5, abs=0.6)
    assert row < 9  # ahead
    column, row = middle(picture, "brown")
    assert column > 18  # to the right
    assert row == pytest.approx(11.5, abs=0.8)


def test_it_sees_other_robots_and_walls_but_not_the_box_it_is_in(
    engine: Engine,
) -> None:
    open_floor = seen(Eye, engine)
    walled = seen(Eye, engine, size=[1.0, 1.0])
    crowded = seen(Eye, engine, {"other": {"x": 0.25}}, size=[1.0, 1.0])
    sky = open_floor[0]
    assert (sky == sky[0]).all()
    assert (open_floor != walled).any()
    assert (walled != crowded).any()
    # Its own sides are all around it, and none is in the way.
    assert open_floor[-1].mean() > 150


def test_both_engines_see_nearly_the_same() -> None:
    for engine in (Mujoco, Pybullet):
        if why := why_not(engine):
            pytest.skip(why)
    place: dict[str, Any] = {"balls": [BALL], "boxes": [CRATE], "size": [1.0, 1.0]}
    one, other = (
        seen(EpuckWithCamera, e, {"w": {"x": 0.2, "y": 0.2}}, **place).astype(int)
        for e in (Mujoco, Pybullet)
    )
    assert one.shape == (39, 52, 3)
    assert np.median(np.abs(one - other)) < 12
    for colour in ("red", "brown"):
        assert middle(one.astype(np.uint8), colour) == pytest.approx(
            middle(other.astype(np.uint8), colour), abs=1.0
        )


def test_a_robot_of_a_file_has_eyes(engine: Engine, tmp_path: Path) -> None:
    """Behind it and above, so that it sees itself: green, on dark wheels."""

    class Seeing(Cart):
        file = written(tmp_path, "cart.urdf", CART)
        sensors = Out(Schema("eye.sensors", {"seen": array((24, 32, 3), dtype="u1")}))

        def body(self) -> Model:
            eye = Camera("seen", (-0.25, 0, 0.2), (0.8, 0, -0.6), 32, 24, 1.2)
            return replace(super().body(), sensors=(eye,))

    picture = seen(Seeing, engine)
    for colour in ("green", "dark"):
        assert middle(picture, colour)[0] == pytest.approx(15.5, abs=0.6)


def test_the_floor_has_the_same_tiles_wherever_one_looks_at_it() -> None:
    for engine in (Mujoco, Pybullet):
        if why := why_not(engine):
            pytest.skip(why)
    above = looking((0.2, 0.0, 0.2), (0.0, 0.0, -1.0))
    for place in ({"x": 0.03, "y": -0.24}, {"x": -3.37, "y": 60.21}):
        one, other = (
            seen(above, engine, initial=place).astype(int)
            for engine in (Mujoco, Pybullet)
        )
        assert np.ptp(one) > 20
        assert (np.abs(one - other).max(axis=2) > 15).mean() < 0.2


def test_things_have_colours_of_their_own(engine: Engine) -> None:
    ball = {**BALL, "colour": [0.1, 0.2, 0.9]}
    assert middle(seen(Eye, engine, balls=[ball]), "blue")


def test_a_reset_gives_the_same_picture_and_a_step_another(engine: Engine) -> None:
    with running(EpuckWithCamera, engine, parameters={"arena_radius": 0.3}) as robot:
        first = robot.sensors["camera"]
        obey(robot, {"wheel/left": 3.0, "wheel/right": -3.0}, 0.25)
        assert (robot.sensors["camera"] != first).any()
        robot.reset()
        assert (robot.sensors["camera"] == first).all()


def test_to_look_changes_nothing(engine: Engine) -> None:
    gone = []
    for definition in (Epuck, EpuckWithCamera):
        with running(definition, engine, parameters={"arena_radius": 0.1}) as robot:
            for _ in range(20):  # to the wall, and along it
                obey(robot, {"wheel/left": 6.0, "wheel/right": 5.0}, 0.1)
            gone.append((dict(robot.state), robot.sensors["proximity/7"]))
    assert gone[0] == gone[1]
    assert gone[0][1] < 0.07


class Seldom(Eye):
    """Takes a picture at every third step."""

    def body(self) -> Body:
        camera = Camera("seen", self.at, self.direction, 32, 24, 1.0, every=3)
        return replace(super().body(), sensors=(camera,))


def test_a_picture_at_every_third_step(engine: Engine) -> None:
    with running(Seldom, engine) as robot:
        for _ in range(2):  # after a reset the same
            seen = [robot.sensors["seen"]]
            for _ in range(6):
                robot.sense()
                seen.append(robot.sensors["seen"])
            new = [n for n in range(1, 7) if seen[n] is not seen[n - 1]]
            assert new == [3, 6]
            assert seen[0].any()
            robot.sense()
            robot.reset()


def test_by_mathematics_alone_it_is_dark() -> None:
    with running(EpuckWithCamera, Kinematic) as robot:
        obey(robot, {"wheel/left": 3.0})
        assert not robot.sensors["camera"].any()
        assert robot.sensors["encoder/left"] > 0


class Painted(EpuckWithCamera):
    """Says itself what its camera would see: how far it has come."""

    def measure(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        seen = np.full((39, 52, 3), round(1000 * state["x"]), np.uint8)
        return super().measure(state, command) | {"camera": seen}


def test_a_definition_may_paint_by_itself() -> None:
    with running(Painted, Kinematic, initial={"x": 0.2}) as robot:
        assert (robot.sensors["camera"] == 200).all()


def test_the_experiment_of_the_page_can_be_run(tmp_path: Path) -> None:
    if why := why_not(Mujoco):
        pytest.skip(why)
    (block,) = blocks(ROOT / "docs" / "camera.md", "toml")
    (tmp_path / "look.toml").write_text(block)
    assert "robot/bot" in load(tmp_path / "look.toml").check()
