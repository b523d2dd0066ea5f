"""`rems agent start` on a fabric that is served; these tests leave it as it is."""

import json
import os
import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from rems_net.client import Fabric, join
from rems_net.errors import uncoded
from tests.agents.runs import until
from tests.cli.conftest import robot, row, served, text, ticks
from tests.commands import Run, Running, Start
from tests.signals import KILL, freeze, thaw


@pytest.fixture(scope="module")
def notes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The runtime folder of a served fabric for those tests that leave it as it is."""
    with served(tmp_path_factory.mktemp("open")) as notes:
        yield notes


@pytest.fixture
def here(notes: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Fabric]:
    """A fabric that is served, without agents."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(notes))
    with join() as here:
        until(lambda: not here.agents())
        yield here


def test_a_frozen_agent_changes_nothing_and_catches_up(
    start: Start, here: Fabric
) -> None:
    alice = robot(start, "alice")
    bob = robot(start, "bob")
    until(lambda: row(here, "robot/alice"))
    frozen = until(lambda: row(here, "robot/bob"))
    pid = int(frozen["host"].rpartition(":")[2])
    freeze(pid)
    try:
        before = ticks(here, "robot/alice", 1)["tick"]
        assert ticks(here, "robot/alice", 150)["tick"] > before
        stood = row(here, "robot/bob")
        assert stood
        assert stood["seen"] > 0.5
    finally:
        thaw(pid)

    def caught_up() -> bool:
        alice, bob = row(here, "robot/alice"), row(here, "robot/bob")
        return bool(alice and bob and abs(alice["tick"] - bob["tick"]) < 20)

    until(caught_up)
    # It is told so, on its own laptop, and only there.
    late = re.findall(
        r"warning: robot/bob was (\S+) s late: ticks (\d+) to (\d+) went by without it",
        text(bob),
    )
    assert late
    assert sum(float(seconds) for seconds, _, _ in late) > 1.0
    assert all(int(first) < int(last) for _, first, last in late)
    assert "robot/bob" not in text(alice)


def test_a_name_is_taken_and_given_up(start: Start, here: Fabric) -> None:
    alice = robot(start, "alice")
    host = until(lambda: row(here, "robot/alice"))["host"]
    twin = robot(start, "alice")
    _, error = twin.communicate(timeout=20)
    assert twin.returncode == 1
    assert error.count("there is a robot/alice already, on ") == 1
    assert "has that badge" not in error
    # Killed, it says nothing; who comes anew is let in at once.
    os.kill(int(host.rpartition(":")[2]), KILL)
    alice.communicate(timeout=20)
    robot(start, "alice")

    def anew() -> bool:
        found = row(here, "robot/alice")
        return found is not None and found["host"] != host

    until(anew)


def test_a_name_that_was_taken_meanwhile_is_lost(
    start: Start, here: Fabric, folder: Path
) -> None:
    """A laptop was closed, and others took the names of its agents: they end there."""
    (folder / "far.py").write_text(FAR)
    ways = {
        "robot/alice": ("robot", "woodbot", "kinematic", "--name", "alice"),
        "input/keys": ("input", "keys.csv"),
        "process/one": ("process", "far.py:One", "--to", "where=robot/alice/state"),
    }
    first = {key: start("agent", "start", *words) for key, words in ways.items()}
    hosts = {key: until(partial(row, here, key))["host"] for key in ways}
    pids = [int(host.rpartition(":")[2]) for host in hosts.values()]
    for pid in pids:
        freeze(pid)
    second: dict[str, Running] = {}

    def taken() -> bool:
        for key, words in ways.items():
            if key not in second or second[key].poll() is not None:
                second[key] = start("agent", "start", *words)
        rows = {key: row(here, key) for key in ways}
        return all(one and one["host"] != hosts[k] for k, one in rows.items())

    try:
        until(taken)
    finally:
        for pid in pids:
            thaw(pid)
    for key, process in first.items():
        _, error = process.communicate(timeout=20)
        assert process.returncode == 1, key
        assert error.count(f"there is a {key} already, on ") == 1
        assert "has that badge" not in error
    assert len(here.session.ask(here.session.key("robot", "alice", "state"))) == 1


def test_agents_that_read_each_other(start: Start, here: Fabric, folder: Path) -> None:
    (folder / "keys.csv").write_text(
        "time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]\n"
        "3600,0.5,0.5\n"
    )
    robot(start, "alice", "--to", "command=input/keys")
    until(lambda: row(here, "robot/alice"))
    start("agent", "start", "input", "keys.csv")
    alice = here.robot("alice")
    until(lambda: float(alice.state.x) > 0.001)


FAR = """\
from rems_net import In, Out, Process, Schema
from rems_net.defdict import length


class Far(Process):
    where = In()
    value = Out(Schema("far", {"x": length("cm")}))

    def step(self, tick):
        if self.where:
            self.value["x"] = f"{self.where['x']} m"


class One(Far):
    where = In(Schema("where", {"x": length()}))
"""


BOTH = """\
[[process]]
name = "far"
type = "far.py:Far"
host = "one"
where = "robot/alice/state"

[[process]]
name = "one"
type = "far.py:One"
host = "one"
where = "robot/*/state"
"""


def test_one_source_that_comes_later_gives_its_schema(
    start: Start, here: Fabric, folder: Path
) -> None:
    (folder / "far.py").write_text(FAR)
    (folder / "far.toml").write_text(BOTH)
    one = start("agent", "start", "far.toml")
    until(lambda: row(here, "process/far") and row(here, "process/one"))
    robot(start, "alice", "--set", "initial.x=25 cm")

    def heard() -> bool:
        told = [here.agent(f"process/{name}").value for name in ("far", "one")]
        return all(value["x"] == pytest.approx(25.0) for value in told)

    until(heard)
    robot(start, "bob")
    assert one.stderr is not None
    sentence = (
        "warning: process/one/where has a schema, so it reads one port, and "
        "'robot/*/state' matches 2, robot/alice/state and robot/bob/state among "
        "them: it takes what comes last. Name one.\n"
    )
    assert any(line.endswith(sentence) for line in one.stderr)


SCRIPT = """\
import sys
from rems_net import Experiment
from follow import Follow

print("read")
lab = Experiment("lab", dt="0.1 s", duration="1 s")
for name in sys.argv[1:]:
    lab.robot(name, "woodbot", "kinematic")
lab.process("first", Follow, target=f"robot/{sys.argv[1]}/state")
lab.run()
print("not read")
"""


FOLLOW = """\
from rems_net import In, Out, Process
from rems_net.robots.woodbot import Woodbot


class Follow(Process):
    target = In(Woodbot.state)
    value = Out(Woodbot.state)

    def step(self, tick):
        self.value = self.target
"""


def test_the_agents_of_a_script(start: Start, here: Fabric, folder: Path) -> None:
    """All that its first run() has, by one line; its classes are imported."""
    (folder / "lab.py").write_text(SCRIPT)
    (folder / "follow.py").write_text(FOLLOW)
    script = start("agent", "start", "lab.py", "--", "alice", "bob")
    every = {"robot/alice", "robot/bob", "process/first"}
    until(lambda: {r["agent"] for r in here.agents()} == every)
    said = "rems: robot/alice, robot/bob, process/first: Ctrl+C ends it\n"
    assert text(script) == f"read\n{said}"


RECORDED = """\
[experiment]
name = "recorded"
dt = "50 ms"

[[robot]]
name = "sim"
definition = "woodbot"
driver = "kinematic"

[[output]]
name = "log"
type = "mcap"
"""


def test_a_recording_has_the_length_of_the_ticks_of_its_fabric(
    start: Start, here: Fabric, folder: Path
) -> None:
    (folder / "recorded.toml").write_text(RECORDED)
    start("agent", "start", "recorded.toml")
    until(lambda: {"robot/sim", "output/log"} <= {r["agent"] for r in here.agents()})
    about = folder / "runs" / "recorded" / "run.json"
    assert json.loads(about.read_text())["dt"] == 0.02


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ["lab.toml", "csv"],
            "rems: lab.toml names its agents, and how they are connected; "
            "leave out TYPE, --name, --to and --set, or name one KIND and TYPE.",
        ),
        (
            ["robbot", "woodbot", "kinematic"],
            "rems: expected a kind (input, robot, process, output) and a type, such as "
            "`rems agent start robot woodbot kinematic`, or a file; got 'robbot'. Did "
            "you mean 'robot'?",
        ),
        (
            ["robot", "woodbot"],
            "rems: a robot needs a driver, too: `rems agent start robot woodbot "
            "kinematic`; `rems show` lists them.",
        ),
        (
            ["robot", "woodbot", "kinematic", "--set", "track=1"],
            "rems: --set track=1: expected parameters.NAME or options.NAME or "
            "initial.NAME or marker.NAME for this robot, such as --set "
            "parameters.track=1",
        ),
        (
            ["input", "csv", "--set", "file=keys.csv"],
            "rems: --set file=keys.csv: expected options.NAME for this input, such as "
            "--set options.file=keys.csv",
        ),
        (
            ["input", "csv", "kinematic"],
            "rems: only a robot has a driver; input has a TYPE alone.",
        ),
        (
            ["robot", "woodbot", "kinematic", "--to", "input/keys"],
            "rems: expected NAME=VALUE, such as --to command=input/keys; got "
            "'input/keys'.",
        ),
        (
            ["robot", "woodbot", "kinematic", "--to", "state=input/keys"],
            "rems: --to state: a robot has one In, `command`.",
        ),
    ],
)
def test_mistakes(rems: Run, words: list[str], sentence: str) -> None:
    done = rems("agent", "start", *words)
    assert (done.returncode, done.stdout) == (2, "")
    assert uncoded(done.stderr.rstrip("\n")) == sentence
