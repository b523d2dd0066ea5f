"""An experiment is an environment that Gymnasium accepts, and every mistake teaches."""

from __future__ import annotations

import warnings
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="gymnasium is not installed")

from gymnasium.utils.env_checker import check_env  # noqa: E402
from hypothesis import (  # noqa: E402
    given,
    settings,
    strategies as st,
)

import rems_net.gym  # noqa: E402
from rems_net import Definition, Experiment, In, Out, Schema  # noqa: E402
from rems_net.cli import main  # noqa: E402
from rems_net.drivers.kinematic.kinematic import Kinematic  # noqa: E402
from rems_net.errors import ExperimentError, FieldValueError, SchemaError  # noqa: E402
from rems_net.events import Event, listening  # noqa: E402
from rems_net.gym.vector import AsColumns, AsEngines, AsStages  # noqa: E402
from rems_net.units import array, boolean, choice, integer, length, text  # noqa: E402
from tests.gym.labs import COMMAND, ROBOTS, SENSORS, STATE, alone, made  # noqa: E402

#: Warnings about what a definition does not state: a field without a range is infinite.
THEIRS = ("infinity", "is infinite")


@pytest.mark.parametrize("robot", ROBOTS)
def test_gymnasium_accepts_every_robot_of_the_house(robot: str) -> None:
    if robot == "epuck_camera":
        driver = "mujoco"
        pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    else:
        driver = "kinematic"
    try:
        env = made(alone(robot, driver), normalise=True, limit="50 ms")
    except ExperimentError as error:
        pytest.skip(f"drawing without a window needs {error}")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(env, skip_render_check=True)
    said = [str(one.message) for one in caught]
    assert not [one for one in said if not any(word in one for word in THEIRS)]


class Machine(Definition):
    """A robot with fields of every kind."""

    command = In(
        Schema(
            "command",
            {
                "go": choice("halt", "ahead", "back"),
                "lamp": boolean(),
                "count": integer(range=(0, 9)),
                "aim": array(2, "m", range=(-1, 1)),
            },
        )
    )
    state = Out(Schema("state", {"x": length(range=(-1, 1)), "gone": choice("a", "b")}))

    def derivative(self, state: Any, command: Any) -> dict[str, Any]:
        """Return the speed of what is chosen."""
        return {"x": {"halt": 0.0, "ahead": 0.1, "back": -0.1}[command["go"]]}


def test_choices_booleans_and_arrays() -> None:
    """Each has its space; what a space samples is what the robot obeys."""
    lab = Experiment("lab", dt=0.1, duration=1.0)
    lab.robot("sim", Machine, "kinematic")
    env = made(lab, normalise=True)
    spaces = env.action_space.spaces
    assert spaces[f"{COMMAND}/go"] == gymnasium.spaces.Discrete(3)
    assert spaces[f"{COMMAND}/lamp"] == gymnasium.spaces.Discrete(2)
    assert env.units[f"{COMMAND}/aim"] == "m"
    env.reset(seed=1)
    env.action_space.seed(1)
    action = env.action_space.sample()
    action[f"{COMMAND}/go"] = np.int64(1)
    action[f"{COMMAND}/aim"] = np.array([0.5, -1.0])
    observation, *_ = env.step(action)
    obeyed = env.now.port(COMMAND)
    assert (obeyed["go"], obeyed["lamp"]) == ("ahead", bool(action[f"{COMMAND}/lamp"]))
    assert obeyed["count"] == action[f"{COMMAND}/count"]
    assert obeyed["aim"].tolist() == [0.5, -1.0]
    assert observation[f"{STATE}/x"] == pytest.approx(0.01)
    assert observation in env.observation_space
    env.close()


def test_units_ranges_and_normalised_numbers() -> None:
    lab = alone(parameters={"max_wheel_speed": 5.0})
    plain, scaled = made(lab), made(lab, normalise=True)
    assert plain.action_space.high.tolist() == [5.0, 5.0]
    assert scaled.action_space.high.tolist() == [1.0, 1.0]
    assert plain.units[f"{COMMAND}/wheel/left"] == "rad/s"
    assert plain.units[f"{STATE}/x"] == "m"
    plain.reset(seed=1)
    scaled.reset(seed=1)
    one, *_ = plain.step(np.array([2.5, -5.0]))
    other, *_ = scaled.step(np.array([0.5, -1.0]))
    assert one.tolist() == other.tolist()


@pytest.mark.parametrize("driver", ["kinematic", "mujoco"])
@given(history=st.lists(st.integers(0, 30), max_size=2), seed=st.integers(0, 99))
@settings(max_examples=4, derandomize=True)
def test_the_same_seed_gives_the_same_episode_after_any_history(
    driver: str, history: list[int], seed: int
) -> None:
    """Start, noise and motion: to the last bit, whatever came before."""
    if driver == "mujoco":
        pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    start = {"robot/sim.x": "-10..10 cm", "robot/sim.heading": "-180..180 deg"}
    env = made(alone(driver=driver, options={"noise": True}), start=start)

    def episode() -> bytes:
        random = np.random.default_rng(seed)
        first, _ = env.reset(seed=seed)
        rows = [env.step(random.uniform(-7, 7, 2))[0] for _ in range(8)]
        return np.array([first, *rows]).tobytes()

    alone_ = episode()
    for other, steps in enumerate(history):
        env.reset(seed=100 + other)
        for _ in range(steps):
            env.step(np.array([5.0, -3.0]))
    assert episode() == alone_
    assert env.reset(seed=seed + 1)[0].tobytes() != env.reset(seed=seed)[0].tobytes()
    env.close()


class Goal(rems_net.gym.Task):
    """Drive to x = 5 cm."""

    def reward(self, now: Any, before: Any) -> float:
        """Return the way that was gained."""
        return float(now["x"] - before["x"])

    def ends(self, now: Any) -> bool:
        """Return whether it is there."""
        return bool(now["x"] > 0.05)

    def start(self, random: Random) -> dict[str, dict[str, float]]:
        """Return a start at most 1 cm away."""
        return {"robot/sim": {"x": random.uniform(-0.01, 0.01)}}


def test_a_task_is_a_class_or_expressions_with_units() -> None:
    """Both give the same rewards, and the same end."""
    lab = alone()
    one = made(lab, task=Goal, limit="10 s")
    words = {"reward": "x - before.x", "ends": "state.x > 50 mm"}
    other = made(lab, **words, start={"robot/sim.x": "-1..1 cm"}, limit="10 s")
    one.reset(seed=2)
    other.reset(seed=2, options={"start": {"robot/sim": {"x": one.now["x"]}}})
    for _ in range(200):
        a, b = one.step([7.0, 7.0]), other.step([7.0, 7.0])
        assert a[1] == pytest.approx(b[1])
        assert a[2:4] == b[2:4]
        if a[2]:
            break
    assert one.now["x"] > 0.05


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("x > 1 ft or abs(y) > 1 m", False),
        ("hypot(x - 10 cm, y)", 0.15),
        ("-2 * x / 1 m + 1", 0.5),
        ("min(x, 10 cm) + max(y, 5 cm)", 0.15),
        ("sin(90 deg) - cos(heading)", 0.0),
        ("0 m < x < 30 cm", True),
        ("sqrt(x * x)", 0.25),
        ("command.wheel.left * 20 mm < 1 m/s", True),
        ("1 / y", float("nan")),
        ("sqrt(0 - 1)", float("nan")),
    ],
)
def test_expressions(expression: str, value: float) -> None:
    env = made(alone(), reward=f"{expression}", limit="1 s")
    env.reset(seed=1, options={"start": {"robot/sim": {"x": 0.25}}})
    reward = env.step([0.0, 0.0])[1]
    assert reward == pytest.approx(float(value), nan_ok=True)


def test_a_reward_that_teaches_nothing_is_warned_of_once() -> None:
    events: list[Event] = []
    env = made(alone(), reward="1 m / x")
    env.reset(seed=1)
    with listening(events.append):
        env.step([0.0, 0.0])
        env.step([0.0, 0.0])
    assert ["a reward is" in event.text for event in events] == [True]


def test_a_start_in_degrees_without_their_unit_is_warned_of() -> None:
    for start, warned in (("-180..180", 1), ((-20, 20), 1), ("-20..20 deg", 0)):
        events: list[Event] = []
        with listening(events.append):
            made(alone(), reward="x", start={"robot/sim.heading": start})
        assert len(events) == warned, start


class Talker(Definition):
    """A robot with a text."""

    command = In(Schema("command", {"say": text()}))
    state = Out(Schema("state", {"x": length()}))

    def derivative(self, state: Any, command: Any) -> dict[str, Any]:
        """Return no motion."""
        return {"x": 0.0}


MISTAKES = [
    ({"limit": None}, "no episode would end: write ends='x > 1 m' or limit='10 s'"),
    ({"act": "robot/sim/comand"}, "Did you mean 'robot/sim/command'?"),
    ({"observe": "robot/sim/stat"}, "Did you mean 'robot/sim/state'?"),
    ({"ends": "x > 1 s"}, "in 'x > 1 s' m and s do not fit"),
    ({"reward": "x + 1"}, "in 'x + 1' m and a plain number do not fit; write units"),
    ({"ends": "x > 1 furlongs2"}, "is not a unit that unyt knows"),
    ({"ends": "speed > 1"}, "'speed' is no value here; there is sim.state.x"),
    ({"ends": "x > "}, "it is no expression"),
    ({"ends": "x > 1 m and y"}, "'y' is a number, neither true nor false; compare it"),
    ({"ends": "not x"}, "'x' is a number, neither true nor false; compare it"),
    ({"ends": "x"}, "it is a number, neither true nor false"),
    ({"act": 5}, "act is 5; expected a key or a list of different keys"),
    ({"start": ["x"]}, "expected ranges of initial values, such as"),
    ({"reward": "x" + " + x" * 1000}, "it is no text of at most 1000 characters"),
    ({"reward": 5}, "it is no text of at most 1000 characters"),
    ({"reward": "x if y else 0"}, "cannot be calculated here"),
    ({"reward": "open('a')"}, "there is no function open() of 1; there is abs, atan2"),
    ({"reward": "mean(x)"}, "there is no function mean() of 1"),
    ({"start": {"robot/sim.z": "1..2 m"}}, "has no number 'z' in its start"),
    ({"start": {"robot/smi.x": "1..2 m"}}, "Did you mean 'robot/sim'?"),
    ({"start": {"robot/sim.x": "2..1 m"}}, "expected the lower end first"),
    ({"ticks": -1}, "expected a number of ticks"),
    ({"limit": "1 ms"}, "less than one step of 0.01 s"),
    ({"terminated": "x > 1 m"}, "ends="),
    ({"vector": 0}, "vector is 0"),
    ({"reward": "x^2"}, "'x ^ 2' cannot be calculated here; a power is x**2"),
    ({"reward": "math.sin(x)"}, "cannot be calculated here; write sin(...) alone"),
    ({"reward": "x > 1 m & y > 1 m"}, "calculated here; write `and` or `or`"),
    ({"ends": "x = 1 m"}, "it is no expression; == compares"),
    ({"reward": lambda now: 1}, "a function is a method of a class below Task"),
    ({"task": type("T", (rems_net.gym.Task,), {"rewards": 1})}, "Did you mean 'rewar"),
]


@pytest.mark.parametrize(("wrong", "sentence"), MISTAKES)
def test_a_mistake_is_one_sentence(wrong: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ExperimentError) as caught:
        made(alone(), **wrong)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_text_is_refused() -> None:
    lab = Experiment("lab", duration=1.0)
    lab.robot("sim", Talker, "kinematic")
    with pytest.raises(ExperimentError, match="robot/sim/command/say is text"):
        made(lab)


def test_a_robot_that_another_agent_drives_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "keys.csv"
    head = "time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]"
    file.write_text(f"{head}\n1.0,4.0,4.0\n")
    lab = Experiment("lab", dt=0.01)
    lab.input("keys", "csv", options={"file": str(file)})
    lab.robot("sim", "woodbot", "kinematic", command="input/keys")
    with pytest.raises(ExperimentError, match="which input/keys writes already"):
        made(lab)


def test_a_device_needs_a_fabric() -> None:
    lab = alone("create2", "create2", options={"port": "ttyRobot"})
    with pytest.raises(ExperimentError, match="make it with fabric=True"):
        made(lab)


class Lonely(Kinematic):
    """A driver of which a process holds one robot only."""

    one_per_process = True


def test_a_driver_that_is_alone_in_its_process_needs_a_fabric() -> None:
    with pytest.raises(ExperimentError, match=r"one robot only.*fabric=True"):
        made(alone(driver=Lonely))


def test_two_worlds_in_one_process() -> None:
    """Two environments, and two worlds in each: none changes another."""
    lab = Experiment("lab", dt=0.01)
    for name in ("sim", "other"):
        lab.robot(name, "woodbot", "kinematic", world=f"place_{name}")
    one, other = made(lab), made(lab, observe=STATE)
    one.reset(seed=1)
    other.reset(seed=1)
    for _ in range(5):
        found, *_ = one.step([3.0, 2.0])
        other.step([-3.0, -2.0])
    assert found[0] > 0 > other.now["sim/state/x"]
    again, *_ = [one.reset(seed=1), *(one.step([3.0, 2.0]) for _ in range(5))][-1]
    assert again.tolist() == found.tolist()


BAD = [
    ([1.0], "the action has the shape (1,); expected (2,)"),
    ("left", "the action has the shape (); expected (2,)"),
    ([[1.0], 2.0], "the action has the shape (); expected (2,)"),
    ([9.0, 0.0], "is 9 rad/s; expected -7.3 to 7.3 rad/s. To limit it"),
    ([np.nan, 0.0], "is nan rad/s; expected -7.3 to 7.3 rad/s. Does the policy"),
    ([10**400, 0.0], "the action has the shape (); expected (2,)"),
]


@pytest.mark.parametrize(("action", "sentence"), BAD)
def test_a_bad_action_is_one_sentence(action: Any, sentence: str) -> None:
    env = made(alone())
    env.reset(seed=1)
    with pytest.raises(FieldValueError) as caught:
        env.step(action)
    assert sentence in str(caught.value)
    env.step(np.array([1.0, 1.0]))  # nothing has happened
    many = made(alone(), vector=2)
    many.reset(seed=1)
    with pytest.raises(FieldValueError, match=r"of the action is|has the shape"):
        many.step([action, action])


class Odd(rems_net.gym.Task):
    """A task that gives a text as a reward."""

    def reward(self, now: Any, before: Any) -> Any:
        """Return no number."""
        return "much"


@pytest.mark.parametrize("vector", [None, 2])
@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"recrod": "runs/a"}, "expected record or start. Did you mean 'record'?"),
        ({"start": {"robot/smi": {"x": 0.1}}}, "Did you mean 'robot/sim'?"),
        ({"start": [0.1]}, "is [0.1]; expected initial values by robot, such as"),
        (None, "Odd: reward() returned 'much', and ends() False; expected a number"),
    ],
)
def test_an_odd_episode_is_one_sentence(
    vector: int | None, options: Any, sentence: str
) -> None:
    env = made(alone(), vector=vector, task=Odd)
    actions = np.ones((2, 2)[not vector :])
    with pytest.raises(ExperimentError) as caught:
        _ = env.reset(seed=1, options=options), env.step(actions)
    assert sentence in str(caught.value)


def test_clipped_actions_and_a_step_too_early() -> None:
    env = made(alone(), clip=True)
    with pytest.raises(ExperimentError, match=r"before the first reset\(\)"):
        env.step([1.0, 1.0])
    env.reset(seed=1)
    env.step([100.0, -100.0])
    assert env.now.port(COMMAND).leaves() == [7.3, -7.3]
    with pytest.raises(FieldValueError):  # NaN has no limit to go to
        env.step([np.nan, 0.0])
    env = made(alone(), reward="x", limit="20 ms")
    with pytest.raises(ExperimentError, match=r"before the first reset\(\)"):
        env.step([1.0, 1.0])
    with pytest.raises(ExperimentError, match="takes nothing by place"):
        env.reset(3)
    env.reset(seed=1)
    assert [env.step([1.0, 1.0])[3] for _ in "12"] == [False, True]
    with pytest.raises(ExperimentError, match=r"after the end of the episode"):
        env.step([1.0, 1.0])


def test_it_has_a_name_in_gymnasium() -> None:
    env = gymnasium.make("rems_net.gym:rems_net/Woodbot-v0")
    env.reset(seed=1)
    for _ in range(200):
        *_, reward, ended, cut, _ = env.step(np.array([1.0, 1.0]))
        if ended or cut:
            break
    assert ended
    assert not cut
    assert reward > 0
    lab = alone()
    same = gymnasium.make(
        "rems_net/Lab-v0", lab=lab, act=COMMAND, observe=STATE, limit="1 s"
    )
    assert same.reset(seed=1)[0].shape == (3,)


def test_an_episode_is_recorded_on_request_and_is_done_again(tmp_path: Path) -> None:
    """The one in the middle; its recording can be rerun, with the same bits."""
    env = made(alone(options={"noise": True}), observe=[STATE, SENSORS])
    seen = []
    for seed in (1, 2, 3):
        record = {"record": tmp_path / "one"} if seed == 2 else None
        env.reset(seed=seed, options=record)
        for _ in range(20):
            observation, *_ = env.step([3.0, 1.0])
            seen.append(observation[0])
    env.close()
    found = rems_net.read(tmp_path / "one")["sim"]
    assert found["state/x"].value.tolist()[-20:] == seen[20:40]
    assert main(["rerun", str(tmp_path / "one" / "run.mcap")]) == 0


def test_other_agents_begin_again_as_a_whole(tmp_path: Path) -> None:
    """A file that plays beside the environment plays from its start in each episode."""
    file = tmp_path / "keys.csv"
    head = "time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]"
    file.write_text(f"{head}\n0.05,4.0,3.0\n1.0,-2.0,2.0\n")
    lab = Experiment("lab", dt="10 ms", duration="1 s")
    lab.robot("sim", "woodbot", "kinematic")
    lab.input("keys", "csv", options={"file": str(file)})
    lab.robot("other", "woodbot", "kinematic", command="input/keys")
    env = made(lab, observe=[STATE, "robot/other/state"])

    def episode() -> Any:
        env.reset(seed=1)
        return [env.step([1.0, 2.0])[0].tolist() for _ in range(10)][-1]

    first = episode()
    assert first == episode()
    assert first[5] != 0.0


@pytest.mark.parametrize("driver", ["kinematic", "mujoco"])
def test_a_start_in_another_robot_is_one_sentence(driver: str) -> None:
    """The next start is free again."""
    if driver == "mujoco":
        pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    lab = Experiment("lab", dt=0.01)
    lab.robot("sim", "woodbot", driver, world="place")
    lab.robot("other", "woodbot", driver, world="place", initial={"x": 0.2})
    env = made(lab)
    env.reset(seed=1)
    with pytest.raises(SchemaError, match="where robot/other is; one place holds one"):
        env.reset(options={"start": {"robot/other": {"x": 0.01}}})
    env.reset(seed=1)
    env.step([1.0, 1.0])


def test_many_at_once_are_as_many_alone() -> None:
    """To the last bit, over the ends of episodes; a command that is too old ends."""
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    start = {"robot/sim.heading": "-180..180 deg"}
    usual = {"start": start, "reward": "x - before.x", "normalise": True}
    late = {"parameters": {"actuation/lag": "90 ms"}}
    for driver, ticks, robot, kind in (
        ("kinematic", 1, {}, AsColumns),
        ("kinematic", 60, {}, AsStages),
        ("kinematic", 1, late, AsStages),
        ("mujoco", 3, {"every": 3}, AsStages),
        ("mujoco", 60, {**late, "options": {"noise": True}}, AsEngines),
    ):
        lab, more = alone(driver=driver, **robot), {**usual, "ticks": ticks}
        more["limit"] = 0.06 * ticks
        many, ones = made(lab, vector=3, **more), [made(lab, **more) for _ in range(3)]
        assert type(many._many) is kind
        found, _ = many.reset(seed=7)
        rows = [one.reset(seed=7 + n)[0] for n, one in enumerate(ones)]
        assert found.tolist() == np.array(rows).tolist()
        random = np.random.default_rng(1)
        for _ in range(6):
            actions = random.uniform(-1, 1, (3, 2))
            found, rewards, _, cut, _ = many.step(actions)
            each = [one.step(a) for one, a in zip(ones, actions, strict=True)]
            assert found.tolist() == [row[0].tolist() for row in each]
            assert rewards == pytest.approx([row[1] for row in each])
        assert cut.all()
        found, rewards, _, cut, _ = many.step(actions)  # they begin again
        assert not cut.any()
        assert not rewards.any()
        assert found[:, 0].tolist() == [0.0] * 3
        many.close()


@pytest.mark.parametrize("wrong", [{"vector": -1}, {"vector": 2, "fabric": True}])
def test_a_wrong_vector_is_one_sentence(wrong: dict[str, Any]) -> None:
    with pytest.raises(ExperimentError, match="vector is "):
        made(alone(), **wrong)
