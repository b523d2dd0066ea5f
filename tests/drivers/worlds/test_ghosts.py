"""Robots that are elsewhere stand in a world as ghosts: seen, met, and never pushed."""

import filecmp
from collections.abc import Iterator
from contextlib import contextmanager
from math import cos, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rems_net import Experiment, Tick
from rems_net.agents.experiment.again.compared import compare
from rems_net.agents.experiment.again.rebuilt import rebuild
from rems_net.agents.protocol.plan import HERE
from rems_net.agents.robot import combine
from rems_net.agents.runtime import runtime
from rems_net.bodies.body import Body, Box, Part
from rems_net.drivers import emulated
from rems_net.drivers.hardware.woodbot_websocket import OriginalFirmware
from rems_net.errors import ExperimentError
from rems_net.events import Event, listening
from rems_net.scenes.ghost import DEEP
from rems_net.scenes.outline import TOUCH, of_body
from tests.drivers import alone
from tests.drivers.worlds.ghosts import Drive, Near, Tall, Walk
from tests.drivers.worlds.test_shared import DT, each, engines

FOLDER = Path(__file__).parent
#: m ahead of a robot's middle: its lidar, and the nearest point of another's mast
LENS, MAST = 0.00825, 0.02


def lab(driver: str, speed: float = 0.0, **walk: Any) -> Experiment:
    """A robot at the origin that drives ahead, and the ghost of one that comes."""
    made = Experiment("ghosts", dt=DT, duration="2 s", folder=FOLDER)
    made.input("walk", Walk, options=walk)
    made.input("drive", Drive, options={"speed": speed})
    real = {"name": "real", "definition": Tall, "follows": "input/walk"}
    made.world("arena", options={"size": [2.0, 2.0]}, ghosts=[real])
    made.robot("a", Tall, driver, world="arena", command="input/drive")
    return made


@contextmanager
def opened(made: Experiment) -> Iterator[Any]:
    with made.engine() as engine:
        world, a = engine["world/arena"], engine["robot/a"]
        yield engine, world, a


def ghosts(events: list[Event]) -> list[str]:
    return [one.text for one in events if one.kind == "ghost"]


@each
def test_it_is_seen_one_tick_after_its_pose(driver: str) -> None:
    with opened(lab(driver, speed=1.0, start=0.3)) as (engine, world, a):
        for n in range(1, 6):
            engine.step()
            there = n >= 3  # an input is read at its own tick
            wall = 1.0 - a.state["x"] - LENS
            seen = 0.3 - MAST - LENS - a.state["x"] if there else wall
            assert a.sensors["lidar/front"] == pytest.approx(seen, abs=2e-3)
            assert world.real["there"] is there
            # Its own lidar sees the robot, as if it were there.
            mine = world.real_sensors["lidar/front"]
            assert mine == pytest.approx(seen if there else 1.2, abs=2e-3)
        assert world.real["pose/x"] == 0.3
        assert abs(abs(world.real["pose/heading"]) - np.pi) < 1e-9


@each
def test_robots_stop_at_it_and_it_is_never_pushed(driver: str) -> None:
    with opened(lab(driver, speed=6.0, start=0.2)) as (engine, world, a):
        engine.step(80)
        # Their boards are 14 mm ahead of the axles, their wheels 20 mm.
        assert a.state["x"] == pytest.approx(0.2 - 0.04, abs=2e-3)
        assert abs(a.state["heading"]) < 0.1
        assert world.real["pose/x"] == 0.2
        world.reset()
        assert a.state["x"] == pytest.approx(0.0, abs=1e-3)
        assert a.sensors["lidar/front"] == pytest.approx(0.2 - MAST - LENS, abs=2e-3)


@each
def test_one_inside_a_robot_is_reported_once(driver: str) -> None:
    events: list[Event] = []
    made = lab(driver, speed=-3.0, start=0.01)
    with listening(events.append), opened(made) as (engine, _, a):
        engine.step(2)
        before = a.state["x"]
        engine.step()
        # It is not thrown away, and it can drive out.
        assert before - a.state["x"] == pytest.approx(3.0 * 0.02 * DT, abs=1e-3)
        engine.step(60)
        assert a.state["x"] < -0.15
    (text,) = ghosts(events)
    assert "world/arena/real is inside robot/a, at 0.15 s" in text


def test_a_robot_in_a_ghost_cannot_drive_further_into_it() -> None:
    with opened(lab("kinematic", speed=3.0, start=0.03)) as (engine, _, a):
        engine.step(40)
        assert a.state["x"] == pytest.approx(2 * 3.0 * 0.02 * DT, abs=1e-5)


@engines
def test_one_that_comes_pushes_gently(driver: str) -> None:
    """Slower than DEEP in a tick, it is as if a real robot did."""
    with opened(lab(driver, start=0.12, goes=-0.1)) as (engine, _, a):
        before = 0.0
        for _ in range(30):
            engine.step()
            assert abs(a.state["x"] - before) < DEEP
            before = a.state["x"]
        assert a.state["x"] < -0.03


@each
def test_an_old_pose_leaves_it_where_it_was(driver: str) -> None:
    events: list[Event] = []
    made = lab(driver, start=0.5, goes=-0.1, silent=10, again=30)
    with listening(events.append), opened(made) as (engine, world, a):
        engine.step(29)
        assert world.real["pose/x"] == pytest.approx(0.5 - 6 * 0.1 * DT)
        assert world.real["age"] == pytest.approx(1.0)
        seen = world.real["pose/x"] - MAST - LENS
        assert a.sensors["lidar/front"] == pytest.approx(seen, abs=2e-3)
        assert len(ghosts(events)) == 1
        engine.step()
        assert world.real["pose/x"] == pytest.approx(0.5 - 27 * 0.1 * DT)
    assert ghosts(events) == [
        "world/arena/real stays where it is, at 1 s: the pose of input/walk is too old "
        "(max_age)."
    ]


def test_the_same_bytes_in_one_process_two_and_many(tmp_path: Path) -> None:
    def files(how: str) -> Path:
        made = lab("kinematic", start=0.4, goes=-0.1)
        # A real robot's controller reads the lidar of its ghost; this one, too.
        made.process("near", Near, seen="world/arena/real_sensors")
        made.robot("b", Tall, "kinematic", command="process/near")
        made.output("log", "csv")
        made.record = False
        if how == "two":
            for plan in made.plans.values():
                plan.host = plan.world or "rest"
        return Path(made.run(tmp_path / how, direct=how == "direct").folder)

    runs = [files(how) for how in ("direct", "two", "many")]
    names = ["a.csv", "b.csv", "world.arena.csv"]
    for other in runs[1:]:
        same, *different = filecmp.cmpfiles(runs[0], other, names, shallow=False)
        assert same == names, different


def test_a_run_with_a_real_robot_is_repeated_to_the_byte(tmp_path: Path) -> None:
    """Its poses come from the recording of the world, whatever its clock did."""
    pytest.importorskip("websockets", reason="websockets is not installed")
    made = Experiment("real", dt="50 ms", duration="2 s", pace=1, folder=FOLDER)
    real = {"name": "real", "definition": Tall, "follows": "robot/real/state"}
    made.world("arena", options={"size": [2.0, 2.0]}, ghosts=[real])
    made.input("drive", Drive, options={"speed": 3.0}, host=HERE)
    made.robot("a", Tall, "kinematic", world="arena", command="input/drive")
    made.process("near", Near, seen="world/arena/real_sensors", host=HERE)
    with emulated("woodbot-ws") as device:
        made.robot(
            "real",
            Tall,
            "woodbot-ws",
            command="process/near",
            initial={"x": 0.45, "heading": "180 deg"},
            options={"url": device.where},
        )
        result = made.run(tmp_path / "out")
    a, world = result["a"], result["world.arena"]
    there = np.array(world["real/there"], bool)
    assert there.any()
    assert not there[0]
    # Each drove until it saw the other.
    assert world["real/pose/x"][-1] < 0.44
    lidar = np.array(world["real_sensors/lidar/front"])[there]
    gap = np.array(world["real/pose/x"] - a["state/x"])[there]
    assert lidar == pytest.approx(gap - MAST - LENS, abs=2e-3)
    again = compare(rebuild(tmp_path / "out" / "run.mcap", FOLDER))
    assert again.messages > 100
    assert again.differ == 0, again.by_agent()
    assert again.agents["robot/real"] == "played"
    assert again.agents["world/arena"] == "recomputed"


SIDE = st.floats(0.01, 1.0)
PLACE = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-4, 4))


def box(length: float, width: float) -> Any:
    return of_body(Body((Part(Box((length, width, 0.1)), 1.0),), height=0.05))


@given(SIDE, SIDE, SIDE, SIDE, PLACE, PLACE, st.floats(0, 7))
def test_depth_is_the_shortest_way_out(
    a: float, b: float, c: float, d: float, here: Any, there: Any, way: float
) -> None:
    one, other = box(a, b).at(here), box(c, d).at(there)
    depth = one.depth(other)
    assert depth == pytest.approx(other.depth(one))
    assert one.meets(other) == (depth >= TOUCH)
    # No shorter way leads out, whatever its direction.
    x, y, heading = here
    short = 0.9 * depth
    moved = box(a, b).at((x + short * cos(way), y + short * sin(way), heading))
    assert moved.depth(other) >= 0.1 * depth - 1e-9


def test_what_a_ghost_needs() -> None:
    made = Experiment("g", dt=DT, duration="1 s", folder=FOLDER)

    def refused(**ghost: Any) -> str:
        made.plans.clear()
        made.input("drive", Drive)
        try:
            made.world("arena", ghosts=[{"name": "real", **ghost}])
            made.robot("a", "woodbot", "kinematic", world="arena")
            made.check()
        except ExperimentError as error:
            return str(error)
        raise AssertionError(f"{ghost} is taken")

    assert refused(definition="woodbot").endswith(
        "a ghost has no follows; write such as follows = 'robot/real/state'. A ghost "
        "has a name, the definition of its robot, and follows a port with a pose. "
        "(R0223)"
    )
    woodbot = {"definition": "woodbot"}
    assert "which is in world/arena itself" in refused(
        follows="robot/a/state", **woodbot
    )
    assert "nothing gives 'x'" in refused(follows="input/drive", **woodbot)
    assert "there is no 'robot/b'" in refused(follows="robot/b/state", **woodbot)
    assert "follows one port" in refused(follows="robot/*/state", **woodbot)
    assert "Did you mean 'woodbot'" in refused(definition="wodbot", follows="robot/a")
    assert "Did you mean 'max_age'" in refused(
        **woodbot, follows="input/drive", max_ago=1
    )
    names: Any = ["real"]
    with pytest.raises(ExperimentError, match=r"ghosts is \[.real.\]"):
        made.world("b", ghosts=names)


def test_the_state_of_an_unplugged_robot_grows_old() -> None:
    """Its process goes on and repeats it, so the source tick is that of the reading."""
    pytest.importorskip("websockets", reason="websockets is not installed")
    with emulated("woodbot-ws") as device:
        robot: Any = combine(Tall, OriginalFirmware)(
            "real", options={"url": device.where}
        )
        run, command = runtime(robot), {"wheel/left": 1.0, "wheel/right": 1.0}

        def age() -> int:
            """Begin the next tick; return the age after the last one, in ticks."""
            n, source = run.tick.n, run.source_tick
            run.begin(Tick(n + 1, (n + 1) * DT, DT))
            return n - source if source else 1000

        with alone.opened(robot):
            alone.keep(robot, command, lambda: age() <= 1)
            device.order("unplug 1.5")
            alone.keep(robot, command, lambda: age() >= 25)
            alone.keep(robot, command, lambda: age() <= 1)
