"""Localise: poses with their age, and a sentence for everything that is doubtful."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rems_net import Experiment
from rems_net.agents.experiment.file import load
from rems_net.bodies.marker import FAMILIES, Marker
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.errors import ExperimentError
from rems_net.events import Event, listening
from rems_net.eyes import apriltags
from rems_net.eyes.drawn import cells
from rems_net.eyes.finder import Finder, Target
from rems_net.eyes.view import View, turn_of
from rems_net.robots.eyes.camera import Camera
from tests.commands import ROOT
from tests.drivers.physics.eyes import why_not
from tests.eyes.paper import SIZE, Go, Grey, Painted, above, pasted
from tests.pages import blocks

pytest.importorskip("apriltag")

MARKER = {"id": 3, "size": SIZE, "height": 1e-9}
DOWN = {
    **{"fx": 1200.0, "width": 640, "height": 480},
    "place": {"z": 1.0, "pitch": -pi / 2},
}


def lab(pictures: Sequence[Grey], command: Any = None, **options: Any) -> Experiment:
    """A robot that stands, and a camera that shows these pictures."""
    driver = type("Painted", (Painted,), {"pictures": tuple(pictures)})
    made = Experiment("eyes", dt=0.05, duration=5.0)
    made.robot("bot", "woodbot", "kinematic", marker=MARKER, command=command)
    made.robot("cam", Camera, driver, parameters=DOWN)
    options = {"robots": "bot", **options}
    made.process("eyes", "localise", camera="robot/cam/sensors", options=options)
    return made


@contextmanager
def watched() -> Iterator[list[Event]]:
    events: list[Event] = []
    with listening(events.append):
        yield events


def warnings(events: Sequence[Event]) -> list[str]:
    return [one.text for one in events if one.level == "warning" and "eyes" in one.text]


def pose(engine: Any) -> Any:
    return engine["process/eyes"].bot


def test_in_mujoco_a_driving_robot_is_found() -> None:
    if why := why_not(Mujoco):
        pytest.skip(why)
    made = Experiment("eyes", dt=0.05, duration=2.0)
    place = {"z": 0.9, "x": 0.1}
    marker = {"id": 3, "size": "40 mm", "x": "10 mm", "heading": "30 deg"}
    made.robot("bot", "woodbot", "mujoco", world="place", marker=marker)
    made.robot("cam", "camera", "mujoco", world="place", parameters={"place": place})
    options = {"robots": "bot"}
    made.process("eyes", "localise", camera="robot/cam/sensors", options=options)
    with watched() as events, made.engine() as engine:
        for _ in range(12):
            engine.put("robot/bot/command", {"wheel": {"left": 2.0, "right": 5.0}})
            engine.step()
            found, true = pose(engine), engine["robot/bot"].state
            assert found.tick == engine["robot/bot"].tick.n
            assert found.age == 0.0
            assert found.x == pytest.approx(true.x, abs=3e-4)
            assert found.y == pytest.approx(true.y, abs=3e-4)
            assert found.heading == pytest.approx(true.heading, abs=0.01)
        (row,) = engine["process/eyes"].poses.seen
    assert (row["robot"], row["id"]) == ("bot", 3)
    assert np.linalg.eigvalsh(found.covariance).min() > 0
    assert np.sqrt(found.covariance[0, 0]) < 1e-3
    assert warnings(events) == []


def test_a_covered_marker_grows_old_and_comes_back_with_a_warning() -> None:
    here, gone = pasted([(3, 0.0, 0.0)]), pasted([])
    half = here.copy()
    half[:240] = 150
    away = pasted([(3, 0.0, 0.12)])
    shown = [here, here, half, *[gone] * 25, away]
    with watched() as events, lab(shown).engine() as engine:
        engine.step(2)
        assert (pose(engine).x, pose(engine).age) == (pytest.approx(0.0, abs=1e-3), 0.0)
        engine.step(4)
        assert pose(engine).tick == 2
        assert pose(engine).age == pytest.approx(0.2)
        engine.step(23)
        assert pose(engine).y == pytest.approx(0.12, abs=1e-3)
    lost, jump = warnings(events)
    assert "bot is out of sight for 1.1" in lost
    assert "bot was 120 mm away 1.35 s before" in jump


def test_a_frozen_camera_is_reported_and_its_poses_are_no_longer_fresh() -> None:
    with watched() as events, lab([pasted([(3, 0.0, 0.0)])]).engine() as engine:
        engine.step(30)
        assert pose(engine).tick == 1
    (frozen,) = warnings(events)
    assert "the newest picture is 0.6 s old: the camera is frozen" in frozen


def test_a_robot_that_obeys_a_frozen_camera_stops() -> None:
    made = lab([pasted([(3, 0.0, 0.0)])] * 20, command="process/go")
    made.process("go", Go)
    with watched(), made.engine() as engine:
        places = []
        for _ in range(45):
            engine.step()
            places.append(engine["robot/bot"].state.x)
    moves = np.diff(places)
    assert (moves[3:20] > 0.001).all()
    assert (moves[-12:] == 0.0).all()  # half a second after the last picture


def test_a_mirrored_picture_is_named() -> None:
    turned = np.ascontiguousarray(pasted([(3, 0.0, 0.0)])[:, ::-1])
    with watched() as events, lab([turned] * 30).engine() as engine:
        engine.step(25)
        assert pose(engine).id == -1
    assert "the pictures are mirrored" in warnings(events)[0]


def test_a_heading_goes_on_past_a_full_turn() -> None:
    one = pasted([(3, 0.0, 0.0)])
    quarters = [np.ascontiguousarray(np.rot90(one[:, 80:560], k)) for k in range(6)]
    rim = [np.pad(q, ((0, 0), (80, 80)), constant_values=150) for q in quarters]
    with lab(rim).engine() as engine:
        engine.step(6)
        assert pose(engine).heading == pytest.approx(5 * pi / 2, abs=0.01)


def test_two_robots_with_one_marker_are_refused() -> None:
    made = lab([pasted([])])
    made.robot("cart", "woodbot", "kinematic", marker=MARKER)
    with made.engine() as engine, pytest.raises(Exception, match=r"bot and cart both"):
        engine.step()


def test_a_robot_that_comes_later_is_found_and_one_without_a_marker_is_named() -> None:
    here, both = pasted([(3, 0.0, 0.0)]), pasted([(3, 0.0, 0.0), (4, 0.1, 0.1)])
    made = lab([here] * 3 + [both] * 30, robots="bot, cart, crat")
    made.robot("cart", "woodbot", "kinematic", marker={**MARKER, "id": 4}, since=0.2)
    made.robot("thief", "woodbot", "kinematic", marker=MARKER, since=0.4)
    with watched() as events, made.engine() as engine:
        engine.step(12)
        assert engine["process/eyes"].cart.y == pytest.approx(0.1, abs=1e-3)
        assert pose(engine).tick == 12
    texts = warnings(events)
    assert "robots names 'cart', which has no marker; there is bot." in texts[0]
    assert "there is bot, cart. Did you mean 'cart'?" in texts[2]
    assert "bot and thief both have marker 3" in texts[3]


def test_a_robot_that_was_never_seen_is_named() -> None:
    made = lab([pasted([(3, 0.0, 0.0)])] * 30, robots="bot, cart")
    made.robot("cart", "woodbot", "kinematic", marker={**MARKER, "id": 4})
    with watched() as events, made.engine() as engine:
        engine.step(25)
    (text,) = warnings(events)
    assert "cart is out of sight for 1.1" in text
    assert "upside down" in text


def test_names_that_cannot_be_ports_are_refused() -> None:
    with pytest.raises(ExperimentError, match=r"robots names 'poses'.*R1104"):
        lab([pasted([])], robots="poses").check()


def finder(size: float = SIZE) -> Finder:
    return Finder(above(), {3: Target("bot", Marker("tag36h11", 3, size), 0.0)})


def elsewhere(pitch: float = -pi / 2, **lens: Any) -> Finder:
    """Return the finder of a camera that is not as it is written."""
    view, looking = above(), finder()
    turn = turn_of(0.0, pitch, 0.0)
    looking.view = View.at(replace(view.lens, **lens), view.eye, turn)
    return looking


@pytest.mark.parametrize(
    "how", [{"fx": 840.0, "fy": 840.0}, {"bends": (-1.5, 0, 0, 0, 0)}]
)
def test_a_lens_that_is_not_its_own_gives_no_pose(how: dict[str, Any]) -> None:
    found, ((_, _, text),) = elsewhere(**how).look(pasted([(3, 0.1, 0.15)]))
    assert found == []
    assert "has the camera another lens?" in text


def test_a_lens_that_is_nearly_its_own_is_noticed() -> None:
    looking, texts = elsewhere(fx=1080.0, fy=1080.0), []
    for _ in range(20):
        texts += [text for _, _, text in looking.look(pasted([(3, 0.1, 0.15)]))[1]]
    assert "measures 44.4 mm, 111% of the 40 mm" in texts[0]
    assert "whether the lens is the camera's" in texts[0]


@pytest.mark.parametrize(("pitch", "why"), [(0.2, "plane"), (-1.2, "bent")])
def test_a_camera_that_looks_elsewhere_gives_no_pose(pitch: float, why: str) -> None:
    found, ((kind, _, text),) = elsewhere(pitch).look(pasted([(3, 0.1, 0.15)]))
    assert (found, kind) == ([], why)
    assert "is the camera's place right?" in text or "does not fit a square" in text


def test_a_marker_twice_is_not_used() -> None:
    found, ((kind, number, text),) = finder().look(
        pasted([(3, 0.1, 0.0), (3, -0.1, 0.0)])
    )
    assert (found, kind, number) == ([], "twice", 3)
    assert "is in the picture twice" in text


def test_a_picture_of_a_marker_is_not_used() -> None:
    found, ((kind, _, text),) = finder().look(pasted([(3, 0.1, 0.0)], cell=4))
    assert (found, kind) == ([], "foreign")
    assert "is 67% of its size of 40 mm" in text


def test_a_tilted_marker_is_not_used() -> None:
    picture = pasted([(3, 0.0, 0.0)])
    for column in range(640):  # lower and lower to the right: no square any more
        picture[:, column] = np.roll(picture[:, column], (column - 320) // 4)
    found, ((kind, _, text),) = finder().look(picture)
    assert (found, kind) == ([], "bent")
    assert "does not fit a square that lies level" in text


def test_a_printer_that_shrinks_is_noticed() -> None:
    looking, texts = finder(size=SIZE / 0.97), []
    for _ in range(20):
        found, doubts = looking.look(pasted([(3, 0.0, 0.05)]))
        texts += [text for kind, _, text in doubts if kind == "size"]
        assert len(found) == 1
    assert "97% of the 41 mm that is written" in texts[0]


def wrong(seed: int, small: int, full: int, family: str = "tag36h11") -> list[int]:
    """Return the ids of poses in pictures of clutter, where all ids are ours.

    small, full: numbers of pictures of 320 x 240 pixels, and of 640 x 480
    """
    random, looking = np.random.default_rng(seed), finder()
    marks = [Marker(family, n, SIZE) for n in range(FAMILIES[family][0])]
    looking.targets = {one.id: Target(str(one.id), one, 0.0) for one in marks}
    found = []
    for number in range(small + full):
        scale = 1 if number < small else 2
        poses, _ = looking.look(clutter(random, scale, family))
        found += [one.target.marker.id for one in poses]
    return found


def clutter(random: np.random.Generator, scale: int, family: str) -> Grey:
    """Squares with random cells, and markers of which one to four cells are wrong."""
    rows, columns = 240 * scale, 320 * scale
    picture = random.normal(150, 6, (rows, columns))
    ids, edge = FAMILIES[family]
    for _ in range(10 * scale**2):
        bits = random.integers(0, 2, (edge + 2, edge + 2)).astype(np.uint8)
        bits[0], bits[-1], bits[:, 0], bits[:, -1] = 1, 1, 1, 1
        bits[1, 1:-1] = bits[-2, 1:-1] = bits[1:-1, 1] = bits[1:-1, -2] = 0
        if random.random() < 0.5:
            bits = cells(Marker(family, int(random.integers(ids)), SIZE)).copy()
            flipped = random.integers(2, edge, (int(random.integers(1, 5)), 2))
            for row, column in np.unique(flipped, axis=0):
                bits[row, column] ^= 1
        cell = int(random.integers(2, 10))
        turned = np.rot90(bits, int(random.integers(4)))
        drawn = turned.repeat(cell, axis=0).repeat(cell, axis=1)
        row, column = random.integers(0, rows - 99), random.integers(0, columns - 99)
        place = picture[row : row + len(drawn), column : column + len(drawn)]
        place[:] = np.where(drawn, 230, 20) + random.normal(0, 6, drawn.shape)
    return np.clip(picture, 0, 255).astype(np.uint8)


def test_clutter_is_no_marker(monkeypatch: pytest.MonkeyPatch) -> None:
    """It would be one if a wrong cell were mended."""
    assert wrong(7, 30, 3) == []
    monkeypatch.setattr(apriltags, "MENDED", 1)
    apriltags._detector.cache_clear()
    assert len(wrong(7, 30, 3)) > 3
    apriltags._detector.cache_clear()


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("family", ["tag36h11", "aruco4x4"])
def test_clutter_is_no_marker_in_ten_thousand_pictures(family: str) -> None:
    """130,000 squares; a thousand of the pictures are of 640 x 480 pixels."""
    if family == "aruco4x4":
        pytest.importorskip("cv2")
    assert wrong(28, 9000, 1000, family) == []


def test_markers_of_few_cells_count_from_their_second_picture_on() -> None:
    """A square of clutter may show one; it has to stay, and to have its size."""
    pytest.importorskip("cv2")
    marker = Marker("aruco4x4", 3, SIZE)
    looking = Finder(above(), {3: Target("bot", marker, 0.0)})
    here, gone = pasted([(3, 0.1, 0.0)], 8, "aruco4x4"), pasted([])
    for picture, count in ((here, 0), (gone, 0), (here, 0), (here, 1), (here, 1)):
        assert len(looking.look(picture)[0]) == count
    small = pasted([(3, 0.1, 0.0)], 7, "aruco4x4")
    assert looking.look(small)[0] == []
    ((_, _, text),) = looking.look(small)[1]
    assert "of its size of 40 mm" in text


def test_the_experiment_of_the_page(tmp_path: Path) -> None:
    if why := why_not(Mujoco):
        pytest.skip(why)
    (tmp_path / "eyes.toml").write_text(blocks(ROOT / "docs" / "eyes.md", "toml")[0])
    with load(tmp_path / "eyes.toml").engine() as engine:
        engine.step(2)
        assert pose(engine).x == pytest.approx(0.0, abs=3e-4)
        assert pose(engine).tick == 2
