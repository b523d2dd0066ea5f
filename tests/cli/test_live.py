"""`rems list`, `get` and `watch`, against a fabric that runs in real time."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from rems_net.client import join
from rems_net.router.message import pack_stamp
from tests.agents.runs import ticking
from tests.cli.conftest import LAB, place, starting, together
from tests.commands import Run, Start
from tests.interrupts import interrupt

#: a minute of one robot that drives straight ahead
LONG = together(LAB, "here").replace('"1 s"', '"60 s"\npace = 1.0')
AHEAD = "time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]\n60,0.5,0.5\n"


@pytest.fixture(scope="module")
def notes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The runtime folder of a run that all these tests look at."""
    folder = tmp_path_factory.mktemp("live")
    (folder / "lab.toml").write_text(LONG)
    (folder / "keys.csv").write_text(AHEAD)
    with starting(folder) as start:
        with place(folder) as notes:
            start("run", "lab.toml")
            ticking(2)
        yield notes


@pytest.fixture(autouse=True)
def fabric(notes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(notes))


def test_list(program: Run) -> None:
    done = program("list")
    assert (done.returncode, done.stderr) == (0, "")
    header, *rows = (line.split() for line in done.stdout.splitlines())
    assert header == ["agent", "kind", "host", "rate", "last", "seen"]
    assert [(row[0], row[1]) for row in rows] == [
        ("input/keys", "input"),
        ("robot/model", "robot"),
        ("output/log", "output"),
        ("output/recorder", "output"),
    ]
    assert [row[4] for row in rows] == ["Hz"] * 4
    assert all(len(line) <= 80 for line in done.stdout.splitlines())


def test_get_a_port(program: Run) -> None:
    done = program("get", "robot/model/state")
    assert (done.returncode, done.stderr) == (0, "")
    first, x, y, heading = done.stdout.splitlines()
    assert first.startswith("robot/model/state  (tick ")
    assert x.split()[0] == "x"
    assert float(x.split()[1]) > 0
    assert x.split()[2] == "m"
    assert y.split() == ["y", "0", "m"]
    assert heading.split() == ["heading", "0", "rad"]


def test_get_a_field_and_globs(rems: Run) -> None:
    one = rems("get", "robot/model/command/wheel/left").stdout
    assert one.startswith("robot/model/command/wheel/left  0.5 rad/s  (tick ")
    fields = rems("get", "rems/robot/*/command/**").stdout
    assert "wheel/left   0.5 rad/s" in fields
    assert "wheel/right  0.5 rad/s" in fields


def test_a_star_stands_for_any_letters_as_in_a_shell(rems: Run) -> None:
    quoted = "'robot/*/state'"  # as `cmd` of Windows hands it on
    for key in (
        "robot/mo*/state",
        "ro*/m*l/st*",
        "robot/*/st***e",
        quoted,
    ):
        done = rems("get", key, "--json")
        assert (done.returncode, done.stderr) == (0, ""), key
        (found,) = json.loads(done.stdout)
        assert found.startswith("rems/robot/model/state")
    done = rems("watch", "robot/mo*/st*/head*", "--count", "1")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.split()[2:] == ["robot/model/state", "heading=0", "rad"]
    done = rems("get", "robot/mu*/state")
    assert (done.returncode, done.stderr) == (
        2,
        "rems: Nothing lives at 'robot/mu*/state'. Did you mean 'robot/model/state'? "
        "(R0602)\n",
    )
    for key in ("robot/m?del/state", "robot/[lm]odel/state", "robot/m$*/state"):
        done = rems("get", key)
        assert (done.returncode, done.stderr) == (
            2,
            f"rems: '{key}' is not a key; expected <kind>/<name>/<port>, such as "
            "robot/sim/state, or a glob such as 'robot/*/state' or 'robot/ca*/state', "
            "where * is any letters."
            " (R0610)\n",
        )
    for key, why in (
        ("robot/**/heading", "has `**` elsewhere than at its end"),
        ("robot/m*d*l/state", "has more than one `*` in a chunk, or one of `$#?`"),
    ):
        done = rems("get", key)
        assert (done.returncode, done.stderr) == (
            2,
            f"rems: 'rems/{key}' {why}; expected at most 12 chunks, one `*` in each, "
            "and `**` only at the end, such as 'robot/*/state' or 'robot/sim/**'."
            " (R0610)\n",
        )


def test_get_json(rems: Run) -> None:
    found = json.loads(rems("get", "robot/*/state", "--json").stdout)
    (state,) = found.values()
    assert list(found) == ["rems/robot/model/state"]
    assert state["tick"] >= 2
    assert state["time"] == pytest.approx(0.1 * state["tick"])
    assert state["values"]["heading"] == {"value": 0.0, "unit": "rad"}


@pytest.mark.parametrize("verb", ["get", "watch"])
def test_an_unknown_key(rems: Run, verb: str) -> None:
    for key, said in (
        (
            "robot/modle/state",
            "Nothing lives at 'robot/modle/state'. Did you mean 'robot/model/state'?",
        ),
        (
            "robot/model",
            "Nothing lives at 'robot/model'. Did you mean 'robot/model/*' "
            "(robot/model/command, robot/model/sensors, robot/model/state)?",
        ),
        (
            "robot/model/state/hedding",
            "Nothing lives at 'robot/model/state/hedding'. Did you mean "
            "'robot/model/state/heading'?",
        ),
    ):
        done = rems(verb, key)
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr == f"rems: {said} (R0602)\n"


def test_watch(rems: Run) -> None:
    done = rems("watch", "robot/*/state", "--count", "3")
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert len(lines) == 3
    times = [float(line.split()[0]) for line in lines]
    assert times[1] - times[0] == pytest.approx(0.1)
    assert lines[0].split()[2] == "robot/model/state"
    assert lines[0].endswith(" m  y=0 m  heading=0 rad")


def test_watch_one_field_as_json(rems: Run) -> None:
    done = rems("watch", "robot/model/command/wheel/*", "--json", "--count", "2")
    first, second = map(json.loads, done.stdout.splitlines())
    assert first["key"] == "rems/robot/model/command"
    assert first["values"]["wheel/left"] == {"value": 0.5, "unit": "rad/s"}
    assert second["tick"] == first["tick"] + 1


def test_watch_ends_with_ctrl_c(start: Start) -> None:
    process = start("watch", "robot/model/state")
    assert process.stdout is not None
    assert "robot/model/state" in process.stdout.readline()
    interrupt(process)
    _, said = process.communicate(timeout=20)
    assert (process.returncode, said) == (130, "")


def test_watch_ends_with_the_fabric(
    folder: Path, start: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "own").mkdir(mode=0o700)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "own"))
    (folder / "lab.toml").write_text(LONG)
    fabric = start("run", "lab.toml")
    ticking(2)
    process = start("watch", "robot/model/state")
    assert process.stdout is not None
    assert "robot/model/state" in process.stdout.readline()
    interrupt(fabric)
    _, said = process.communicate(timeout=20)
    assert (process.returncode, said) == (0, "rems: the fabric has ended.\n")


def test_a_tick_of_somebody_else_ends_no_watching(start: Start) -> None:
    process = start("watch", "robot/model/state", "--count", "30")
    assert process.stdout is not None
    assert "robot/model/state" in process.stdout.readline()
    with join() as fabric:
        key = "rems/robot/model/state"
        publisher = fabric.session.publisher(key)
        for payload, tick in ((b"\xc1", 10**9), (b"\xc1", 3), (b"\x80", 10**9)):
            publisher.put(payload, pack_stamp(tick, 0.0))
        lines = process.stdout.read().splitlines()
    assert process.wait(20) == 0
    assert len(lines) == 29
    assert process.stderr is not None
    (said,) = process.stderr.read().splitlines()
    assert said.startswith("rems: robot/model/state: ")
