"""Real runs of Woodbots with something wrong on purpose, which is found and told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment, read
from rems_net.errors import ExperimentError, UnknownFieldError
from rems_net.recordings.recording import Recording
from tests.commands import inside as rems

#: driven along bends, and once on the spot
KEYS = "2.0,60,40\n3.0,30,70\n4.0,-30,30\n6.0,50,60\n"
HEAD = "time [s],command/wheel/left [percent],command/wheel/right [percent]\n"
FREE = {"arena_radius": "0 m"}


def run(folder: Path, robots: dict[str, dict[str, Any]], **keys: str) -> Recording:
    """Run them in an engine; each is commanded what its `keys` say, or `right`."""
    lab = Experiment("lab", dt="20 ms", duration="6 s", folder=folder)
    for name, rows in keys.items():
        (folder / f"{name}.csv").write_text(HEAD + rows)
        lab.input(name, "csv", options={"file": f"{name}.csv"})
    for name, told in robots.items():
        driver = "mujoco" if name == "mujoco" else "kinematic"
        source = f"input/{name if name in keys else 'right'}"
        lab.robot(name, "woodbot", driver, command=source, **told)
    lab.output("log", "csv")
    lab.run(folder / "lab", direct=True)
    return read(folder / "lab")


@pytest.fixture(scope="module")
def wrong(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    robots: dict[str, dict[str, Any]] = {
        "kinematic": {"parameters": FREE},
        "again": {"parameters": FREE},
        "aside": {"parameters": FREE, "initial": {"y": "5 cm"}},
        "noisy": {"parameters": FREE, "options": {"noise": True}},
        "other": {"parameters": FREE},
        "track": {"parameters": FREE | {"track": "124 mm"}},
        "wheels": {"parameters": FREE | {"wheel_radius": "21 mm"}},
        "stopped": {"parameters": FREE},
    }
    return run(
        tmp_path_factory.mktemp("wrong"),
        robots,
        right=KEYS,
        other=KEYS.replace("3.0,30,70", "3.0,30,60"),
        stopped=KEYS.replace("6.0,50,60", "5.0,50,60\n6.0,0,0"),
    )


TOLD = {
    "again": "the same",
    "aside": "100 %  starts 50 mm away",
    "other": "100 %  does not receive the same commands from 2.02 s on: "
    "wheel/right 4.38, not 5.11 rad/s",
    "stopped": "100 %  is commanded to stand while kinematic is not, from 5.02 s on",
    "track": "100 %  turns 0.908 times as much",  # 112.6 mm / 124 mm
    "wheels": "100 %  goes and turns 1.05 times as much",
}


@pytest.mark.parametrize("name", TOLD)
def test_what_is_wrong_is_told(wrong: Recording, name: str) -> None:
    assert wrong.why("kinematic", name).line == TOLD[name]


def test_noise_is_told_where_nothing_else_differs(wrong: Recording) -> None:
    found = wrong.why("kinematic", "noisy")
    gyro = next(one for one in found.partings if one.field == "sensors/gyro/z")
    assert [cause.kind for cause in gyro.causes] == ["offset", "noise"]
    # As its definition says, rad/s; the bias is drawn once.
    assert gyro.causes[1].numbers == pytest.approx([0.0035], rel=0.15)
    assert all(
        [cause.kind for cause in one.causes] in (["noise"], ["offset", "noise"], [])
        for one in found.partings
    )


def test_without_names_it_is_the_first_beside_the_kinematic_one(
    wrong: Recording,
) -> None:
    assert (wrong.why().a, wrong.why().b) == ("kinematic", "again")


def test_in_a_terminal(wrong: Recording) -> None:
    done = rems("compare", ".", folder=wrong.folder)
    assert (done.returncode, done.stderr) == (0, "")
    *_, table, why = done.stdout.split("\n\n")
    assert table.splitlines()[1].startswith("kinematic ")  # of 28 pairs, 7
    assert len(table.splitlines()) == 2 + 7
    assert all(len(line) <= 80 for line in why.splitlines()[:-1])
    words = " ".join(why.split())
    for name, told in TOLD.items():
        assert " ".join(f"{name} {told}".split()) in words


def test_all_of_a_pair(wrong: Recording) -> None:
    done = rems("compare", ".", "aside", "track", folder=wrong.folder)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"{wrong.why('aside', 'track')}\n"
    assert all(len(line) <= 80 for line in done.stdout.splitlines())
    first, when, *_ = done.stdout.splitlines()
    assert first == "aside - track"
    assert "when    more than 10 mm apart from 0.00 s" in when
    assert "look at track, wheels that slip where it turns" in done.stdout


def test_a_name_that_nobody_has(wrong: Recording) -> None:
    with pytest.raises(UnknownFieldError, match="Did you mean 'track'"):
        wrong.why("trak")
    with pytest.raises(ExperimentError, match="name another robot, of: again, aside, "):
        wrong.why("kinematic", "kinematic")
    words = ("compare", ".", "aside", "track", "wheels")
    done = rems(*words, folder=wrong.folder)
    assert done.returncode != 0
    assert "expected one robot or two" in done.stderr


def test_a_wall(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    robots: dict[str, dict[str, Any]] = {"kinematic": {}, "mujoco": {}}
    found = run(tmp_path, robots, right="6.0,60,60\n").why()
    assert found.causes[0].kind == "episode"
    assert found.causes[0].share > 0.98
    assert "is held from 4.3" in found.line
    assert "mujoco: lidar/front reads 1" in found.line
    assert "kinematic: beyond the wall of its arena" in found.line
    where = found.partings[0].where
    assert where is not None
    assert where.time == pytest.approx(4.4, abs=0.1)
    assert where.off[0] == pytest.approx(-0.010, abs=0.002)  # it stays behind
