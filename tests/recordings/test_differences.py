"""Robots that drive on no floor are compared by the fields that they share."""

from __future__ import annotations

from pathlib import Path

import pytest

from rems_net.cli.report import why_lines
from rems_net.recordings.recording import read
from tests.commands import inside as rems

ARM = "time [s],state/joint [{}],state/grip,state/name [text],command/joint [rad]\n"


@pytest.fixture
def arms(tmp_path: Path) -> Path:
    """Two arms, of which one counts in degrees, and a cart."""
    here = tmp_path / "arms"
    here.mkdir()
    left = "0.1,0.0,1,left,0\n0.2,0.5,2,left,0\n0.3,1.0,2,left,0\n"
    right = "0.2,45,3,right,0\n0.3,90,2,right,0\n0.4,0,0,right,0\n"
    (here / "left.csv").write_text(ARM.format("rad") + left)
    (here / "right.csv").write_text(ARM.format("deg") + right)
    head = "time [s],state/x [m],state/y [m],state/heading [rad],state/joint [m]\n"
    (here / "cart.csv").write_text(head + "0.2,1,2,3,4\n")
    (here / "diary.csv").write_text("time [s],what\n0.1,it began\n")
    return here


def test_fields_that_both_have(arms: Path) -> None:
    found = read(arms).compare()
    assert [repr(one) for one in found] == [
        "left - right, state/joint: 0.4513 rad apart (rms), 0.5708 rad at the end, "
        "0.5708 rad at most",
        "left - right, state/grip: 0.7071 apart (rms), 0 at the end, 1 at most",
    ]


def test_the_table(arms: Path) -> None:
    done = rems("compare", ".", folder=arms)
    assert (done.returncode, done.stderr) == (0, "")
    assert not (arms / "comparison.png").exists()
    table = done.stdout.split("\n\n")[-2].splitlines()
    assert [line.split() for line in table] == [
        ["pair", "field", "rms", "final", "most"],
        ["left", "-", "right", "joint", "[rad]", "0.4513", "+0.5708", "0.5708"],
        ["left", "-", "right", "grip", "0.7071", "+0", "1"],
    ]


def test_of_a_crowd_each_is_compared_with_the_first(arms: Path) -> None:
    for i in range(20):
        (arms / f"r{i}.csv").write_bytes((arms / "left.csv").read_bytes())
    found = read(arms).compare()
    assert {one.a for one in found} == {"left"}
    assert [one.b for one in found][::2] == [*(f"r{i}" for i in range(20)), "right"]


def test_of_carts_and_arms_each_kind_is_explained(arms: Path) -> None:
    """Carts by their poses, arms by their joints; nobody by the other kind."""
    rows = "".join(f"0.{i},{i},2,3,4\n" for i in range(1, 10))
    head = "time [s],state/x [m],state/y [m],state/heading [rad],state/joint [m]\n"
    (arms / "cart.csv").write_text(head + rows)
    (arms / "cart2.csv").write_text(head + rows)
    recording = read(arms)
    lines = [*why_lines(recording, recording.pairs(recording.trajectories()))]
    assert lines[0].startswith("why they part from cart, ")
    assert lines[1:2] == ["cart2  the same"]
    assert lines[2].endswith("arms cart cart2")
    lines = [*why_lines(recording, recording.differences({"cart", "cart2"}))]
    assert lines[0].startswith("why they part from left, ")
    assert lines[1:2] == ["right  2 rows are too few to find why"]
