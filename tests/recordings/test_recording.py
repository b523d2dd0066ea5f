"""What a run left, as arrays with units, as tables, as a comparison, as a picture."""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rems_net
from rems_net import Experiment
from rems_net.agents.experiment.folder import Result
from rems_net.agents.protocol.plan import HERE
from rems_net.errors import ExperimentError, RemsError
from rems_net.recordings.names import natural
from rems_net.recordings.recording import Recording
from tests.agents.runs import quiet

KEYS = """\
time [s],command/wheel/left [percent],command/wheel/right [percent]
0.5,50,50
1.0,20,60
"""


def lab(folder: Path, robots: int = 2) -> Experiment:
    """Some Woodbots of different tracks, which start 10 cm apart."""
    (folder / "keys.csv").write_text(KEYS, encoding="utf-8")
    made = Experiment("lab", dt="0.1 s", duration="1 s", folder=folder)
    made.input("keys", "csv", options={"file": "keys.csv"}, host=HERE)
    for i in range(robots):
        made.robot(
            f"r{i + 1}",
            "woodbot",
            "kinematic",
            command="input/keys",
            parameters={"track": f"{100 + 10 * i} mm"},
            initial={"x": f"{10 * i} cm", "heading": "90 deg"},
            host=HERE,
        )
    made.output("log", "csv", host=HERE)
    return made


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """Of one run, for tests that only read it."""
    folder = tmp_path_factory.mktemp("result")
    return lab(folder, 10).run(folder / "runs" / "lab")


def test_a_column_is_an_array_with_its_unit(result: Result) -> None:
    y: Any = result["r1"]["state/y"]
    assert [kind.__name__ for kind in type(y).__mro__[:2]] == ["unyt_array", "ndarray"]
    assert (y.shape, str(y.units)) == ((10,), "m")
    # Half of 7.3 rad/s on a wheel of 20 mm, straight ahead along y.
    assert y[:5].to("mm").v == pytest.approx([7.3 * (n + 1) for n in range(5)])
    assert result["r1"]["time"].v.tolist() == [n / 10 for n in range(1, 11)]
    assert result["r10"]["state/x"][0].to("cm").v == pytest.approx(90)
    assert type(result["r1"]["sensors/compass/x"]) is np.ndarray  # without a unit


def test_robots_are_in_natural_order(result: Result) -> None:
    assert list(result) == [f"r{i}" for i in range(1, 11)]
    assert sorted(["b2", "a10", "b", "a9", "10", "9"], key=natural) == [
        "a9",
        "a10",
        "b",
        "b2",
        "9",
        "10",
    ]


def test_a_table_is_what_pandas_takes(result: Result) -> None:
    table = result.table("r1")
    assert isinstance(table, dict)
    assert list(table)[:2] == ["time [s]", "command/wheel/left [rad/s]"]
    assert all(type(v) is np.ndarray and v.shape == (10,) for v in table.values())
    shown = repr(table).splitlines()
    assert shown[0] == "10 rows"
    assert shown[2].split() == ["time", "[s]", "0.1", "1", "0.1", "1"]
    assert all(len(line) <= 80 for line in shown)


def test_reading_the_folder_is_the_same(result: Result) -> None:
    again = rems_net.read(result.folder)
    assert list(again) == list(result)
    for robot in result:
        assert list(again[robot]) == list(result[robot])
        for name, values in result[robot].items():
            assert np.array_equal(again[robot][name], values)
    assert repr(again.compare()) == repr(result.compare())
    assert repr(again) == (
        f"<recording in {result.folder} of r1, r2, r3, r4, r5, r6, r7, r8, ...>"
    )


def test_compare_says_it_in_words(result: Result) -> None:
    first, *_, last = result.compare()
    assert (first.a, first.b, last.a, last.b) == ("r1", "r2", "r9", "r10")
    assert repr(first) == (
        f"r1 - r2: {1e3 * first.rms:.2f} mm apart (rms), {1e3 * first.final:.2f} mm "
        "at the end; more than 10 mm: at 0.1 s"
    )


def test_the_recording_knows_where_the_robots_started(result: Result) -> None:
    robot = result.trajectories()[1]
    time, x, y, heading = robot.drawn()
    assert (time[0], x[0], y[0], heading[0]) == (0.0, 0.1, 0.0, math.pi / 2)
    assert len(x) == len(robot.x) + 1
    assert robot.arena == 0.4


def test_what_is_not_there(result: Result, tmp_path: Path) -> None:
    with pytest.raises(RemsError) as caught:
        result["r11"]
    assert str(caught.value) == (
        f"there is no recording of 'r11' in {result.folder}; there is input/keys, r1, "
        "r2, r3, r4, r5, r6, r7, r8, r9, r10. Did you mean 'r1'? (R0841)"
    )
    with pytest.raises(RemsError) as caught:
        result["r1"]["state/z"]
    assert str(caught.value).startswith("r1 has no column 'state/z'; it has time, ")
    assert "Did you mean 'state/" in str(caught.value)
    (tmp_path / "lab").mkdir()
    with pytest.raises(ExperimentError) as told:
        rems_net.read(tmp_path / "lap")
    assert str(told.value) == (
        f"There is no folder {tmp_path / 'lap'}; expected the folder of a run, such as "
        f"runs/demo. Did you mean '{tmp_path.as_posix()}/lab'? (R0840)"
    )
    with pytest.raises(ExperimentError, match=r"There is no CSV file in .*lab, and "):
        rems_net.read(tmp_path / "lab")
    with pytest.raises(ExperimentError, match=r"read\(\) takes the folder.* got 5"):
        rems_net.read(5)  # type: ignore[arg-type]
    with pytest.raises(ExperimentError, match=r"identify\(\) takes a recording; got"):
        rems_net.identify("runs/demo")  # type: ignore[arg-type]
    with pytest.raises(RemsError, match="there is no column 'state/x'; a heading has"):
        result["r1"].table["state/x"]


def test_a_recording_follows_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """A second run of the same name moves the first, whose result stays right."""
    monkeypatch.chdir(tmp_path)
    made = lab(tmp_path, 1)
    first = made.run()
    made.plans["robot/r1"].initial = {"x": "5 m"}
    second = made.run()
    assert quiet(capfd.readouterr().err) == (
        f"[run] what was in {Path('runs/lab')} is now in {Path('runs/lab.1')}\n"
    )
    assert first.folder == tmp_path / "runs" / "lab.1"
    assert first["r1"]["state/x"][0].v < 1 < second["r1"]["state/x"][0].v


@pytest.mark.parametrize(
    "fields", [(), ("state/heading", "sensors/lidar"), ("command",)]
)
def test_the_picture(result: Result, tmp_path: Path, fields: tuple[str, ...]) -> None:
    pytest.importorskip("matplotlib")
    for recording in (result, Recording(result.folder, result.tables()[:1])):
        picture = recording.plot(*fields, path=tmp_path / "picture.png")
        data = Path(picture).read_bytes()
        assert data.startswith(b"\x89PNG")
        assert picture._repr_png_() == data


def test_many_robots_are_named_in_order_beside_the_data(
    result: Result, tmp_path: Path
) -> None:
    """And each is compared with the first of them; the walls of the arena are there."""
    pytest.importorskip("matplotlib")
    result.plot(path=tmp_path / "many.svg")
    drawn = (tmp_path / "many.svg").read_text(encoding="utf-8")
    words = re.findall(r"<!-- (.*?) -->", drawn)
    assert words[-12:] == [*(f"r{i}" for i in range(1, 11)), "start", "end"]
    for word in (
        "How far each was from r1",
        "Where they drove",
        "x [m]",
        "heading [deg]",
    ):
        assert word in words
    assert "#999999" in drawn
    (width,) = re.findall(r'viewBox="0 0 ([\d.]+) ', drawn)
    (legend,) = re.findall(
        r'<g id="legend_1">.*?translate\(([\d.]+) ', drawn, re.DOTALL
    )
    # The axes end where the clip paths do.
    clips = re.findall(r'<rect x="([\d.]+)" y="[\d.]+" width="([\d.]+)"', drawn)
    ends = [float(x) + float(wide) for x, wide in clips]
    assert max(ends) < float(legend) < float(width)


def test_a_field_that_nobody_has(result: Result) -> None:
    with pytest.raises(ExperimentError) as caught:
        result.plot("state/headin")
    assert str(caught.value).startswith(
        "no robot of this recording has 'state/headin'; there is command/wheel/left, "
    )
    assert str(caught.value).endswith("Did you mean 'state/heading'? (R0841)")


SCRIPT = """
from rems_net import Experiment

lab = Experiment("lab", dt="0.1 s", duration="1 s")
lab.robot("sim", "woodbot", "kinematic", host="here")
lab.output("log", "csv", host="here")
result = lab.run()
print("x ends at", result["sim"]["state/x"][-1])
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows has no pseudo-terminals")
def test_a_script_shows_its_progress_on_a_terminal(tmp_path: Path) -> None:
    (tmp_path / "lab.py").write_text(SCRIPT, encoding="utf-8")
    here, there = os.openpty()
    command = [sys.executable, "lab.py"]
    env = os.environ | {"TERM": "xterm", "COLUMNS": "80"}
    quiet = subprocess.run(
        command, cwd=tmp_path, env=env, capture_output=True, text=True, check=True
    )
    assert quiet.stdout == "x ends at 0.0 m\n"
    shown = subprocess.Popen(
        command, cwd=tmp_path, env=env, stdout=there, stdin=there, stderr=there
    )
    os.close(there)
    said = b""
    try:
        while part := os.read(here, 4096):
            said += part
    except OSError:  # Linux says so when the other end is closed
        pass
    finally:
        os.close(here)
    assert shown.wait(timeout=30) == 0
    text = said.decode()
    assert "lab: 1 s of fabric time, as fast as possible; fabric at tcp/" in text
    assert "1.0 s of 1.0 s in " in text
    assert "what was in runs/lab is now in runs/lab.1" in text
    assert text.rstrip().endswith("x ends at 0.0 m")
