"""Identification on planted drives: what is found, what cannot be, and how sure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import rems_net
from rems_net import Definition, Experiment, In, Out, Schema, Settings, Woodbot
from rems_net.errors import ExperimentError
from rems_net.identification.drive import Drive, drive_of
from rems_net.identification.fit import Fit, fit
from rems_net.identification.identify import identify
from rems_net.identification.intervals import student
from rems_net.identification.prediction import Predictor, made, whole
from rems_net.units import length, time, velocity
from tests.robots.lab import FOLDER, recording

#: m, m, rad. Noise of the planted readings.
NOISE = np.array([0.0015, 0.0015, np.deg2rad(0.6)])
SLIP = 0.03
PREDICTOR = Predictor(Woodbot, {"arena_radius": 0})


def keys(random: np.random.Generator, rows: int) -> NDArray[np.float64]:
    """Return shares of full speed, as somebody presses keys for a while each."""
    pressed: list[float] = []
    while len(pressed) < rows:
        share = random.choice([-1.0, -0.5, 0.0, 0.5, 1.0, 1.0])
        pressed += [float(share)] * int(random.integers(3, 12))
    return np.array(pressed[:rows], np.float64)


def planted(
    seed: int,
    sides: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
    rows: int = 100,
) -> tuple[Drive, dict[str, float]]:
    """Return a drive of 10 s with slip and noisy readings, and its parameters."""
    random = np.random.default_rng(seed)
    left, right = sides or (keys(random, rows), keys(random, rows))
    true = {
        "track": float(random.uniform(0.09, 0.13)),
        "max_wheel_speed": float(random.uniform(6.5, 8.0)),
    }
    return driven(true, left, right, random), true


def driven(
    true: dict[str, float],
    left: NDArray[np.float64],
    right: NDArray[np.float64],
    random: np.random.Generator,
    stands: slice = slice(0),
) -> Drive:
    """Return a drive with these parameters, with slip and noisy readings.

    stands: rows in which the robot stands, although it is commanded to go
    """
    rows = len(left)
    slip = 1 + SLIP * random.standard_normal((2, rows))
    slip[:, stands] = 0.0
    time = np.arange(rows + 1, dtype=np.float64) * 0.1
    none = {path: np.zeros(rows + 1) for path in ("x", "y", "heading")}
    wheels = {
        "wheel/left": np.r_[0.0, left * slip[0]],
        "wheel/right": np.r_[0.0, right * slip[1]],
    }
    plan = whole(Drive("plan", time, wheels, none))
    went = PREDICTOR(plan, plan.starts(), true)[:, 0]
    read = went + NOISE[:, None] * random.standard_normal(went.shape)
    shares = {"wheel/left": np.r_[0.0, left], "wheel/right": np.r_[0.0, right]}
    return Drive("planted", time, shares, dict(zip(none, read, strict=True)))


#: five parameters: where the search begins, their ranges, and from where true ones are
FIVE = {
    "track": (0.1126, (0.001, 1.0), (0.09, 0.13)),
    "max_wheel_speed": (7.3, (0.01, 100.0), (6.5, 8.0)),
    "actuation/lag": (0.06, (0.0, 2.0), (0.03, 0.15)),
    "actuation/delay": (0.03, (0.0, 2.0), (0.02, 0.15)),
    "actuation/gain/wheel/right": (1.0, (0.0, 2.0), (0.9, 1.1)),
}


def fitted(drive: Drive, names: Mapping[str, Any]) -> Fit:
    begin = {name: FIVE[name][0] for name in names}
    return fit(PREDICTOR, [drive], begin, {name: FIVE[name][1] for name in names})


def held(seeds: range) -> Mapping[str, int]:
    """Return how many 95 % intervals hold the truth, by parameter."""
    found = dict.fromkeys(FIVE, 0)
    for seed in seeds:
        random = np.random.default_rng(seed)
        left, right = keys(random, 100), keys(random, 100)
        true = {name: random.uniform(*span) for name, (_, _, span) in FIVE.items()}
        one = fitted(driven(true, left, right, random), FIVE)
        for name in FIVE:
            found[name] += abs(one.values[name] - true[name]) <= one.half[name]
    return found


def test_intervals_hold_the_truth() -> None:
    """By the binomial law, 95 % of 12 is at least 9 in 99.8 of 100 cases."""
    assert all(count >= 9 for count in held(range(12)).values())


@pytest.mark.slow  # 200 fits
@pytest.mark.timeout(900)
def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    assert all(182 <= count <= 196 for count in held(range(200)).values())


def test_an_unseen_part_is_predicted_better() -> None:
    random, true = np.random.default_rng(1), {"track": 0.1, "max_wheel_speed": 6.6}
    drive = driven(true, keys(random, 100), keys(random, 100), random)
    found = identify([drive], Woodbot, parameters={"arena_radius": 0})
    assert set(found.adopted()) == {"track", "max_wheel_speed"}
    for one in found.parameters:
        if one.adopted:
            assert abs(one.value - true[one.name]) < 0.05 * true[one.name]
    assert found.after["x"] < 0.5 * found.before["x"]
    lines = str(found).splitlines()
    assert lines[-1].startswith('  parameters = { track = "')
    (stays,) = (line for line in lines if line.startswith("wheel_radius"))
    assert "only its combination with max_wheel_speed shows" in stays


def test_a_straight_drive_does_not_show_the_track() -> None:
    ahead = keys(np.random.default_rng(5), 100)
    drive, _ = planted(5, (ahead, ahead))
    drive.state["heading"][:] = 0.0
    drive.state["y"][:] = 0.0
    found = identify([drive], Woodbot, parameters={"arena_radius": 0})
    assert set(found.adopted()) == {"max_wheel_speed"}
    assert not any(one.name == "track" and one.adopted for one in found.parameters)


def test_a_jolt_costs_one_segment() -> None:
    drive, true = planted(2)
    for path in ("x", "y"):
        drive.state[path][47:] += 0.1  # somebody has pushed it
    one = fitted(drive, true)
    assert one.jolts == [pytest.approx(4.2)]
    for name, value in one.values.items():
        assert abs(value - true[name]) < 0.06 * true[name]


def test_a_robot_that_stands_is_refused() -> None:
    drive, _ = planted(3, (np.zeros(100), np.zeros(100)))
    for values in drive.state.values():
        values[:] = 0.25
    with pytest.raises(ExperimentError, match="nothing moves in the recording"):
        identify([drive], Woodbot)


class Cart(Definition):
    parameters = Settings(lag=time(default=0.3, range=(0.01, 10)))
    command = In(Schema("command", {"speed": velocity(range=(-1, 1))}))
    state = Out(Schema("state", {"x": length(), "speed": velocity()}))

    def derivative(self, state, command):  # type: ignore[no-untyped-def]
        missing = command["speed"] - state["speed"]
        return {"x": state["speed"], "speed": missing / self.parameters.lag}


def test_a_definition_of_ones_own_is_identified_from_its_recording(tmp_path) -> None:  # type: ignore[no-untyped-def]
    lab = Experiment("lab", dt="50 ms", duration="10 s")
    lab.robot("real", Cart, "kinematic", parameters={"lag": "0.5 s"})
    with lab.engine(tmp_path) as engine:
        for speed in (0.3, -0.4, 0.8, 0.0, -0.2) * 4:
            engine.put("robot/real/command", {"speed": speed})
            engine.step(8)
    recording = rems_net.read(tmp_path)
    found = rems_net.identify(
        recording, "real", definition=Cart, parameters={"lag": 0.3}
    )
    (lag,) = found.parameters
    assert lag.adopted
    assert lag.value == pytest.approx(0.5, rel=1e-3)
    again = rems_net.identify(recording, "real", definition=Cart)
    assert again.adopted() == {}  # it was recorded with 0.5 s
    assert str(again).endswith("predict best; change nothing.")


def test_the_model_of_the_class_is_recognised(tmp_path) -> None:  # type: ignore[no-untyped-def]
    """It makes one step of Euler a row; by arcs its track would be 3 % too wide."""
    lab = Experiment("lab", dt="100 ms", duration="6 s")
    lab.robot("sim", "woodbot", "kinematic", parameters={"track": "100 mm"})
    with lab.engine(tmp_path) as engine:
        for left, right in ((3, 5), (5, 2), (-2, -4), (4, 4), (5, -5)) * 3:
            engine.put("robot/sim/command", {"wheel": {"left": left, "right": right}})
            engine.step(4)
    found = rems_net.identify(
        rems_net.read(tmp_path), "sim", parameters={"track": "120 mm"}
    )
    track = next(one for one in found.parameters if one.name == "track")
    assert track.value == pytest.approx(0.1, rel=1e-9)
    assert any("one step of Euler's rule" in note for note in found.notes)


@pytest.mark.parametrize(("freedom", "point"), [(1, 12.706), (4, 2.776), (30, 2.042)])
def test_the_points_of_students_t_are_those_of_tables(
    freedom: int, point: float
) -> None:
    assert student(freedom) == pytest.approx(point, rel=3e-3)


@pytest.mark.parametrize(("first", "most"), [(True, 0.0065), (False, 0.0085)])
def test_a_half_of_the_class_recording_is_predicted_from_the_other(
    first: bool, most: float
) -> None:
    rows = recording("Webots02_09_2023_17_17_51.csv")
    assert rows
    constants = {"track": "100 mm", "max_wheel_speed": "6.8 rad/s"}
    columns = rems_net.read(FOLDER, like="woodbot-class")
    name = next(name for name in columns if "Webots" in name)
    whole_drive = drive_of(columns[name], made(Woodbot, constants))
    half = len(whole_drive) // 2
    parts = [whole_drive.part(slice(0, half + 1)), whole_drive.part(slice(half, None))]
    seen, unseen = parts if first else parts[::-1]
    found = identify([seen], Woodbot, parameters=constants)
    values = {one.name: one.value for one in found.parameters if one.adopted}
    one = whole(unseen)
    went = Predictor(Woodbot, constants)(one, one.starts(), values)
    off = np.array([went[i] - one.read[p] for i, p in enumerate(one.read) if p in "xy"])
    assert float(np.sqrt((off**2).sum(axis=0).mean())) <= most
