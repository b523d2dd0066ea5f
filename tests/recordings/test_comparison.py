"""How far apart: by hand on small trajectories, and from the files of a run."""

from __future__ import annotations

import math
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from rems_net import Experiment, read
from rems_net.agents.experiment.show import Show
from rems_net.cli.report import report
from rems_net.errors import ExperimentError
from rems_net.recordings.comparison import CROWD, Trajectory, compare
from rems_net.recordings.picture import draw

TIME = np.array([0.1, 0.2, 0.3, 0.4])


def robot(name: str, x: list[float], heading: list[float] | None = None) -> Trajectory:
    n = len(x)
    turned = np.array(heading or [0.0] * n)
    return Trajectory(name, TIME[:n], np.array(x), np.zeros(n), turned)


def test_distance() -> None:
    still = robot("still", [0.0, 0.0, 0.0, 0.0])
    moved = robot("moved", [0.0, 0.010, 0.030, 0.020])
    (pair,) = compare([still, moved])
    assert (pair.a, pair.b) == ("still", "moved")
    assert pair.rms == pytest.approx(math.sqrt((0 + 1 + 9 + 4) / 4) * 0.010)
    assert pair.final == pytest.approx(0.020)
    assert pair.parted == 0.3  # 10 mm is not yet more than 10 mm


@pytest.mark.parametrize(("count", "pairs"), [(CROWD, 435), (CROWD + 1, 30)])
def test_a_crowd_is_compared_with_one_robot(count: int, pairs: int) -> None:
    found = compare([robot(f"r{i}", [0.0, float(i)]) for i in range(count)])
    assert len(found) == pairs
    assert {one.a for one in found[: CROWD - 1]} == {"r0"}


def test_a_report_is_on_the_first_of_a_crowd(tmp_path: Path) -> None:
    lab = Experiment("crowd", dt=0.01, duration=0.02)
    for i in range(CROWD + 2):
        lab.robot(f"r{i}", "woodbot", "kinematic")
    out = Console(file=StringIO(), width=80)
    report(out, "crowd", lab.run(tmp_path / "a", direct=True, show=Show()))
    said = out.file.getvalue()  # type: ignore[attr-defined]
    assert "The first 30 of 32 robots:" in said
    assert "\nr29 " in said
    assert "r30" not in said


def test_never_parted() -> None:
    (pair,) = compare([robot("a", [0.0, 0.0]), robot("b", [0.0, 0.009])])
    assert pair.parted is None


def test_heading_is_unwrapped() -> None:
    """One robot's compass jumps from pi to -pi; the difference does not."""
    on = robot("on", [0.0] * 4, [3.0, 3.1, 3.2, 3.3])
    wrapped = robot("wrapped", [0.0] * 4, [3.01, 3.11, 3.21 - 2 * math.pi, -2.97])
    (pair,) = compare([on, wrapped])
    assert pair.turn == pytest.approx([0.01, 0.01, 0.01, 2 * math.pi - 2.97 - 3.3])
    assert pair.final_turn == pytest.approx(0.0132, abs=1e-4)
    assert pair.rms_turn == pytest.approx(0.0109, abs=1e-4)


def test_only_times_that_both_have() -> None:
    (pair,) = compare([robot("long", [0.0] * 4), robot("short", [0.0, 0.05])])
    assert pair.time.tolist() == [0.1, 0.2]
    later = Trajectory("later", TIME + 10, np.zeros(4), np.zeros(4), np.zeros(4))
    assert compare([robot("now", [0.0] * 4), later]) == []


def test_files(tmp_path: Path) -> None:
    head = "time [s],state/x [mm],state/y [m],state/heading [deg],state/speed [m/s]"
    (tmp_path / "cart.csv").write_text(f"{head}\n0.1,250,2,90,1\n")
    (tmp_path / "arm.csv").write_text("time [s],state/joint [rad]\n0.1,1\n")
    (tmp_path / "odd.csv").write_text(
        "time [s],state/x [s],state/y [m],state/heading [rad]\n0.1,1,2,3\n"
    )
    (cart,) = read(tmp_path).trajectories()
    assert (cart.name, cart.x[0], cart.y[0]) == ("cart", 0.25, 2.0)
    assert cart.heading[0] == pytest.approx(math.pi / 2)


def test_a_file_that_is_none(tmp_path: Path) -> None:
    path = tmp_path / "cart.csv"
    path.write_text("hello\n")
    with pytest.raises(ExperimentError, match=r"cart\.csv, line 1: expected a column"):
        read(path.parent).trajectories()


@pytest.mark.parametrize("count", [1, 2, 3, 9])
def test_the_picture(tmp_path: Path, count: int) -> None:
    """Any number of robots; no warning of matplotlib's is let through."""
    pytest.importorskip("matplotlib")
    robots = [robot(f"r{i}", [0.0, 0.01 * i, 0.02 * i, 0.0]) for i in range(count)]
    path = tmp_path / "picture.png"
    draw(path, "test", robots, compare(robots))
    assert path.read_bytes().startswith(b"\x89PNG")
