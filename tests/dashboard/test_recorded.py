"""A recording for the page: read at any time, in little memory, without its code."""

from __future__ import annotations

import json
import random
import tracemalloc
from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment, Schema
from rems_net.dashboard.recorded.player import Player, Wish, read_wish
from rems_net.dashboard.recorded.runs import RecordedRuns
from rems_net.dashboard.recorded.scenes import scenes_of
from rems_net.defdict import array, cdr, length
from rems_net.errors import ExperimentError, WireError
from rems_net.packing import unpack
from rems_net.recordings.manifest import Manifest, Start
from rems_net.recordings.mcap import access
from rems_net.recordings.mcap.reader import McapFile
from rems_net.recordings.mcap.writer import McapWriter
from tests.cli.recorded import recorded
from tests.commands import inside
from tests.dashboard.recordings import recording

SMALL = Schema("small", {"x": length(), "y": length()})
LARGE = Schema("large", {"all": array(500)})
KEYS = {"robot/a/state": SMALL, "robot/b/state": SMALL, "process/p/value": LARGE}


def written(path: Path, seconds: int, experiment: str = "lab") -> Path:
    """Write 50 ticks a second; `b` writes at every seventh of the first half."""
    file = McapWriter(path)
    file.open({"experiment": json.dumps(experiment), "dt": "0.02"})
    file.declare(KEYS)
    heavy = cdr(LARGE).encode(LARGE())
    for n in range(1, seconds * 50 + 1):
        state = cdr(SMALL).encode(SMALL({"x": n / 100}))
        found = {"robot/a/state": state, "process/p/value": heavy}
        if n % 7 == 0 and n < seconds * 25:
            found["robot/b/state"] = state
        file.add(n, n * 20_000_000, found)
        file.end_tick()
    file.close()
    return path


def shown(player: Player, **wish: Any) -> dict[int, tuple[int, Any]]:
    """The newest tick and value of each channel after a request."""
    frame = player.frame(0.0, Wish(**wish), frozenset())
    return {
        number: (
            unpack(stamp, longest_list=2, largest_map=0)[0],
            unpack(payload, longest_list=7, largest_map=8),
        )
        for number, (stamp, payload) in frame.values
    }


@pytest.mark.parametrize("cut", [False, True])
@pytest.mark.parametrize("kept", [access.KEPT, 100])
def test_each_jump_shows_the_newest_values_then(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cut: bool, kept: int
) -> None:
    monkeypatch.setattr(access, "KEPT", kept)
    path = written(tmp_path / "run.mcap", 6)
    if cut:  # the last whole chunk is there, and not all of its indexes
        last = McapFile(path).chunks[-1]
        path.write_bytes(path.read_bytes()[: last.at + last.length + 20])
    show = RecordedRuns(path)
    channels = {track.key: track.channel.id for _, track in show.tracks}
    player, draws = Player(show), random.Random(3)
    for n in [300, 1, *draws.sample(range(2, 300), 30)]:
        found = shown(player, t=n * 0.02)
        assert found[0][1][1] == n
        assert found[channels["robot/a/state"]] == (n, {"x": n / 100, "y": 0.0})
        if n >= 7:
            newest = min(n, 149) // 7 * 7
            if player._n != n or channels["robot/b/state"] in found:
                assert found[channels["robot/b/state"]][0] == newest
    show.close()


def test_memory_does_not_grow_with_the_file(tmp_path: Path) -> None:
    path = written(tmp_path / "run.mcap", 100)
    size = path.stat().st_size
    assert size > 20_000_000
    tracemalloc.start()
    show = RecordedRuns(path)
    player, draws = Player(show), random.Random(5)
    for _ in range(20):
        shown(player, t=draws.uniform(0, 100), ports=frozenset(["process/p/value"]))
    player.frame(0.0, Wish(playing=True, pace=10.0), frozenset())
    while player.playing:
        player.frame(1 / 30, Wish(), frozenset())
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    show.close()
    assert most < size / 4


@pytest.mark.parametrize(
    "play",
    [
        *([], {"play": 1}, {"t": "now"}, {"t": -1}, {"t": float("nan")}, {"pace": 0}),
        *({"pace": 1e9}, {"playing": 1}, {"past": 1e6}, {"ports": "all"}),
        {"ports": ["x"] * 65},
    ],
)
def test_a_page_that_asks_for_nonsense_is_refused(play: Any) -> None:
    with pytest.raises(WireError, match=r"R1003"):
        read_wish({"play": play})


def test_what_cannot_be_shown_is_named_in_one_sentence(tmp_path: Path) -> None:
    path = written(tmp_path / "run.mcap", 1)
    other = written(tmp_path / "other.mcap", 1, "maze")
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.mcap").write_text("x,y\n1,2\n", encoding="utf-8")
    (tmp_path / "head.mcap").write_bytes(path.read_bytes()[:40])
    for words, part in (
        (["nothing.mcap"], "there is no file nothing.mcap"),
        (["empty"], "there is no run.mcap in empty"),
        (["text.mcap"], "text.mcap is no MCAP file"),
        (["head.mcap"], "has no values that the page can show"),
        ([str(path), str(other)], "is a recording of 'maze' with robot/a"),
        ([str(path)] * 3, "3 recordings are named"),
        ([str(path), "--viewers"], "--viewers is for a run"),
        ([str(path), "--at", "7450"], "--at is for a run"),
    ):
        done = inside("dashboard", *words, folder=tmp_path)
        assert done.returncode == 2
        assert part in done.stderr
        assert len(done.stderr.splitlines()) == 1, done.stderr


def test_a_damaged_part_is_a_sentence(tmp_path: Path) -> None:
    path = written(tmp_path / "run.mcap", 4)
    show = RecordedRuns(path)
    data = bytearray(path.read_bytes())
    chunk = McapFile(path).chunks[2]
    data[chunk.at + 60 : chunk.at + chunk.length] = bytes(chunk.length - 60)
    path.write_bytes(data)
    player = Player(show)
    shown(player, t=1.0)
    with pytest.raises(ExperimentError, match=r"run\.mcap is damaged.*R0805"):
        shown(player, t=2.5)
    show.close()


def test_a_place_is_drawn_without_the_run(tmp_path: Path) -> None:
    lab = Experiment("hall", dt=0.05, duration=0.2)
    crate = {"name": "crate", "size": [0.1, 0.1, 0.1], "x": 0.5, "mass": 0.1}
    lab.world("hall", options={"size": [2.0, 1.0], "boxes": [crate]})
    lab.robot("bot", "woodbot", "kinematic", world="hall")
    lab.world("ring")
    lab.robot("sim", "woodbot", "kinematic", world="ring")
    show = RecordedRuns(recorded(lab, tmp_path / "run"))
    hall, ring = show.scenes["world/hall"], show.scenes["world/ring"]
    assert len(hall["walls"]) == 4
    assert [one["name"] for one in hall["things"]] == ["crate"]
    assert ring["radius"] > 0
    bot = show.scenes["robot/bot"]
    assert bot["made_of"] == "Woodbot"
    assert len(bot["outline"]) > 3
    assert "arena" not in bot
    show.close()


def test_no_code_of_a_recording_runs(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("open('ran', 'w').close()\n", encoding="utf-8")
    agents = {"robot": [{"name": "sim", "definition": "mine.py:Bot"}]}
    ray = [0.1, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0]
    start = Start(0.0, {}, 0.4, "0,0 1,0 0,1", "", {"lidar": ray})
    told = Manifest("lab", {"sim": start}, agents=agents)
    scene = scenes_of(told)["robot/sim"]
    assert scene["made_of"] == "Bot"
    assert scene["outline"] == [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
    assert scene["arena"] == {"radius": 0.4}
    assert scene["rays"][0]["reach"] == 2.0
    assert not (tmp_path / "ran").exists()


def test_two_recordings_of_one_name_are_told_apart(tmp_path: Path) -> None:
    for name in ("monday", "tuesday"):
        (tmp_path / name).mkdir()
        recording(tmp_path / name)
    show = RecordedRuns(tmp_path / "monday/run.mcap", tmp_path / "tuesday/run.mcap")
    assert show.recording()["name"] == "monday and tuesday"
    assert show.agents == ["input/curve", "robot/sim", "robot/sim (tuesday)"]
    assert show.scenes["robot/sim (tuesday)"]["ghost"] == "robot/sim"
    show.close()
