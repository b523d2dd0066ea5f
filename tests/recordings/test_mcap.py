"""MCAP files: read back as CSV, finished after a kill, and refused in a sentence."""

from __future__ import annotations

import importlib
import os
import struct
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rems_net
from rems_net import Experiment, Schema
from rems_net.agents.clock.clock import Clock
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.plan import HERE
from rems_net.defdict import angle, cdr, length, text
from rems_net.errors import ExperimentError, UnknownFieldError
from rems_net.recordings.mcap.reader import FAR, McapFile
from rems_net.recordings.mcap.scan import finish, is_whole
from rems_net.recordings.mcap.writer import McapWriter
from tests.agents.runs import Told, in_one_host, until
from tests.agents.test_determinism import lab as carts, pid_of
from tests.signals import KILL

STATE = Schema("state", {"x": length(), "heading": angle()})
DIARY = Schema("diary", {"what": text()})
GOLDEN = Path(__file__).parents[1] / "golden" / "mcap" / "small.mcap"
KEYS = ("robot/b/state", "robot/a/state", "process/p/diary")


def write(path: Path, ticks: int = 50, dt: float = 0.1) -> McapWriter:
    """A file of two robots and a process, whose writer is open still."""
    file = McapWriter(path)
    fill(file, ticks, dt)
    return file


def fill(file: McapWriter, ticks: int, dt: float = 0.1) -> None:
    file.open({"experiment": '"lab"', "dt": str(dt)})
    file.declare({key: DIARY if "diary" in key else STATE for key in KEYS})
    for n in range(1, ticks + 1):
        state = cdr(STATE).encode(STATE({"x": n / 7, "heading": -n}))
        diary = cdr(DIARY).encode(DIARY({"what": f"tick {n}" + n * "!"}))
        both = {
            "process/p/diary": diary,
            "robot/a/state": state,
            "robot/b/state": state,
        }
        file.add(n, round(n * dt * 1e9), both)
        file.end_tick()


def whole(path: Path, **more: Any) -> Path:
    write(path, **more).close()
    return path


def others(path: Path) -> Any:
    """What the library mcap finds, checksums checked: the number of messages."""
    reader: Any = importlib.import_module("mcap.reader")
    with path.open("rb") as file:
        made = reader.make_reader(file, validate_crcs=True)
        count = sum(1 for _ in made.iter_messages())
        assert made.get_summary().statistics.message_count == count
    return count


def test_mcap_and_csv_read_alike(tmp_path: Path) -> None:
    made = carts()
    made.plans = {k: p for k, p in made.plans.items() if k != "output/log"}
    made.output("rec", "mcap")
    made.run(tmp_path / "a", direct=True, show=Show())
    csv = rems_net.read(tmp_path / "a")
    mcap = rems_net.read(tmp_path / "a" / "run.mcap")
    assert [*mcap] == [*csv] == ["dog", "free", "lead"]
    for name in csv:
        assert [*mcap.table(name)] == [*csv.table(name)]
        for heading, values in csv.table(name).items():
            assert np.array_equal(mcap.table(name)[heading], values), heading
    assert str(mcap["dog"]["state/x"].units) == "m"
    assert repr(mcap.compare()) == repr(csv.compare()) != "[]"
    assert repr(mcap.why("dog", "lead")) == repr(csv.why("dog", "lead"))


def test_a_folder_with_nothing_else(tmp_path: Path) -> None:
    whole(tmp_path / "run.mcap")
    found = rems_net.read(tmp_path)
    assert [*found] == ["a", "b"]
    assert len(found["a"]["state/x"]) == 50
    assert found["process/p"]["diary/what"][1] == "tick 2!!"
    assert found.manifest().experiment == "lab"
    with pytest.raises(UnknownFieldError, match="no recording of 'c'"):
        found["c"]


def test_ports_that_were_written_at_different_ticks(tmp_path: Path) -> None:
    """A column has the value of before; before the first, the default."""
    file = McapWriter(tmp_path / "run.mcap")
    file.open({})
    start = Schema("s", {"x": length(default=9.0)})
    file.declare({"robot/a/state": STATE, "robot/a/command": start})
    for n in (1, 2, 3, 4):
        file.add(n, n * 10**9, {"robot/a/state": cdr(STATE).encode(STATE({"x": n}))})
        if n == 3:
            command = cdr(start).encode(start({"x": 5}))
            file.add(n, n * 10**9, {"robot/a/command": command})
    file.close()
    found = rems_net.read(tmp_path)["a"]
    assert list(found["time"].value) == [1, 2, 3, 4]
    assert list(found["command/x"].value) == [9, 9, 5, 5]


def test_golden(tmp_path: Path) -> None:
    """These bytes are what recordings of today have; later ones still read them.

    Written anew by `python -m tests.recordings.test_mcap`, on purpose only.
    """
    assert whole(tmp_path / "run.mcap", ticks=12).read_bytes() == GOLDEN.read_bytes()


def test_only_chunks_that_hold_a_column_are_read(tmp_path: Path) -> None:
    path = whole(tmp_path / "run.mcap", ticks=100)
    file = McapFile(path)
    assert len(file.chunks) == 11
    assert len([*file.messages("robot/a/state")]) == 11
    data = bytearray(path.read_bytes())
    data[file.chunks[4].at + 60] ^= 1  # a byte in the fifth
    path.write_bytes(data)
    with pytest.raises(ExperimentError, match="checksum of a chunk"):
        [*McapFile(path).messages("robot/a/state")]


@pytest.mark.parametrize(("robots", "chunks"), [(100, 3), (1000, 1)])
def test_chunks_of_many_channels_are_longer(
    tmp_path: Path, robots: int, chunks: int
) -> None:
    """Else their indexes would be a large part of the file, and of a reader."""
    file = McapWriter(tmp_path / "run.mcap")
    file.open({"dt": "0.01"})
    keys = [f"robot/r{i}/state" for i in range(robots)]
    file.declare(dict.fromkeys(keys, STATE))
    state = cdr(STATE).encode(STATE({}))
    for n in range(1, 50_000 // robots + 1):
        file.add(n, n * 10**6, dict.fromkeys(keys, state))
        file.end_tick()
    file.close()
    assert len(McapFile(file.path).chunks) == chunks


def test_sparse_messages_are_read_one_by_one(tmp_path: Path) -> None:
    """Once the checksum of their chunk is known to fit; they are checked as before."""
    path = tmp_path / "run.mcap"
    file = McapWriter(path)
    file.open({"dt": "0.1"})
    long = Schema("diary", {"what": text(max_len=2 * FAR)})
    file.declare({"process/p/diary": long, "robot/a/state": STATE})
    for n in range(1, 31):
        state = cdr(STATE).encode(STATE({"x": n}))
        diary = cdr(long).encode(long({"what": 2 * FAR * "!"}))
        both = {"process/p/diary": diary, "robot/a/state": state}
        file.add(n, n * 10**8, both)
        file.end_tick()
    file.close()
    reader = McapFile(path)
    first, again = ([*reader.messages("robot/a/state")] for _ in range(2))
    assert first == again
    assert sum(len(times) for times, _ in again) == 30
    data = bytearray(path.read_bytes())
    data[data.index(b"!\0") + 2] = 7  # the head of the first state
    path.write_bytes(data)
    with pytest.raises(ExperimentError, match="not at the place in its index"):
        [*reader.messages("robot/a/state")]
    with pytest.raises(ExperimentError, match="checksum of a chunk"):
        [*McapFile(path).messages("robot/a/state")]


# -- killed ------------------------------------------------------------------------


def test_a_killed_writer_leaves_whole_chunks(tmp_path: Path) -> None:
    """Wherever the file is cut, all chunks before the cut are read, and finished."""
    full = whole(tmp_path / "full.mcap")
    reference = McapFile(full)
    data = full.read_bytes()
    ends = [one.at + one.length for one in reference.chunks]
    for cut in sorted(
        {8, 9, 200, *ends, *(e + 5 for e in ends), *(e - 1 for e in ends)}
    ):
        path = tmp_path / f"{cut}.mcap"
        path.write_bytes(data[:cut])
        expected = sum(end <= cut for end in ends)
        assert not is_whole(path)
        if expected:
            seen = McapFile(path)
            assert not seen.whole
            assert len([*seen.messages("robot/a/state")]) == expected
        assert finish(path)
        assert not finish(path)
        file = McapFile(path)
        assert [one.start for one in file.chunks] == [
            one.start for one in reference.chunks[:expected]
        ]
        assert others(path) == 3 * sum(
            len(times) for times, _ in file.messages("robot/a/state")
        ) if expected else others(path) == 0  # fmt: skip


def test_finished_it_has_the_same_bytes(tmp_path: Path) -> None:
    """As if it had been closed where it was killed."""
    killed = write(tmp_path / "killed.mcap", ticks=49)
    data = killed.path.read_bytes()
    (tmp_path / "copy.mcap").write_bytes(data)
    assert finish(tmp_path / "copy.mcap")
    assert (tmp_path / "copy.mcap").read_bytes() == whole(
        tmp_path / "early.mcap", ticks=39
    ).read_bytes()
    killed.close()


def kill_output(clock: Clock, tick: int) -> None:
    until(lambda: clock.tick.n >= tick, 60)
    os.kill(pid_of(clock, "output/rec"), KILL)


def recorded(ticks: int = 80, **more: Any) -> Experiment:
    """Return the carts, and in a process of its own what records them."""
    made = in_one_host(carts(ticks), HERE)
    made.plans = {key: p for key, p in made.plans.items() if p.kind != "output"}
    made.output("rec", "mcap", **more)
    return made


def test_an_output_that_is_started_again_goes_on_in_its_file(tmp_path: Path) -> None:
    told = Told(lambda clock: kill_output(clock, 50))
    result = recorded(restart=1).run(tmp_path / "a", pace=2, show=told)
    path = tmp_path / "a" / "run.mcap"
    assert result.files == [path]
    others(path)
    times = rems_net.read(path)["dog"]["time"].value
    assert times[0] == 0.05
    assert times[-1] == 4.0
    assert np.all(np.diff(times) > 0.04)
    assert 60 < len(times) < 80


#: a limit on the size of files is the disk: in a process of its own, which has no other
FULL = """
import resource, sys
from pathlib import Path
from tests.recordings.test_mcap import McapWriter, fill
hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), hard))
file = McapWriter(Path(sys.argv[1]))
for do in (lambda: fill(file, 60), file.close):
    try:
        do()
    except OSError as error:
        print(error.strerror)
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows has no limit on a file's size")
@pytest.mark.parametrize("part", [0.1, 0.3, 0.5, 0.8, 0.98])
def test_a_full_disk_leaves_a_file_that_opens(tmp_path: Path, part: float) -> None:
    """The end takes the room of the last chunks."""
    size = whole(tmp_path / "full.mcap", ticks=60).stat().st_size
    path = tmp_path / "run.mcap"
    words = [sys.executable, "-B", "-c", FULL, str(path), str(int(size * part))]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.stderr == ""
    assert done.stdout.strip() != ""
    if part < 0.2:  # there is no room for the summary
        assert path.stat().st_size <= size * part
        return
    assert is_whole(path)
    assert 0 < others(path) < 180
    assert path.stat().st_size <= size * part


# -- bad files ---------------------------------------------------------------------


def spoiled(path: Path, how: str) -> None:
    data = bytearray(whole(path).read_bytes())
    if how == "magic":
        data[3] ^= 1
    elif how == "summary":
        data[-200] ^= 1
    elif how == "offset":
        struct.pack_into("<Q", data, len(data) - 28, 2**60)
    elif how == "none":
        struct.pack_into("<Q", data, len(data) - 28, 0)
    path.write_bytes(data)


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("magic", "run.mcap is no MCAP file"),
        ("summary", "run.mcap is damaged: the checksum of its summary does not fit"),
        ("offset", "run.mcap has no summary"),
        ("none", "run.mcap has no summary"),
    ],
)
def test_a_bad_file_is_one_sentence(tmp_path: Path, how: str, said: str) -> None:
    spoiled(tmp_path / "run.mcap", how)
    with pytest.raises(ExperimentError) as caught:
        [*rems_net.read(tmp_path)]
    assert str(caught.value).startswith(said)
    assert str(caught.value).count("\n") == 0


def test_a_compressed_file_says_what_to_do(tmp_path: Path) -> None:
    writer: Any = importlib.import_module("mcap.writer")
    path = tmp_path / "run.mcap"
    with path.open("wb") as stream:
        made = writer.Writer(stream, compression=writer.CompressionType.ZSTD)
        made.start()
        schema = made.register_schema("pose", "jsonschema", b"{}")
        channel = made.register_channel("/pose", "json", schema)
        made.add_message(channel, log_time=1, data=b"{}", publish_time=1)
        made.finish()
    path.write_bytes(path.read_bytes()[:-8])
    with pytest.raises(ExperimentError, match=r"compressed \(zstd\)"):
        finish(path)


def test_whatever_is_changed_in_a_file_is_read_or_refused(tmp_path: Path) -> None:
    """A byte anywhere: no other error than the sentence."""
    path = whole(tmp_path / "run.mcap", ticks=12)
    data = path.read_bytes()
    random = np.random.default_rng(1)
    for _ in range(150):
        changed = bytearray(data)
        changed[random.integers(len(data))] ^= 1 << int(random.integers(8))
        if random.integers(3) == 0:
            del changed[random.integers(len(data)) :]
        path.write_bytes(changed)
        with suppress(ExperimentError):
            found = rems_net.read(tmp_path)
            for name in found:
                assert found[name].table


if __name__ == "__main__":
    GOLDEN.unlink(missing_ok=True)
    whole(GOLDEN, ticks=12)
