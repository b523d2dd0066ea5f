"""What cannot be in a world, or be one, is told before anything starts."""

from collections.abc import Callable
from pathlib import Path

import pytest

from rems_net import Experiment, Tick
from rems_net.agents.experiment.file import load
from rems_net.agents.robot import Robot
from rems_net.errors import ExperimentError, SchemaError
from tests.drivers.physics.test_physics import needs

Change = Callable[[Experiment], None]


def lab(folder: Path = Path()) -> Experiment:
    return Experiment("worlds", dt=0.1, duration=1, folder=folder)


def two(one: Experiment, **second: object) -> None:
    one.robot("a", "woodbot", "kinematic", world="arena")
    more = {"initial": {"y": 0.2}, "world": "arena", **second}
    one.robot("b", "woodbot", **{"driver": "kinematic", **more})  # type: ignore[arg-type]


def other_driver(one: Experiment) -> None:
    two(one, driver="mujoco")


def with_a_host(one: Experiment) -> None:
    two(one, host="mine")


def later(one: Experiment) -> None:
    two(one, since=0.5)


def another_rate(one: Experiment) -> None:
    two(one, every=2)


def nobody(one: Experiment) -> None:
    one.world("arena", options={"radius": "1 m"})
    one.robot("a", "woodbot", "kinematic")


def twice(one: Experiment) -> None:
    one.world("arena", options={"radius": "1 m"})
    one.world("arena", options={"radius": "2 m"})


def names_alike(one: Experiment) -> None:
    one.world(
        "arena", options={"balls": [{"name": "ball"}, {"name": "ball", "x": 1.0}]}
    )
    two(one)


def nameless(one: Experiment) -> None:
    one.world("arena", options={"balls": [{"x": 1.0}]})
    two(one)


def taken(one: Experiment) -> None:
    one.world("arena", options={"balls": [{"name": "tick"}]})
    two(one)


def typo(one: Experiment) -> None:
    one.world("arena", options={"boxs": []})


def field(one: Experiment) -> None:
    one.world("arena", options={"boxes": [{"name": "crate", "weight": 3}]})
    two(one)


def both(one: Experiment) -> None:
    one.world("arena", options={"radius": 1, "size": [1, 1]})
    two(one)


def no_engine(one: Experiment) -> None:
    two(one)
    one.world("arena", options={"mjcf": "room.xml"})


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (
            other_driver,
            r"world 'arena': robot/a is done by Kinematic and robot/b by Mujoco.*same",
        ),
        (with_a_host, r"robot 'b': it has a world \('arena'\) and a host.*leave host"),
        (later, r"world 'arena': robot/b comes later.*leave since out"),
        (another_rate, r"robot/a steps at every 1 ticks and robot/b at every 2"),
        (nobody, r"world 'arena': no robot is in it; write world = 'arena'"),
        (twice, r"world 'arena': there are two worlds named 'arena'"),
        (names_alike, r"world 'arena': two things are called 'ball'"),
        (nameless, r"world 'arena': a thing is called ''; each has a name"),
        (taken, r"a thing is called 'tick', and every world has something else"),
        (typo, r"world 'arena': World.options has no field 'boxs'.*boxes"),
        (field, r"world 'arena': .*'weight'"),
        (both, r"world 'arena': there is a radius and a size"),
        (no_engine, r"world 'arena': mjcf is a model for MuJoCo.*driver mujoco"),
    ],
)
def test_it_is_told(change: Change, what: str, tmp_path: Path) -> None:
    (tmp_path / "room.xml").write_text("<mujoco><worldbody/></mujoco>")

    def attempt() -> None:
        one = lab(tmp_path)
        change(one)
        one.check()

    with pytest.raises(ExperimentError, match=what):
        attempt()


def test_a_driver_without_worlds(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "from rems_net import Driver\n"
        "class Mine(Driver):\n"
        "    def drive(self, command, dt): pass\n"
        "    def sense(self): pass\n"
    )
    one = lab(tmp_path)
    one.robot("a", "woodbot", "mine.py:Mine", world="arena")
    with pytest.raises(ExperimentError, match="the driver Mine has no worlds"):
        one.check()


def test_a_file_is_told_by_its_table(tmp_path: Path) -> None:
    path = tmp_path / "lab.toml"
    path.write_text('[[world]]\nname = "arena"\nradus = 1\n')
    with pytest.raises(
        ExperimentError, match=r'\[\[world\]\] "arena": .*radus.*radius'
    ):
        load(path)


ROOM = """<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1"/>
    <geom type="box" size="0.01 1 0.1" pos="0.2 0 0.1"/>
    <body name="can" pos="0.1 0 0.04">
      <freejoint/><geom type="cylinder" size="0.03 0.04" mass="0.05"/>
    </body>
  </worldbody>
</mujoco>
"""


@needs("mujoco")
@pytest.mark.parametrize(
    ("change", "what"),
    [
        (("</body>", ""), r"room.xml is no XML: mismatched tag: line 8"),
        (("cylinder", "cilinder"), r"does not take .*'cilinder'.*line 6\. \(R0206\)$"),
        (("<mujoco>", "<robot>"), r"room.xml .*mismatched|begins with <robot>"),
        (('size="0.03 0.04"', ""), r"does not take .*size 0 must be positive.*line 6"),
    ],
)
def test_a_broken_place_is_told(
    change: tuple[str, str], what: str, tmp_path: Path
) -> None:
    (tmp_path / "room.xml").write_text(ROOM.replace(*change))
    one = lab(tmp_path)
    one.world("room", options={"mjcf": "room.xml"})
    one.robot("a", "woodbot", "mujoco", world="room")
    with pytest.raises(ExperimentError, match=rf"world 'room': .*{what}"):
        one.check()


@needs("mujoco")
def test_a_place_of_ones_own(tmp_path: Path) -> None:
    (tmp_path / "room.xml").write_text(ROOM)
    one = lab(tmp_path)
    one.world("room", options={"mjcf": "room.xml"})
    one.robot("a", "woodbot", "mujoco", world="room")
    agents = one.check()
    robot, world = agents["robot/a"], agents["world/room"]
    assert isinstance(robot, Robot)
    assert robot.shared is not None
    assert world.published().keys() == {"can"}
    robot.open()
    try:
        assert robot.sensors["lidar/front"] == pytest.approx(0.07 - 0.00825, abs=2e-3)
        top = robot.parameters.max_wheel_speed
        robot.command = {"wheel/left": top, "wheel/right": top}
        for _ in range(8):
            robot.shared.advance(0.1)
        robot.sense()
        world.step(Tick(8, 0.8, 0.1))
        pushed = vars(world)["can"].pose.x
        assert pushed > 0.12
        assert 0.05 < robot.state["x"] < pushed
    finally:
        robot.close()


def test_a_reset_of_ones_own_is_refused() -> None:
    """It would be called by a verb, and not when the whole world goes back."""
    with pytest.raises(SchemaError, match=r"Mine defines reset\(\).*rewind\(self\)"):
        type("Mine", (Robot,), {"reset": lambda self: None})
