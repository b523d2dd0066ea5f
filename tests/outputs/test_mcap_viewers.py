"""What an MCAP file has for viewers: events, and points that rays have hit."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.plan import HERE
from rems_net.client import join
from rems_net.recordings.mcap.reader import McapFile
from tests.agents.runs import Told, in_one_host, until
from tests.agents.test_determinism import lab as carts
from tests.engine.callers import Referee, Sled
from tests.outputs.test_mcap import decoded, late, record

EVENTS = "/rems/events"
PARTS = Path(__file__).parents[1] / "engine"


def told(path: Path) -> list[tuple[float, int, str, str]]:
    """Time [s], level, agent and text of each event."""
    rows = []
    for time, said in decoded(path, EVENTS):
        stamp = said.stamp.sec * 10**9 + said.stamp.nanosec
        assert stamp == time
        rows.append((time / 1e9, said.level, said.name, said.msg))
    return rows


def sleds() -> Experiment:
    """Two sleds; one joins later, and the other one is put back by a process."""
    lab = Experiment("sleds", dt=0.1, duration=1.0, folder=PARTS)
    lab.robot("a", Sled, "kinematic", initial={"x": 0.28})
    lab.robot("b", Sled, "kinematic", since=0.5)
    lab.process("ref", Referee, sled="robot/a/state")
    return lab


def test_calls_and_joins_are_the_same_however_it_is_run(tmp_path: Path) -> None:
    engine = record(sleds(), tmp_path / "engine", direct=True)
    assert record(in_one_host(sleds(), HERE), tmp_path / "hosts") == engine
    found = told(tmp_path / "engine" / "run.mcap")
    assert (0.6, 20, "robot/b", "joined") in found
    calls = [row for row in found if row[2] == "process/ref"]
    assert calls[0][0] == 0.1
    assert calls[0][3].startswith("called robot/a.put(0.01")
    assert "/rems/events" not in McapFile(tmp_path / "hosts" / "run.mcap").passed


def test_stop_and_release(tmp_path: Path) -> None:
    lab = carts()
    with lab.engine(tmp_path) as engine:
        engine.step(10)
        engine.stop()
        engine.step(5)
        engine.release()
        engine.step(1)
    assert told(tmp_path / "run.mcap") == [
        (0.55, 30, "clock", "STOP: every robot holds its safe command"),
        (0.8, 20, "clock", "released"),
    ]


def test_stop_of_a_person_is_in_the_file(tmp_path: Path) -> None:
    """At the tick from which all hosts hold their robots."""

    def stop(clock: Clock) -> None:
        until(lambda: clock.tick.n >= 10, 60)
        with join() as fabric:
            fabric.stop()
            until(lambda: clock.tick.n >= 30, 60)
            fabric.release()

    made = in_one_host(carts(100), HERE)
    made.plans["robot/dog"].host = "process"
    made.plans["output/csv"].host = made.plans["output/log"].host = "outputs"
    made.run(tmp_path, pace=2, show=Told(stop))
    stopped, released = told(tmp_path / "run.mcap")
    assert stopped[1:3] == (30, "clock")
    assert 0.5 < stopped[0] <= 1.5 < released[0]
    assert released[3] == "released"


def test_robots_that_come_later_are_events(tmp_path: Path) -> None:
    record(late(carts()), tmp_path, direct=True)
    assert told(tmp_path / "run.mcap") == [
        (1.05, 20, "robot/lead", "joined"),
        (1.55, 20, "robot/late", "joined"),
    ]


def test_rays_are_points(tmp_path: Path) -> None:
    """Those that hit, in the frame of the robot, which `/tf` places."""
    lab = Experiment("rays", dt=0.1, duration=0.5)
    lab.robot("sim", "woodbot", "kinematic", initial={"x": 0.3})
    record(lab, tmp_path, direct=True)
    path = tmp_path / "run.mcap"
    seen = decoded(path, "/robot/sim/sensors")
    clouds = decoded(path, "/robot/sim/sensors/points")
    assert len(seen) == len(clouds) == 5
    for (_, sensors), (time, cloud) in zip(seen, clouds, strict=True):
        stamp = cloud.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == time
        assert (cloud.header.frame_id, cloud.height, cloud.width) == ("sim", 1, 2)
        assert [one.name for one in cloud.fields] == ["x", "y", "z"]
        points = np.frombuffer(bytes(cloud.data), "<f4").reshape(-1, 3)
        front, right = sensors.lidar.front, sensors.lidar.right
        expected = [[0.00825 + front, 0, 0.0063], [-0.03575, -right, 0.0063]]
        assert np.allclose(points, expected, atol=1e-6)


def test_their_types_are_those_of_ros(tmp_path: Path) -> None:
    """To the hash by which ROS 2 compares types, and to the byte."""
    lab = Experiment("types", dt=0.1, duration=0.4)
    lab.robot("sim", "epuck_camera", "kinematic", initial={"x": 0.3})
    lab.robot("late", "woodbot", "kinematic", since=0.2)
    record(lab, tmp_path, direct=True)
    bags: Any = importlib.import_module("rosbags.highlevel")
    types: Any = importlib.import_module("rosbags.typesys")
    store = types.get_typestore(types.Stores.ROS2_HUMBLE)
    names = set()
    with bags.AnyReader([tmp_path / "run.mcap"]) as bag:
        for channel, _, raw in bag.messages():
            name = channel.msgtype
            value = bag.deserialize(raw, name)
            assert bytes(bag.typestore.serialize_cdr(value, name)) == raw
            if not name.startswith("rems_msgs/"):
                names.add(name)
                theirs = store.hash_rihs01(name)
                assert bag.typestore.hash_rihs01(name) == theirs, name
    assert names == {
        "rcl_interfaces/msg/Log",
        "sensor_msgs/msg/CompressedImage",
        "sensor_msgs/msg/PointCloud2",
        "tf2_msgs/msg/TFMessage",
    }


def test_many_robots_have_no_points(tmp_path: Path) -> None:
    """They would be most of the file."""
    lab = Experiment("many", dt=0.1, duration=0.1)
    for i in range(21):
        lab.robot(f"r{i}", "woodbot", "kinematic")
    lab.run(tmp_path, direct=True, show=Show())
    file: Any = importlib.import_module("mcap.reader")
    with (tmp_path / "run.mcap").open("rb") as stream:
        channels = file.make_reader(stream).get_summary().channels.values()
    assert not [one.topic for one in channels if one.topic.endswith("/points")]


def test_an_experiment_without_a_recording(tmp_path: Path) -> None:
    lab = carts(5)
    lab.record = False
    lab.run(tmp_path, direct=True, show=Show())
    assert not (tmp_path / "run.mcap").exists()


@pytest.mark.parametrize("direct", [True, False])
def test_an_output_called_recorder(tmp_path: Path, direct: bool) -> None:
    """And a second run of the same experiment."""
    lab = Experiment("named", dt=0.1, duration=0.2)
    lab.robot("sim", "epuck", "kinematic", host=HERE)
    lab.output("recorder", "csv", host=HERE)
    for i in range(2):
        out = tmp_path / str(i)
        result = lab.run(out, direct=direct, show=Show())
        assert result.files == [out / "sim.csv", out / "run.mcap"]
    assert [*lab.plans] == ["robot/sim", "output/recorder", "output/recorder_"]
