"""Two runs as one recording: each robot is compared with itself in the other run."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from rems_net import Experiment, Input, Out, Woodbot, read, together
from rems_net.cli import main
from rems_net.errors import ExperimentError
from rems_net.recordings.recording import Recording


class Ahead(Input):
    value = Out(Woodbot.command)

    def read(self, tick: object) -> dict[str, float]:
        return {"wheel/left": 5.0, "wheel/right": 4.0}


def run(folder: Path, heading: float, *robots: str) -> Recording:
    """A run whose robots start with this heading."""
    lab = Experiment("lab", dt="0.1 s", duration="2 s")
    lab.input("ahead", Ahead)
    for name in robots:
        lab.robot(
            name,
            "woodbot",
            "kinematic",
            command="input/ahead",
            initial={"heading": heading},
        )
    return lab.run(folder, direct=True)


def test_each_robot_meets_itself(tmp_path: Path) -> None:
    days = tmp_path / "monday", tmp_path / "tuesday"
    run(days[0], 0.0, "a", "b")
    run(days[1], 0.5, "b", "c")
    both, monday = together(*days), read(days[0])
    assert [*both] == ["b", "b (tuesday)"]
    (pair,) = both.compare()
    assert (pair.a, pair.b) == ("b", "b (tuesday)")
    # Both drive the same arc, and one is turned: a chord of the other's end.
    end = math.hypot(*(float(monday["b"][f"state/{one}"][-1]) for one in "xy"))
    assert pair.final == pytest.approx(2 * math.sin(0.25) * end)
    assert [one.name for one in both.trajectories()] == [*both]
    assert both.why().line.startswith("100 %  starts +28.6 deg away")


def test_runs_without_a_robot_of_one_name(tmp_path: Path) -> None:
    one, other = run(tmp_path / "one", 0.0, "a"), run(tmp_path / "other", 0.0, "b")
    with pytest.raises(ExperimentError, match=r"one has a, and that in .*other b; two"):
        together(one, other)


def test_in_a_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    run(tmp_path / "x" / "lab", 0.0, "a")
    run(tmp_path / "y" / "lab", 0.5, "a")
    monkeypatch.chdir(tmp_path)
    assert main(["compare", "x/lab", "y/lab"]) == 0
    printed = capsys.readouterr().out
    assert "\na (y) " in printed
    folders = f"{Path('x/lab')} {Path('y/lab')}"
    assert printed.endswith(f"what else: rems compare {folders} a\n")
    assert (tmp_path / "x" / "lab" / "comparison.png").exists()
    assert main(["compare", "x/lab", "y/lab", "a"]) == 0
    assert capsys.readouterr().out.startswith("a - a (y)\n")
    assert main(["compare", "x/lab", "z/lab"]) == 2
    assert f"There is no folder {Path('z/lab')}" in capsys.readouterr().err
