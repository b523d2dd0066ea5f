"""Several runs at once: each verb says so, and `rems stop` means all of them."""

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

import pytest

from rems_net.client import join
from rems_net.events import Event, listening
from tests.agents.runs import until
from tests.cli.conftest import FREE, place, starting
from tests.commands import Run, Running
from tests.signals import freeze, thaw

ON = "Let them go on with: rems stop --release\n"


class One(NamedTuple):
    """A run, and where it is."""

    process: Running
    endpoint: str

    @property
    def port(self) -> str:
        return self.endpoint.rpartition(":")[2]


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, One, One]]:
    """The runtime folder of two runs that tick, the newest first.

    Their robots are `bot2` and `bot1`.
    """
    folder = tmp_path_factory.mktemp("several")
    found: list[One] = []
    with starting(folder) as start:
        with place(folder) as notes:
            for i in (1, 2):
                lab = FREE.replace('"bot"', f'"bot{i}"')
                lab = lab.replace("pace", "record = false\npace")
                lab = lab.replace('"free"', f'"free{i}"')
                (folder / f"free{i}.toml").write_text(lab)
                process = start("run", f"free{i}.toml")
                assert process.stdout is not None
                first = process.stdout.readline()
                where = first.rpartition("fabric at ")[2].strip().rstrip(".")
                one = One(process, where)
                with join(at=one.port) as fabric:
                    until(partial(fabric.get, "robot/*/state"))
                found.insert(0, one)
        yield notes, found[0], found[1]


@pytest.fixture
def runs(
    two: tuple[Path, One, One], monkeypatch: pytest.MonkeyPatch, rems: Run
) -> Iterator[tuple[One, One]]:
    notes, new, old = two
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(notes))
    yield new, old
    rems("stop", "--release")


def stops(run: One) -> int:
    with join(at=run.endpoint) as fabric:
        return int(fabric.get("clock/tick")["rems/clock/tick"]["stops"])


def test_every_verb_says_so(rems: Run, runs: tuple[One, One]) -> None:
    new, old = runs
    sentence = (
        f"2 runs are here; this is the newest, at {new.endpoint}. "
        f"For another, name it: --at {old.port}"
    )
    for words in (
        ("list", "--json"),
        ("get", "robot/*/state"),
        ("watch", "robot/bot2/state", "--count", "1"),
        ("call", "robot/bot2", "reset"),
        ("clock", "pace", "1"),
    ):
        done = rems(*words)
        assert (done.returncode, done.stderr) == (0, f"rems: {sentence}\n"), words
        done = rems(*(w.replace("bot2", "bot1") for w in words), "--at", old.port)
        assert (done.returncode, done.stderr) == (0, ""), words
    (agent,) = json.loads(rems("list", "--json", "--at", old.endpoint).stdout)
    assert agent["agent"] == "robot/bot1"
    told: list[Event] = []
    with listening(told.append), join():
        assert [event.text for event in told] == [sentence]


def test_stop_means_all_unless_told_which(rems: Run, runs: tuple[One, One]) -> None:
    new, old = runs
    before = stops(new), stops(old)
    done = rems("stop")
    assert (done.returncode, done.stderr) == (0, "")
    a, one, b, two, on = done.stdout.splitlines(keepends=True)
    assert (a, b, on) == (f"At {new.endpoint}:\n", f"At {old.endpoint}:\n", ON)
    assert one.startswith("robot/bot2 stands at tick ")
    assert two.startswith("robot/bot1 stands at tick ")
    assert (stops(new), stops(old)) == (before[0] + 1, before[1] + 1)
    done = rems("stop", "--release")
    assert (done.returncode, done.stdout, done.stderr) == (
        0,
        f"At {new.endpoint}:\nreleased: robot/bot2\n"
        f"At {old.endpoint}:\nreleased: robot/bot1\n",
        "",
    )
    done = rems("stop", "--at", old.port)
    assert (done.returncode, done.stderr) == (0, "")
    one, on = done.stdout.splitlines(keepends=True)
    assert one.startswith("robot/bot1 stands at tick ")
    assert (stops(new), stops(old)) == (before[0] + 2, before[1] + 3)


def test_a_frozen_run_keeps_nobody_from_the_others(
    rems: Run, runs: tuple[One, One]
) -> None:
    new, old = runs
    before = stops(old)
    freeze(new.process.pid)
    try:
        done = rems("stop")
    finally:
        thaw(new.process.pid)
    assert done.returncode == 1
    where, one, on = done.stdout.splitlines(keepends=True)
    assert (where, on) == (f"At {old.endpoint}:\n", ON)
    assert one.startswith("robot/bot1 stands at tick ")
    assert done.stderr.startswith(f"rems: Something listens at {new.endpoint}, where ")
    assert stops(old) == before + 1


def test_the_command_line_says_what_to_type_to_a_stopped_robot(
    rems: Run, runs: tuple[One, One]
) -> None:
    _, old = runs
    rems("stop")
    done = rems("call", "robot/bot1", "reset", "--at", old.port)
    assert (done.returncode, done.stderr) == (
        0,
        "rems: robot/bot1 is stopped: it stands still, and obeys no command, until it "
        "is released. Type: rems stop --release\n",
    )
