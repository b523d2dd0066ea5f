"""McapOutput: the whole run in one file, the same bytes however it is run."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rems_net
from rems_net import Experiment, In, Input, Out, Process, Schema, Woodbot
from rems_net.agents.clock.clock import Clock
from rems_net.agents.experiment.show import Show
from rems_net.agents.host.outlet import CROWD
from rems_net.agents.protocol.plan import HERE
from rems_net.agents.protocol.terms import Wait
from rems_net.agents.tick import Tick
from rems_net.defdict import (
    Batch,
    array,
    boolean,
    cdr,
    choice,
    integer,
    many,
    number,
    text,
)
from rems_net.errors import AgentError
from rems_net.outputs.mcap import McapOutput
from rems_net.pictures import is_picture, pixels
from rems_net.recordings.mcap import derived
from rems_net.recordings.mcap.derived import FEW, Poses
from rems_net.recordings.mcap.reader import McapFile
from tests.agents.runs import KEPT, Router, Told, in_one_host, until
from tests.agents.test_determinism import in_a_few, lab as carts

ODD = Schema(
    "odd",
    {
        "zeta": integer(),
        "joint/1": number("deg"),
        "on": boolean(),
        "mode": choice("slow", "fast"),
        "say": text(),
        "arm": array((2, 2), "rad"),
        "spots": many(Schema("spot", {"y": number(), "x": number()})),
    },
)


class McapWords(Input):
    """Says something of every kind."""

    value = Out(ODD)

    def read(self, tick: Tick) -> dict[str, Any]:
        n = tick.n
        return {
            "zeta": n,
            "joint/1": n / 7,
            "on": n % 2 == 0,
            "mode": "fast" if n % 3 else "slow",
            "say": f"tick {n}, 'quoted'",
            "arm": [[n, 2.0], [3.0, -n]],
            "spots": [{"y": 1.0, "x": float(i)} for i in range(n % 4)],
        }


def summary(path: Path) -> Any:
    """What the library mcap finds, all checksums checked."""
    reader: Any = importlib.import_module("mcap.reader")
    with path.open("rb") as file:
        made = reader.make_reader(file, validate_crcs=True)
        count = sum(1 for _ in made.iter_messages())
        found = made.get_summary()
    assert count == found.statistics.message_count
    return found


def record(made: Experiment, out: Path, **more: Any) -> bytes:
    made.plans = {key: p for key, p in made.plans.items() if p.kind != "output"}
    made.output("rec", "mcap")
    made.run(out, show=Show(), **more)
    return (out / "run.mcap").read_bytes()


def test_the_same_bytes_in_the_engine_in_one_host_and_in_many(tmp_path: Path) -> None:
    engine = record(carts(), tmp_path / "engine", direct=True)
    assert record(in_one_host(carts()), tmp_path / "one") == engine
    several = carts()
    in_a_few(several)
    assert record(several, tmp_path / "few") == engine
    found = summary(tmp_path / "engine" / "run.mcap")
    assert found.statistics.message_count == 9 * 60
    assert [one.topic for one in found.channels.values()] == [
        "/input/wave/value",
        "/process/follow/command",
        "/robot/dog/command",
        "/robot/dog/state",
        "/robot/free/command",
        "/robot/free/state",
        "/robot/lead/command",
        "/robot/lead/state",
        "/tf",
    ]


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_five_times_in_a_process_for_each(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """tests/agents/test_determinism.py does it once, and compares all files."""
    reference = record(carts(), tmp_path / "engine", direct=True)
    monkeypatch.setenv("PARTS_SLEEP", "0.005")
    for i in range(5):
        assert record(carts(), tmp_path / str(i)) == reference


def test_an_engine_on_request_records_the_same(tmp_path: Path) -> None:
    made = carts()
    reference = record(made, tmp_path / "run", direct=True)
    (tmp_path / "engine").mkdir()
    with made.engine(tmp_path / "engine") as engine:
        engine.run()
    assert (tmp_path / "engine" / "run.mcap").read_bytes() == reference


def test_a_port_that_is_named_and_an_agent(tmp_path: Path) -> None:
    """Instead of all of a kind; the same bytes in a process of its own."""
    found = []
    for direct in (True, False):
        made = in_one_host(carts(20), HERE)
        made.plans = {key: p for key, p in made.plans.items() if p.kind != "output"}
        none = "process/nobody*/*"
        made.output(
            "rec",
            "mcap",
            robots="robot/lead/state",
            inputs="input/wave",
            processes=none,
        )
        made.run(tmp_path / str(direct), direct=direct, show=Show())
        path = tmp_path / str(direct) / "run.mcap"
        assert [*McapFile(path).channels] == ["input/wave/value", "robot/lead/state"]
        found.append(path.read_bytes())
    assert found[0] == found[1]


def late(made: Experiment) -> Experiment:
    made.plans["robot/lead"].since = 21
    made.robot("late", "parts.py:Cart", "parts.py:Euler", since=1.5, every=2)
    return made


def test_robots_that_come_later_and_step_less_often(tmp_path: Path) -> None:
    engine = record(late(carts()), tmp_path / "engine", direct=True)
    assert record(in_one_host(late(carts()), HERE), tmp_path / "few") == engine
    counts = {
        one.topic: summary(tmp_path / "few" / "run.mcap")
        .statistics.channel_message_counts[one.id]
        for one in summary(tmp_path / "few" / "run.mcap").channels.values()
    }  # fmt: skip
    assert counts["/robot/lead/state"] == 40
    assert counts["/robot/late/state"] == 15
    assert counts["/robot/dog/state"] == 60


def test_physics_is_the_same_when_pinned(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")

    def made() -> Experiment:
        lab = Experiment("physics", dt=0.05, duration=0.5, folder=tmp_path)
        lab.input("words", "csv", options={"file": "keys.csv"})
        lab.robot("sim", "woodbot", "mujoco", command="input/words")
        return lab

    keys = "time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]\n1,3,2\n"
    (tmp_path / "keys.csv").write_text(keys, encoding="utf-8")
    first = record(made(), tmp_path / "a")
    assert record(in_one_host(made()), tmp_path / "b") == first


def test_the_first_record_is_the_experiment(tmp_path: Path) -> None:
    record(carts(), tmp_path / "a", direct=True)
    file: Any = importlib.import_module("mcap.stream_reader")
    with (tmp_path / "a" / "run.mcap").open("rb") as stream:
        records = iter(file.StreamReader(stream).records)
        head, first = next(records), next(records)
    assert (head.profile, head.library) == ("ros2", "rems_net")
    told = {name: json.loads(words) for name, words in first.metadata.items()}
    written = json.loads((tmp_path / "a" / "run.json").read_text(encoding="utf-8"))
    assert first.name == "rems:experiment"
    assert told == {name: written[name] for name in told}
    words = {"experiment", "dt", "ticks", "seed", "agents", "robots", "worlds"}
    assert told.keys() == {*words, "sources", "versions", "fields"}
    assert told["ticks"] == 60
    assert [*told["sources"]] == ["parts.py"]
    assert len(told["sources"]["parts.py"]) == 64
    assert told["versions"] == {"rems_net": rems_net.__version__}
    assert (told["dt"], told["experiment"]) == (0.05, "same")


def test_every_kind_of_field_is_read_by_others_and_by_us(tmp_path: Path) -> None:
    made = Experiment("odd", dt=0.3, duration=3)
    made.input("words", McapWords)
    record(made, tmp_path / "a", direct=True)
    path = tmp_path / "a" / "run.mcap"
    reader: Any = importlib.import_module("mcap.reader")
    ros2: Any = importlib.import_module("mcap_ros2.decoder")
    with path.open("rb") as file:
        factories = [ros2.DecoderFactory()]
        read = reader.make_reader(file, decoder_factories=factories)
        rows = [
            (one.log_time, said) for _, _, one, said in read.iter_decoded_messages()
        ]
    assert [time for time, _ in rows] == [300_000_000 * n for n in range(1, 11)]
    for n, (_, said) in enumerate(rows, 1):
        assert (said.zeta, said.joint.n1, said.on) == (n, n / 7, n % 2 == 0)
        assert (said.mode, said.say) == (
            "fast" if n % 3 else "slow",
            f"tick {n}, 'quoted'",
        )
        assert list(said.arm) == [n, 2.0, 3.0, -n]
        assert [(s.y, s.x) for s in said.spots] == [(1.0, i) for i in range(n % 4)]
    bags: Any = importlib.import_module("rosbags.highlevel")
    with bags.AnyReader([path]) as bag:
        theirs = [bag.deserialize(raw, c.msgtype) for c, _, raw in bag.messages()]
    assert [(one.zeta, one.joint.n1) for one in theirs] == [
        (n, n / 7) for n in range(1, 11)
    ]
    ours = rems_net.read(path)["input/words"]
    assert list(ours["value/zeta"]) == list(range(1, 11))
    assert ours["value/joint/1"].to_value("deg")[1] == 2 / 7
    assert list(ours["value/arm[1][1]"].value) == [-n for n in range(1, 11)]
    assert ours["value/say"][3] == "tick 4, 'quoted'"
    assert ours["value/on"].dtype == bool


def decoded(path: Path, topic: str) -> list[tuple[int, Any]]:
    """Times [ns] and messages of a topic, by the library mcap-ros2-support."""
    reader: Any = importlib.import_module("mcap.reader")
    ros2: Any = importlib.import_module("mcap_ros2.decoder")
    with path.open("rb") as file:
        read = reader.make_reader(file, decoder_factories=[ros2.DecoderFactory()])
        found = read.iter_decoded_messages(topics=[topic])
        return [(one.log_time, said) for _, _, one, said in found]


def test_few_poses_have_the_bytes_of_many(monkeypatch: pytest.MonkeyPatch) -> None:
    schema = Woodbot.state.schema
    keys = [f"robot/{'r' * i}/state" for i in range(1, FEW + 1)]
    states = [schema({"x": i / 7, "y": -i, "heading": i**9}) for i in range(FEW)]
    batch = Batch(dict(zip(keys, map(cdr(schema).encode, states), strict=True)))
    few = Poses(dict.fromkeys(keys, schema))(batch, 12_345_678_901)
    monkeypatch.setattr(derived, "FEW", 0)
    assert few == Poses(dict.fromkeys(keys, schema))(batch, 12_345_678_901)


def test_poses_are_transforms(tmp_path: Path) -> None:
    """Of all robots with x, y and heading, in their order, as viewers draw them."""
    record(late(carts()), tmp_path / "a", direct=True)
    path = tmp_path / "a" / "run.mcap"
    ours = rems_net.read(path)
    said = decoded(path, "/tf")
    assert len(said) == 60
    for time, message in said:
        names = [one.child_frame_id for one in message.transforms]
        n = round(time / 50_000_000)
        there = [
            "dog",
            "free",
            *["late"] * (n > 30 and n % 2 == 0),
            *["lead"] * (n > 20),
        ]
        assert names == there
        for one in message.transforms:
            columns, stamp = ours[one.child_frame_id], one.header.stamp
            row = [*columns["time"].value].index(n / 20)
            x, y = (columns[f"state/{name}"].value[row] for name in "xy")
            heading = columns["state/heading"].value[row]
            assert (one.header.frame_id, stamp.sec * 10**9 + stamp.nanosec) == (
                "world",
                time,
            )
            move, turn = one.transform.translation, one.transform.rotation
            assert (move.x, move.y, move.z, turn.x, turn.y) == (x, y, 0, 0, 0)
            assert (turn.z, turn.w) == pytest.approx(
                (np.sin(heading / 2), np.cos(heading / 2)), abs=1e-15
            )
    bags: Any = importlib.import_module("rosbags.highlevel")
    with bags.AnyReader([path]) as bag:
        (channel,) = (c for c in bag.connections if c.topic == "/tf")
        _, _, raw = next(bag.messages([channel]))
        theirs = bag.deserialize(raw, channel.msgtype)
    assert [one.child_frame_id for one in theirs.transforms] == ["dog", "free"]
    assert "/tf" not in McapFile(path).passed


def test_pictures_are_png(tmp_path: Path) -> None:
    """Beside the numbers, of which they lose nothing."""
    made = Experiment("dark", dt=0.1, duration=0.4)
    made.robot("bot", "epuck_camera", "kinematic")
    record(made, tmp_path / "a", direct=True)
    path = tmp_path / "a" / "run.mcap"
    file = McapFile(path)
    schema = file.schemas["robot/bot/sensors"]
    ((_, raw),) = file.messages("robot/bot/sensors")
    (name,) = [path for path, one in schema.rows() if is_picture(one)]
    images = decoded(path, f"/robot/bot/sensors/{name}/png")
    assert len(images) == len(raw) == 4
    for (_, image), message in zip(images, raw, strict=True):
        assert (image.format, image.header.frame_id) == ("png", "robot/bot/sensors")
        value = cdr(schema).decode(message)
        assert np.array_equal(pixels(bytes(image.data)), value[name])
    assert all(name not in column for column in rems_net.read(path)["bot"])


def test_a_file_that_is_there_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "run.mcap").write_bytes(b"mine")
    made = McapOutput("rec", out=tmp_path)
    made.prepare()
    made.__dict__ |= {name: _none() for name in made.ins()}
    made.open()
    with pytest.raises(AgentError, match=r"run\.mcap is there already"):
        made.write(Tick(1, 0.1, 0.1))
    made.close()
    assert (tmp_path / "run.mcap").read_bytes() == b"mine"


def test_a_folder_that_is_gone_is_a_sentence(tmp_path: Path) -> None:
    made = McapOutput("rec", out=tmp_path / "gone")
    made.prepare()
    made.__dict__ |= {name: _none() for name in made.ins()}
    made.open()
    with pytest.raises(AgentError) as caught:
        made.write(Tick(1, 0.1, 0.1))
    said = f"output/rec: cannot write {tmp_path / 'gone' / 'run.mcap'}: No such file"
    assert str(caught.value).startswith(said)
    made.close()


def test_more_channels_than_a_file_has_is_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file has those that there is room for, and opens."""
    monkeypatch.setattr("rems_net.recordings.mcap.writer.MOST", 3)
    with pytest.raises(AgentError, match="it would have more than 3 channels"):
        record(carts(), tmp_path / "a", direct=True)
    assert len(summary(tmp_path / "a" / "run.mcap").channels) == 3


def _none() -> Any:
    from rems_net.agents.ports import Messages

    return Messages()


def crowd() -> Experiment:
    """Robots of which many are alike, and some step less often."""
    lab = Experiment("crowd", dt=0.1, duration=1.2)
    for i in range(60):
        lab.robot(f"bot{i}", "woodbot", "kinematic", host="process" if i % 2 else HERE)
    lab.robot("late", "woodbot", "kinematic", every=5, host=HERE)
    lab.robot("other", "epuck", "kinematic", host="process")
    return lab


class Seldom(Input):
    """Sets its value at every third tick: in between it grows old."""

    value = Out(Schema("seldom", {"x": number()}))

    def read(self, tick: Tick) -> dict[str, float] | None:
        return None if tick.n % 3 else {"x": tick.t}


class Near(Process):
    """Reads one robot of a crowd by its name."""

    robot = In()
    value = Out(Schema("near", {"x": number("m")}))

    def step(self, tick: Tick) -> None:
        self.value.x = self.robot.x


def swarm(ticks: int = 40) -> Experiment:
    """A host whose values come in one message, and others that read them."""
    lab = Experiment("swarm", dt=0.1, duration=ticks * 0.1)
    for i in range(9):
        lab.input(f"in{i}", Seldom, host="swarm")
    for i in range(CROWD + 20):
        more: dict[str, Any] = {"every": 5} if i == 8 else {}
        more |= {"since": 1.1} if i == 9 else {}
        lab.robot(f"bot{i}", "woodbot", "kinematic", host="swarm", **more)
    lab.robot("apart", "epuck", "kinematic", host=HERE)
    lab.process("near", Near, robot="robot/bot7/state", host=HERE)
    return lab


@pytest.mark.timeout(300)
def test_a_crowd_of_which_messages_are_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same bytes as in the engine, in a recorder and in CSV files."""

    def recorded(out: Path, **more: Any) -> dict[str, bytes]:
        made = swarm()
        made.wait = Wait(back=KEPT)
        made.output("rec", "mcap")
        made.output("csv", "csv")
        made.run(out, **more)
        files = [*out.glob("*.csv"), out / "run.mcap"]
        return {path.name: path.read_bytes() for path in files}

    def restart(clock: Clock) -> None:
        until(lambda: clock.tick.n >= 12, 60)
        router.kill()
        router.start()

    engine = recorded(tmp_path / "engine", direct=True)
    assert len(engine) == CROWD + 20 + 2
    with Router() as router:
        monkeypatch.setenv("REMS_ROUTER", router.endpoint)
        assert recorded(tmp_path / "hosts", show=Told(restart)) == engine


def test_a_crowd_has_the_bytes_of_single_messages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the engine, and from other processes."""
    rows = record(crowd(), tmp_path / "rows", direct=True)
    assert record(crowd(), tmp_path / "hosts") == rows
    monkeypatch.setattr("rems_net.engine.recorded.MANY", 1000)
    assert record(crowd(), tmp_path / "single", direct=True) == rows
    assert summary(tmp_path / "rows" / "run.mcap").statistics.channel_count > 180
