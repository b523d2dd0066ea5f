"""Noise has the size that was stated, and is the same in every run."""

from statistics import fmean, stdev
from typing import Any

import numpy as np
import pytest

from rems_net.agents.registry import BUILT_IN
from rems_net.agents.robot import Definition, Driver, combine
from rems_net.agents.runtime import runtime
from rems_net.bodies.noise import Noise, Noisy
from rems_net.defdict import Schema, length, number
from rems_net.drivers.kinematic.kinematic import Kinematic
from rems_net.drivers.physics.mujoco import Mujoco
from rems_net.drivers.physics.pybullet import Pybullet
from rems_net.errors import SchemaError
from rems_net.robots.epuck import COUNTED, TABLE, Epuck
from rems_net.robots.woodbot import Woodbot
from tests.drivers.physics.test_physics import needs
from tests.robots.gallery import made

SENSORS = Schema(
    "sensors", {"range": {"a": length(), "b": length(range=(0, 1.0))}, "c": number()}
)
COUNT = 2000


def reads(noises: dict[str, Noise], seed: str = "1", **true: float) -> dict[str, Any]:
    noisy = Noisy(SENSORS, noises, seed)
    found: dict[str, list[float]] = {path: [] for path in SENSORS.paths}
    for _ in range(COUNT):
        sensors = SENSORS(
            {f"range/{k}" if k in "ab" else k: v for k, v in true.items()}
        )
        noisy.add(sensors)
        for path, values in found.items():
            values.append(sensors[path])
    return found


def test_it_has_the_size_that_was_stated() -> None:
    found = reads({"range/a": Noise(relative=0.04), "c": Noise(absolute=0.5)}, a=2.0)
    assert fmean(found["range/a"]) == pytest.approx(2.0, abs=0.01)
    assert stdev(found["range/a"]) == pytest.approx(0.08, rel=0.08)
    assert stdev(found["c"]) == pytest.approx(0.5, rel=0.08)
    assert set(found["range/b"]) == {0.0}
    within = sum(abs(value - 2.0) < 0.08 for value in found["range/a"]) / COUNT
    assert within == pytest.approx(0.683, abs=0.03)  # of a normal distribution


def test_a_bias_stays() -> None:
    def first(seed: str) -> float:
        sensors = SENSORS()
        Noisy(SENSORS, {"c": Noise(bias=0.05)}, seed).add(sensors)
        return float(sensors["c"])

    found = {first(seed) for seed in "abcdefgh"}
    assert len(found) == 8
    assert max(map(abs, found)) <= 0.05
    once = reads({"c": Noise(bias=0.05)}, "a")["c"]
    assert len(set(once)) == 1


def test_it_stays_within_the_range() -> None:
    found = reads({"range/*": Noise(absolute=5.0)}, b=0.9)["range/b"]
    assert min(found) == 0.0
    assert max(found) == 1.0


def test_a_table_says_how_large_it_is_where() -> None:
    noise = Noise(table=((0.0, 0.2), (1.0, 0.0), (2.0, 0.5)), absolute=0.1)
    found = [noise.spread(read) for read in (-1.0, 0.0, 0.5, 1.0, 1.5, 2.0, 9.0)]
    assert found == pytest.approx([0.3, 0.3, 0.2, 0.1, 0.35, 0.6, 0.6])
    with pytest.raises(SchemaError, match=r"in a table of noise rise.*\[1.0, 0.0\]"):
        Noise(table=((1.0, 0.0), (0.0, 0.0)))


def test_what_is_counted_comes_in_steps() -> None:
    """As an encoder is read: to the nearest, half a step off at the most."""
    for true in (0.0, 0.024, 0.026, -0.074):
        (read,) = set(reads({"c": Noise(step=0.05)}, c=true)["c"])
        assert read == pytest.approx(0.05 * round(true / 0.05))


def test_what_an_epuck_counts_is_off_by_its_share() -> None:
    """Told in metres and counted again, the noise is what Webots has of the counts."""
    schema, path = Epuck.sensors.schema, "proximity/0"
    noisy = Noisy(schema, Epuck().noise(), "1")
    for counts, at, share in TABLE[1:-1]:
        found = []
        for _ in range(300):
            sensors = schema({path: at})
            noisy.add(sensors)
            found.append(sensors.to(COUNTED)[path])
        assert fmean(found) == pytest.approx(counts, rel=0.03)
        assert stdev(found) / counts == pytest.approx(share, rel=0.35)


def at_rest(name: str, driver: type[Driver], noise: bool) -> list[list[float]]:
    """What a shipped robot reads, three times, in an arena where it has one."""
    robot: Any = combine(type(made(name)), driver)("r", options={"noise": noise})
    if "arena_radius" in robot.parameters:
        robot.parameters["arena_radius"] = 0.06 if name == "epuck" else 2.0
    runtime(robot).seed = 7
    robot.prepare()
    robot.open()
    found = []
    for _ in range(3):
        robot.drive(robot.command, 0.01)
        robot.sense()
        senses = robot.sensors.leaves() if "sensors" in robot.schemas() else []
        found.append([float(read) for read in senses])
    robot.close()
    return found


#: but the e-puck that sees, which without its pictures is the other, and the camera
EYES = ("epuck_camera", "camera")
ROBOTS = [name for name in BUILT_IN["definition"] if name not in EYES]


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize(
    "driver",
    [
        pytest.param(Mujoco, marks=needs("mujoco")),
        pytest.param(Pybullet, marks=needs("pybullet")),
    ],
)
def test_every_robot_has_it(name: str, driver: type[Driver]) -> None:
    """Whoever does it: of the same seed the same noise."""
    plain, noisy = (at_rest(name, Kinematic, noise) for noise in (False, True))
    there = np.array(at_rest(name, driver, True))
    # The engines' wall of 64 pieces is no circle; and SCALER's arms sink as they begin.
    near = 0.05 if name.startswith("scaler") else 3e-3
    np.testing.assert_allclose(there, noisy, atol=near)
    apart = np.abs(np.subtract(noisy, plain)).max(initial=0.0)
    assert (apart > 2e-4) == (name in NOISY)


#: those whose noise is more than the steps in which something is counted
NOISY = ("woodbot", "epuck", "pioneer3dx", "pioneer3at")


def test_the_seed_says_what_it_is() -> None:
    noises = {"c": Noise(absolute=1.0)}
    assert reads(noises, "1") == reads(noises, "1")
    assert reads(noises, "1") != reads(noises, "2")
    first = Noisy(SENSORS, noises, "rems")
    sensors = SENSORS()
    first.add(sensors)
    assert sensors["c"].hex() == GOLDEN


#: the same on every system: products, sums and roots alone
GOLDEN = "-0x1.6ca0815ca5ddcp+0"


def test_what_is_not_there_is_refused() -> None:
    with pytest.raises(SchemaError, match=r"names 'lidar', .* there is range/a"):
        Noisy(SENSORS, {"lidar": Noise(1.0)}, "")
    with pytest.raises(SchemaError, match="not less than 0"):
        Noise(absolute=-1.0)


def run(seed: int = 7, **more: Any) -> list[float]:
    robot = combine(Woodbot, Kinematic)("r", **more)
    runtime(robot).seed = seed
    robot.prepare()
    robot.open()
    found = []
    for _ in range(2):
        robot.reset()
        for _ in range(20):
            robot.drive(robot.command, 0.1)
            robot.sense()
            found.append(robot.sensors["lidar/front"])
    return found


def test_a_robot_has_it_on_request() -> None:
    assert len(set(run())) == 1
    noisy = run(options={"noise": True})
    assert len(set(noisy)) == 20
    assert noisy[:20] == noisy[20:]  # after a reset the same again
    assert noisy == run(options={"noise": True})
    assert noisy != run(8, options={"noise": True})
    assert stdev(noisy) == pytest.approx(0.04 * 0.39, rel=0.6)


def test_a_definition_that_states_none_is_told_how() -> None:
    class Silent(Definition):
        command, state = Woodbot.command, Woodbot.state
        parameters, sensors = Woodbot.parameters, Woodbot.sensors
        derivative, measure = Woodbot.derivative, Woodbot.measure

    with pytest.raises(SchemaError, match=r"Silent has no noise\(\)(?s:.*)def noise"):
        combine(Silent, Kinematic)("s", options={"noise": True}).prepare()


@needs("mujoco")
def test_noise_of_what_is_not_there_is_told_before_anything_starts() -> None:
    class Typo(Woodbot):
        def noise(self) -> dict[str, Noise]:
            return {"lidr/*": Noise(relative=0.1)}

    robot = combine(Typo, Mujoco)("t", options={"noise": True})
    with pytest.raises(SchemaError, match=r"names 'lidr/\*'.*lidar/front"):
        robot.prepare()
