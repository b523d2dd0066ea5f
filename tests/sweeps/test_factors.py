"""The points of a sweep, its expressions, and what is refused before the first run."""

from __future__ import annotations

from collections.abc import Sequence
from math import floor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rems_net import Experiment, sweep
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.errors import ExperimentError
from rems_net.sweeps.factors import factor, listed, points, quantities
from rems_net.sweeps.progress import Progress, left
from tests.commands import inside
from tests.sweeps.labs import lab, written

numbers = st.integers(-1000, 1000)


@given(low=numbers, high=numbers, count=st.integers(2, 50))
def test_a_range_has_both_ends_and_even_steps(low: int, high: int, count: int) -> None:
    made = factor("a", f"{low / 10}..{high / 10} mm/{count}")
    values, unit = quantities(made.values)
    assert (len(values), unit) == (count, "mm")
    assert (values[0], values[-1]) == (low / 10, high / 10)
    step = (high - low) / 10 / (count - 1)
    assert values == pytest.approx([low / 10 + i * step for i in range(count)])


@given(count=st.integers(1, 60), seed=st.integers(0, 10**6))
def test_each_part_of_each_range_has_one_sample(count: int, seed: int) -> None:
    some = [factor("a", "-1..3 m"), factor("b", "0..1"), factor("c", ["x", "y"])]
    made = [*points(some, count, (), seed)]
    assert made == [*points(some, count, (), seed)]
    a, _ = quantities([point["a"] for point in made])
    for values, low, width in ((a, -1.0, 4.0), ([p["b"] for p in made], 0.0, 1.0)):
        shares: list[Any] = [(value - low) / width for value in values]  # type: ignore[operator]
        assert sorted(floor(share * count + 1e-9) for share in shares) == [
            *range(count)
        ]
    xs = sum(point["c"] == "x" for point in made)
    assert abs(xs - count / 2) <= 0.5


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("90mm,110 mm", ["90mm", "110 mm"]),
        ("1..3/3", [1, 2, 3]),
        ("1.0..3/3", [1.0, 2.0, 3.0]),
        ("0..2rad/s/2", ["0 rad/s", "2 rad/s"]),
        ("[1, 2],[3, 4]", [[1, 2], [3, 4]]),
        ("'a,b',true", ["a,b", True]),
    ],
)
def test_values_as_they_are_typed(text: str, values: Sequence[object]) -> None:
    assert [*factor("a", text).values] == values


def test_a_list_of_points(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text("input/weave.speed [m/s],input/weave\n0.1,swept.py:Calm\n0.2,x:Y\n")
    assert listed(path) == [
        {"input/weave.speed": "0.1 m/s", "input/weave": "swept.py:Calm"},
        {"input/weave.speed": "0.2 m/s", "input/weave": "x:Y"},
    ]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--set", "input/weave.sped=1"], "has no setting 'sped'; it has speed, wild."),
        (["--set", "input/wave.speed=1"], "no agent 'input/wave' in weave; there is"),
        (["--set", "input/weave.speed=1,2 kg"], "kg"),
        (["--set", "input/weave.wild=0..1/1000", "--seeds", "1000"], "has 1,000,000 r"),
        (["--set", "input/weave.wild=0..1"], "without a number of values; type it"),
        (["--set", "input/weave.wild=0..1/1"], "expected a range with a number of"),
        (["--samples", "9"], "samples are taken from a range, and none is given"),
        (["--replace", "input/weave=swept.py:Carm"], "no class 'Carm'. Did you mean"),
        (["--seeds", "0"], "seeds is 0; expected how many, such as 20"),
        (["--seeds", "many"], "--seeds 'many': expected how many"),
        (["--workers", "0"], "workers is 0; expected a number of processes"),
        (
            ["--measure", "x + 1 s"],
            "cannot be measured: in 'x + 1 s' m and s do not fit",
        ),
        (["--measure", "__import__('os')"], "there is no function __import__() of 1"),
        (["--measure", "x.__class__"], "'x.__class__' is no value here; there is"),
        (["--on", "mars"], "--on 'mars': expected dask=ADDRESS or ray=ADDRESS"),
        (["--list", "none.csv"], "there is no file none.csv in"),
    ],
)
def test_what_is_refused(tmp_path: Path, words: list[str], sentence: str) -> None:
    """One sentence, and no folder."""
    written(tmp_path)
    done = inside("sweep", "lab.toml", *words, folder=tmp_path)
    assert done.returncode == 2, done
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert sentence in done.stderr
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ({"seeds": [1, 1]}, "seeds is [1, 1]; expected how many"),
        ({"samples": -1}, "samples is -1; expected a number of points"),
        ({"workers": "all"}, "workers is 'all'; expected a number of processes"),
        ({"executor": "dask"}, "executor is 'dask'; expected one of concurrent.futur"),
        ({"measure": ["far = x", "far = y"]}, "'far' cannot be measured: the table"),
        ({"measure": "status = x"}, "'status' cannot be measured: the table has"),
        ({"settings": {"input/weave.speed": "1...2 m/s/3"}}, "expected a range with"),
    ],
)
def test_what_python_may_not_give(
    tmp_path: Path, words: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(ExperimentError) as caught:
        sweep(lab(tmp_path), out=tmp_path / "s", **words)
    assert sentence in str(caught.value)
    assert not (tmp_path / "s").exists()
    with pytest.raises(ExperimentError, match="an experiment is an Experiment"):
        sweep(Experiment, out=tmp_path / "s")  # type: ignore[arg-type]


def test_values_of_numpy_and_of_a_range() -> None:
    assert factor("a", np.linspace(0.0, 1.0, 3)).values == [0.0, 0.5, 1.0]
    assert factor("a", range(1, 3)).values == [1, 2]
    assert factor("a", np.float64(2.0)).values == [2.0]


class Lonely(Kinematic):
    """A driver of which a process holds one robot only."""

    one_per_process = True


def test_hardware_and_an_experiment_without_an_end(tmp_path: Path) -> None:
    made = lab(tmp_path)
    made.duration = None
    with pytest.raises(ExperimentError, match="has no duration"):
        sweep(made, out=tmp_path / "s")
    made.duration = 1.0
    made.robot("other", "swept.py:Cart", Lonely)
    with pytest.raises(ExperimentError, match="such as --replace robot/other=kin"):
        sweep(made, out=tmp_path / "s")
    real = Experiment("real", duration="1 s")
    real.robot("bot", "create2", "create2", options={"port": "none"})
    with pytest.raises(ExperimentError, match="drives a device"):
        sweep(real, out=tmp_path / "s")


def test_the_time_that_is_left() -> None:
    lines: list[str] = []
    progress = Progress(180, 60, lines.append)
    progress.add(failed=True)
    progress.look()
    assert lines == []  # it was too short
    assert str(progress).startswith("61 of 180 runs, 1 failed, ")
    assert str(progress).endswith(" left")
    assert [left(s) for s in (20, 600, 9000)] == [
        "20 s left",
        "10 min left",
        "2.5 h left",
    ]
