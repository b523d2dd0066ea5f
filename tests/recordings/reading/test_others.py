"""Files of other programs: read by a mapping, and compared at common times.

The files are generated in the shape of the class's: a model whose rows are 100 ms
apart, and a simulation whose rows are not, with another point and wrapped headings.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

import rems_net
from rems_net.errors import ExperimentError
from rems_net.recordings.common import common, hidden
from rems_net.recordings.comparison import Pair

HEAD = "timestamp,inpt.wh.l,inpt.wh.r,state.x,state.y,state.th_z,state.d_th_z,"
HEAD += "outpt.lidar_f,outpt.lidar_r,outpt.mag_x,outpt.mag_y,outpt.gyro_z"
#: m/s and rad/s of the robot, and m from the axle to the front edge
SPEED, TURN, EDGE = 0.068, 1.36, 0.01425


def poses(time: Any, turn: float) -> Any:
    """Where it is at times in whole ms: ahead for a second, then turning for one."""
    ms = np.arange(1, 12_001)
    ahead = (ms - 1) // 1000 % 2 == 0
    heading = turn * TURN * np.cumsum(~ahead) / 1000
    x = SPEED * np.cumsum(ahead * np.cos(heading)) / 1000
    y = SPEED * np.cumsum(ahead * np.sin(heading)) / 1000
    return [one[np.round(1000 * time).astype(int) - 1] for one in (x, y, heading)]


def write(path: Path, time: Any, turn: float = 1.0, edge: float = 0.0) -> None:
    """Write a drive. turn: factor of its turns; edge: m ahead of the axle."""
    x, y, heading = poses(time, turn)
    x, y = x + edge * np.cos(heading), y + edge * np.sin(heading)
    wrapped = np.arctan2(np.sin(heading), np.cos(heading)) if edge else heading
    rows = np.stack((time, 0 * time + 50, 0 * time + 100, x, y, wrapped), axis=1)
    lines = [",".join(map(repr, [*row, *[0.0] * 6])) for row in rows.tolist()]
    path.write_text("\n".join([HEAD, *lines]) + "\n", encoding="utf-8")


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    write(tmp_path / "Model1.csv", np.arange(1, 102) * 0.1)
    uneven = np.cumsum(np.resize([0.096, 0.102, 0.099], 100))
    write(tmp_path / "Webots1.csv", uneven, turn=0.95, edge=EDGE)
    return tmp_path


def test_two_programs_of_one_session(lab: Path) -> None:
    recording = rems_net.read(lab, like="woodbot-class")
    model, webots = recording["Model1"], recording["Webots1"]
    assert str(model["state/x"].units) == "m"
    assert str(webots["sensors/lidar/front"].units) == "mm"
    x, y, heading = poses(webots.seconds(), 0.95)  # of the axle, and not wrapped
    assert heading[-1] > np.pi
    assert webots.plain("state/heading") == pytest.approx(heading)
    assert webots.plain("state/x") == pytest.approx(x)
    assert webots.plain("state/y") == pytest.approx(y)
    (pair,) = recording.compare()
    assert isinstance(pair, Pair)
    assert pair.laid == pytest.approx(0.297)
    # Both go straight on until 1 s, so they are laid over each other as they are.
    one, other = (poses(pair.time, turn) for turn in (1.0, 0.95))
    truth = np.hypot(one[0] - other[0], one[1] - other[1])
    assert 0 < np.abs(pair.distance - truth).max() <= pair.hidden < 5e-3
    why = recording.why("Model1", "Webots1")
    assert [one.kind for one in why.causes] == ["turn"]
    assert why.causes[0].numbers[0] == pytest.approx(0.95, abs=1e-3)


@pytest.mark.parametrize("factor", [-0.92, -1.0, -1.08])
def test_a_sign_that_is_turned_round(lab: Path, factor: float) -> None:
    uneven = np.cumsum(np.resize([0.096, 0.102, 0.099], 100))
    write(lab / "Webots1.csv", uneven, turn=factor, edge=EDGE)
    recording = rems_net.read(lab, like="woodbot-class")
    said = recording.why("Model1", "Webots1").line
    assert f"turns {factor:.3g} times as much (the wrong sign?)" in said


def test_a_mapping_of_ones_own(tmp_path: Path) -> None:
    """Degrees, a turned sign, a time in ms at the start of each step, other words."""
    (tmp_path / "log.csv").write_text(
        "ms,px,py,yaw,note\n0,10,0,170,on\n100,20,0,-170,off\n200,30,0,-150,on\n",
        encoding="utf-8",
    )
    (tmp_path / "mine.toml").write_text(
        """
        stamped = "start"
        frame = { left = "1 cm" }
        [columns]
        ms = { field = "time", unit = "ms" }
        px = { field = "state/x", unit = "cm" }
        py = { field = "state/y", unit = "cm" }
        yaw = { field = "state/heading", unit = "deg", wrap = true, factor = -1 }
        note = { field = "sensors/note", unit = "text" }
        """,
        encoding="utf-8",
    )
    like = str(tmp_path / "mine.toml")
    found = rems_net.read(tmp_path / "log.csv", like=like)["log"]
    assert found.seconds() == pytest.approx([0.1, 0.2, 0.3])
    assert found.plain("state/heading") == pytest.approx([-170, -190, -210])
    assert found["sensors/note"].tolist() == ["on", "off", "on"]
    turned = np.radians([-170, -190, -210])
    assert found.plain("state/x") == pytest.approx(
        np.sin(turned) + np.arange(10, 31, 10)
    )
    assert found.plain("state/y") == pytest.approx(-np.cos(turned))


MISTAKES = [
    ("woodbot", "there is no mapping 'woodbot'"),
    ("nowhere.toml", "there is no mapping in a file nowhere.toml"),
    ("[columns", "is no TOML file"),
    ("", "no column is the time"),
    ("coloumns = 1", "there is no 'coloumns'; there is columns"),
    ("stamped = 'middle'", "expected 'end' or 'start'"),
    ("columns = 1", "columns is 1; expected a table"),
    ("[columns]\nt = 'time'", "expected such as { field"),
    ("[columns]\nt = { field = 'time', unit = 'm' }", "column 't'"),
    ("[columns]\nt = { field = 'x' }", "its field is 'x'; expected 'time'"),
    ("[columns]\nt = { field = 'state/x', unit = 'metre-ish' }", "metre-ish"),
    ("[columns]\nt = { field = 'time' }\nu = { field = 'time' }", "two columns have"),
    ("frame = { ahead = '3 kg' }", "frame: "),
    ("frame = { settled = -1 }", "settled is -1; expected the number of a row"),
    ("[columns]\nq = { field = 'time' }", "line 1: expected a column 'q'"),
    ("frame = { settled = 9 }\n[columns]\ntime = { field = 'time' }", "has 1 rows"),
]


@pytest.mark.parametrize(("text", "says"), MISTAKES)
def test_a_mistake_in_a_mapping_is_one_sentence(
    tmp_path: Path, text: str, says: str
) -> None:
    (tmp_path / "log.csv").write_text("time,x\n1,2\n", encoding="utf-8")
    like = text
    if text == "" or "=" in text or "[" in text:
        (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
        like = str(tmp_path / "mine.toml")
    with pytest.raises(ExperimentError) as caught:
        rems_net.read(tmp_path, like=like)["log"]
    assert says in str(caught.value)
    assert str(caught.value).endswith("(R0844)")
    assert "\n" not in str(caught.value)


@settings(suppress_health_check=[HealthCheck.too_slow])
@given(
    st.lists(st.floats(0.01, 0.2), min_size=8, max_size=40),
    st.floats(0.2, 3.0),
    st.floats(-1, 1),
    st.integers(2, 5),
)
def test_interpolation_is_no_further_than_its_bound(
    steps: list[float], kink_after: float, slope: float, kink: int
) -> None:
    """Of a signal with one kink between two samples, wherever it is."""
    time = np.cumsum(steps)
    at = time[kink] + min(kink_after / 3, 1) * (time[kink + 1] - time[kink])
    fine = np.linspace(time[0], time[-1], 500)

    def signal(t: Any) -> Any:
        return slope * np.maximum(t - at, 0)

    off = np.abs(np.interp(fine, time, signal(time)) - signal(fine)).max()
    assert off <= hidden(time, signal(time)) + 1e-12


def test_common_times() -> None:
    a, b = np.arange(1, 11) / 10.0, np.arange(1, 6) / 5.0
    assert common(a, b).rows is not None  # each second row of a
    late = common(a, a + 0.05)
    assert late.rows is None
    assert late.time[[0, -1]] == pytest.approx([0.15, 1.0])
    assert not len(common(a, a + 10).time)
    held = late.of(0, np.arange(10) % 2 == 0, holds=False)
    assert held[:3].tolist() == [False, False, True]  # 0.15 and 0.2 s: its row 2
