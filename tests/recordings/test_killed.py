"""A process of a run is killed at any moment: every whole second is in the file."""

from __future__ import annotations

import errno
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

import rems_net
from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.protocol.plan import HERE
from rems_net.cli import main
from rems_net.errors import AgentError
from rems_net.recordings.mcap.reader import McapFile
from rems_net.recordings.mcap.scan import is_whole
from tests.agents.runs import Told, until
from tests.agents.test_determinism import lab as carts, pid_of
from tests.commands import fetched
from tests.recordings.test_mcap import others, write
from tests.signals import KILL, KILLED

#: ticks of a second
SECOND = 20
HOSTS = (
    *("input/wave", "robot/lead", "robot/free", "robot/dog", "process/follow"),
    "output/recorder",
)


def recorded(ticks: int, *hosts: str) -> Experiment:
    """Return the carts without other outputs: the recorder has its own process.

    hosts: of robots and others, those that have a process, too; at least one.
    """
    made = carts(ticks)
    made.plans = {key: p for key, p in made.plans.items() if p.kind != "output"}
    for key, plan in made.plans.items():
        plan.host = key if key in hosts else HERE
    return made


def check(path: Path, least: int) -> None:
    """Check that a file is whole, and has all ticks from the first to at least one."""
    assert is_whole(path)
    assert others(path) >= 9 * least
    times = rems_net.read(path)["dog"]["time"].value if least else np.array([])
    assert np.array_equal(times, np.arange(1, len(times) + 1) / SECOND)
    assert len(times) >= least


def kill_at(host: str, tick: int, seen: list[int]) -> Callable[[Clock], None]:
    def kill(clock: Clock) -> None:
        until(lambda: clock.tick.n >= tick, 60)
        seen.append(clock.done)
        os.kill(pid_of(clock, host), KILL)

    return kill


def end_with(folder: Path, host: str, tick: int) -> None:
    """Kill a host at a tick, and check what its run has left."""
    seen: list[int] = []
    told = Told(kill_at(host, tick, seen))
    with pytest.raises(AgentError, match=KILLED):
        recorded(100, "robot/dog", host).run(folder, pace=4, show=told)
    if host.startswith("output"):
        (said,) = told.of("exit")
        assert said.startswith("run.mcap was left without its end; it has one now")
    (done,) = seen
    # The tick at a full second is the first of the next chunk.
    check(folder / "run.mcap", max(0, done // SECOND * SECOND - 1))


@pytest.mark.parametrize("host", ["output/recorder", "robot/lead"])
def test_a_host_is_killed(tmp_path: Path, host: str) -> None:
    end_with(tmp_path / "a", host, Random(host).randint(SECOND, 2 * SECOND))


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_any_host_at_fifty_moments(tmp_path: Path) -> None:
    random = Random(24)
    for i in range(50):
        end_with(tmp_path / str(i), HOSTS[i % len(HOSTS)], random.randint(1, 90))
        shutil.rmtree(tmp_path / str(i))


RUN = """
import sys
from pathlib import Path
from tests.recordings.test_killed import recorded
if __name__ == "__main__":
    recorded(2000, "robot/dog").run(Path(sys.argv[1]), pace=4)
"""


def test_the_run_itself_is_killed(tmp_path: Path) -> None:
    """Its hosts end within two seconds, and close the file."""
    script = tmp_path / "run.py"
    script.write_text(RUN, encoding="utf-8")
    path = tmp_path / "out" / "run.mcap"
    root = str(Path(__file__).parents[2])
    process = subprocess.Popen(
        [sys.executable, str(script), str(path.parent)],
        env={**os.environ, "PYTHONPATH": root},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        until(lambda: path.is_file() and path.stat().st_size > 20_000, 60)
    finally:
        process.kill()
        process.wait()
    until(lambda: is_whole(path), 20)
    check(path, SECOND - 1)


# -- a power cut -------------------------------------------------------------------


def test_repair(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "run.mcap"
    write(path, ticks=55).close()
    path.write_bytes(path.read_bytes()[:-3000])
    assert main(["repair", str(tmp_path)]) == 0
    count = others(path)
    said = f"{path} has an end now: it has {count} values, until 4.9 s.\n"
    assert capsys.readouterr().out == said
    assert main(["repair", str(path)]) == 0
    whole = f"{path} is whole: it has {count} values, until 4.9 s.\n"
    assert capsys.readouterr().out == whole


def test_what_cannot_be_repaired(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["repair", str(tmp_path / "no.mcap")]) == 2
    assert capsys.readouterr().err == (
        f"rems: there is no file {tmp_path / 'no.mcap'}; expected a recording, such as "
        "runs/lab/run.mcap. (R0803)\n"
    )
    (tmp_path / "run.mcap").write_text("time [s]")
    assert main(["repair", str(tmp_path)]) == 2
    assert "run.mcap is no MCAP file" in capsys.readouterr().err
    write(tmp_path / "other.mcap", ticks=55).close()
    data = (tmp_path / "other.mcap").read_bytes()
    theirs = data.replace(b"rems_net", b"rosbag_2", 1)
    (tmp_path / "run.mcap").write_bytes(theirs[:-300])
    assert main(["repair", str(tmp_path)]) == 2
    assert "run.mcap is of another program (rosbag_2)" in capsys.readouterr().err
    assert (tmp_path / "run.mcap").read_bytes() == theirs[:-300]
    at = McapFile(tmp_path / "other.mcap").chunks[1].at + 60
    broken = data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :]
    (tmp_path / "run.mcap").write_bytes(broken)
    assert main(["repair", str(tmp_path)]) == 2
    assert "the checksum of a chunk does not fit" in capsys.readouterr().err
    assert (tmp_path / "run.mcap").read_bytes() == broken


def test_a_damaged_summary_is_written_anew(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every sentence that names `rems repair` is right: it mends this file."""
    path = tmp_path / "run.mcap"
    write(path, ticks=55).close()
    data = path.read_bytes()
    path.write_bytes(data[:-20] + bytes([data[-20] ^ 1]) + data[-19:])
    assert main(["info", str(path)]) == 2
    assert "rems repair" in capsys.readouterr().err
    assert main(["repair", str(path)]) == 0
    assert "has an end now" in capsys.readouterr().out
    assert path.read_bytes() == data


# -- a full disk -------------------------------------------------------------------

FULL = """
import resource, sys
from pathlib import Path
from rems_net.errors import AgentError
from tests.agents.test_determinism import lab
hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, hard))
made = lab(400)
made.plans = {key: p for key, p in made.plans.items() if p.kind != "output"}
try:
    made.run(Path(sys.argv[1]), direct=True)
except AgentError as error:
    print(error)
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows has no limit on a file's size")
def test_a_full_disk_is_a_sentence_and_the_file_opens(tmp_path: Path) -> None:
    """A limit on the size of files is the disk, in a process of its own."""
    words = [sys.executable, "-c", FULL, str(tmp_path)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    path = tmp_path / "run.mcap"
    assert done.stderr == ""
    assert done.stdout in [
        f"output/recorder: cannot write {path}: {why}; make room there, or name "
        "another folder: rems run --out (R0801)\n"
        for why in map(os.strerror, (errno.EFBIG, errno.ENOSPC))
    ]
    assert path.stat().st_size <= 40_000
    check(path, SECOND - 1)


# -- another reader ----------------------------------------------------------------

PACKAGE = "@mcap/core@2.2.2"
COUNT = """
import { McapIndexedReader } from "@mcap/core";
import { open } from "node:fs/promises";
const file = await open(process.argv[2]);
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (at, size) => {
    const bytes = new Uint8Array(Number(size));
    await file.read(bytes, 0, Number(size), Number(at));
    return bytes;
  },
};
const reader = await McapIndexedReader.Initialize({ readable });
const counts = {};
for await (const one of reader.readMessages()) {
  const topic = reader.channelsById.get(one.channelId).topic;
  counts[topic] = (counts[topic] ?? 0) + 1;
}
console.log(JSON.stringify(counts));
"""


@pytest.fixture(scope="module")
def javascript(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Path], Any]:
    """The number of messages by topic, as the reader of Foxglove finds them."""
    folder = fetched(tmp_path_factory.mktemp("node"), PACKAGE).parent
    (folder / "package.json").write_text('{"type": "module"}')
    (folder / "count.js").write_text(COUNT)

    def count(path: Path) -> Any:
        words = ["node", "count.js", str(path.resolve())]
        said = subprocess.run(
            words, cwd=folder, capture_output=True, text=True, check=True
        )
        return json.loads(said.stdout)

    return count


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_another_reader_counts_the_same(
    tmp_path: Path, javascript: Callable[[Path], Any]
) -> None:
    made = recorded(60)
    made.run(tmp_path / "a", direct=True)
    counts = javascript(tmp_path / "a" / "run.mcap")
    ports = ("dog", "free", "lead")
    robots = [
        f"/robot/{name}/{port}" for name in ports for port in ("command", "state")
    ]
    agents = ["/input/wave/value", "/process/follow/command"]
    assert counts == dict.fromkeys([*agents, *robots, "/tf"], 60)
    killed = write(tmp_path / "cut.mcap", ticks=55)
    (tmp_path / "copy.mcap").write_bytes(killed.path.read_bytes())
    killed.close()
    assert main(["repair", str(tmp_path / "copy.mcap")]) == 0
    assert sum(javascript(tmp_path / "copy.mcap").values()) == 3 * 49
