"""What stands around the robots: in run.json, in pictures, and as a warning."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rems_net import Experiment, read
from rems_net.agents.experiment.show import Show
from rems_net.errors import ExperimentError, SchemaError
from rems_net.events import Event, listening
from rems_net.recordings.comparison import Trajectory, corners
from rems_net.recordings.picture import draw_paths

THINGS = {
    "walls": [{"start": [0.3, -0.2], "end": [0.3, 0.2]}],
    "boxes": [{"name": "crate", "size": [0.2, 0.1, 0.1], "x": -0.4, "y": 0.3}],
    "ramps": [{"name": "ramp", "x": -0.3, "y": -0.4}],
}


class Kept(Show):
    """Keeps what is said."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def say(self, who: str, event: Event) -> None:
        self.texts.append(event.text)


def hall(place: dict[str, float], **walls: Any) -> Experiment:
    lab = Experiment("hall", dt="0.1 s", duration="0.5 s")
    lab.world("hall", options=walls)
    for name, initial in (("near", {}), ("far", place)):
        lab.robot(name, "woodbot", "kinematic", world="hall", initial=initial)
    lab.output("log", "csv")
    return lab


def test_the_manifest_says_what_stands_there(tmp_path: Path) -> None:
    hall({"x": 0.7}, size=[2, 1.4], **THINGS).run(tmp_path, direct=True, show=Kept())
    told = json.loads((tmp_path / "run.json").read_text())
    there = {name: corners(text) for name, text in told["worlds"]["hall"].items()}
    assert list(there) == [*(f"wall {i}" for i in range(1, 6)), "crate", "ramp"]
    assert there["crate"].min(axis=0) == pytest.approx([-0.5, 0.25])
    assert there["crate"].max(axis=0) == pytest.approx([-0.3, 0.35])
    assert there["wall 5"].mean(axis=0) == pytest.approx([0.3, 0.0])
    for robot in told["robots"].values():
        assert robot["world"] == "hall"
        assert corners(robot["outline"])[:, 0].max() == pytest.approx(0.02)
    near = read(tmp_path).trajectories("near")[0]
    assert {*near.around} == {*there}
    assert len(near.outline) == 6


def test_a_picture_shows_it() -> None:
    figure = pytest.importorskip("matplotlib.figure", reason="no matplotlib").Figure()
    axes = figure.add_subplot()
    square = corners("-1,-1 1,-1 1,1 -1,1")
    long = corners("-50,0.4 50,0.4 50,0.41 -50,0.41")
    there = {"wall 1": long, "crate": 0.1 * square, "wall 2": square + 100.0}
    t, x, y = np.arange(3.0), np.array([0.0, 0.1, 0.2]), np.zeros(3)
    robot = Trajectory("a", t, x, y, y, outline=0.05 * square, around=there)
    draw_paths(axes, [robot])
    boxes = [patch.get_path().get_extents().bounds for patch in axes.patches]
    sizes = sorted(round(width, 6) for _, _, width, _ in boxes)
    assert sizes == [0.1, 0.1, 0.2, 100.0]  # the robot twice, the crate, a near wall
    assert axes.get_xlim()[1] < 1.0
    assert [text.get_text() for text in axes.texts] == ["crate"]


@pytest.mark.parametrize(
    ("place", "walls", "warned"),
    [
        ({"x": 1.5}, {"size": [2, 1.4]}, True),
        ({"y": -0.9}, {"size": [2, 1.4]}, True),
        ({"x": 0.8}, {"size": [2, 1.4]}, False),
        ({"x": 0.6, "y": 0.6}, {"radius": 0.7}, True),
        ({"x": 0.6}, {"radius": 0.7}, False),
        ({"x": 99.0}, {"walls": THINGS["walls"]}, False),
    ],
)
def test_a_robot_that_starts_outside_the_walls(
    place: dict[str, float], walls: dict[str, Any], warned: bool, tmp_path: Path
) -> None:
    show = Kept()
    hall(place, **walls).run(tmp_path, direct=True, show=show)
    told = [text for text in show.texts if "outside the walls of world/hall" in text]
    assert len(told) == warned
    events: list[Event] = []
    with listening(events.append):
        hall(place, **walls).engine()
    assert len(events) == warned


def test_a_robot_alone_that_starts_outside_its_arena() -> None:
    lab = Experiment("mine", duration=1)
    for name, x in (("in", 0.4), ("out", 0.6)):
        own = {"arena_radius": 0.5}
        lab.robot(name, "woodbot", "kinematic", parameters=own, initial={"x": x})
    events: list[Event] = []
    with listening(events.append):
        lab.engine()
    assert [event.text for event in events] == [
        "robot/out starts at x = 0.6 m, y = 0 m, which is outside the walls of its "
        "arena; give it another `initial`"
    ]


def test_parameters_and_starts_of_a_reset_beyond_a_turn() -> None:
    lab = Experiment("mine", duration=1)
    lab.robot("cam", "camera", "kinematic", parameters={"place": {"pitch": -90}})
    lab.robot("sim", "woodbot", "kinematic")
    events: list[Event] = []
    with listening(events.append), lab.engine() as engine:
        engine["robot/sim"].reset(initial={"heading": 90})
        with pytest.raises(SchemaError, match=r'a start is initial=\{"x": 0.1\}'):
            engine["robot/sim"].reset({"x": 0.1})
        with pytest.raises(ExperimentError, match="seed is '3'; expected a whole"):
            engine.reset("3")  # type: ignore[arg-type]
    assert [event.text.partition(",")[0] for event in events] == [
        "robot/cam has place/pitch = -90",
        "robot/sim starts at heading = 90",
    ]


@pytest.mark.parametrize(
    ("initial", "sentence"),
    [
        ({"heading": 90}, "heading = 90, which is 14.3 turns, since it is in rad; "),
        ({"heading": -22.5}, 'write "-22.5 deg", or "-22.5 rad" if you mean that'),
        ({"heading": "90 deg"}, ""),
        ({"heading": "90 rad"}, ""),
        ({"heading": 6.283}, ""),
        ({"heading": 90.12345678, "x": 90}, ""),  # where an earlier run ended
    ],
)
def test_initial_angles_beyond_a_turn(
    initial: dict[str, object], sentence: str
) -> None:
    lab = Experiment("mine", duration=1)
    for name in ("a", "b"):
        lab.robot(name, "woodbot", "kinematic", initial=initial)
    events: list[Event] = []
    with listening(events.append):
        lab.engine()
    assert len(events) == bool(sentence)
    assert all(sentence in event.text for event in events)
    assert all("robot/a (and 1 more) starts" in event.text for event in events)
