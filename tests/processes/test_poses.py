"""Poses in an estimator: each counts when its picture was taken, and is not missed."""

from __future__ import annotations

from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rems_net
from rems_net import (
    DefDict,
    Definition,
    Experiment,
    In,
    Input,
    Out,
    Process,
    Schema,
    Settings,
    Tick,
    Woodbot,
    cos,
    sin,
)
from rems_net.agents.protocol.plan import HERE
from rems_net.cli import main
from rems_net.errors import ExperimentError
from rems_net.events import Event, listening
from rems_net.processes.localise import POSE
from rems_net.units import (
    angle,
    angular_velocity,
    deg,
    integer,
    length,
    mm,
    percent,
    s,
    velocity,
)
from tests.commands import ROOT
from tests.pages import blocks
from tests.processes.test_estimators import KINDS, covariance

DT, SLIP = 0.05, 0.03
#: of the camera: standard deviations, m and rad, and a correlation of x and heading
SPREAD, SHARED = (0.002, 0.003, 0.02), 0.5


class Keys(Input):
    """Speeds of the wheels, about 0.1 m/s, and how fast these really turn."""

    value = Out(Woodbot.command)
    slipped = Out(Woodbot.command)

    def read(self, tick: Tick) -> None:
        if tick.n % 14 == 1:
            sides = ("wheel/left", "wheel/right")
            self.speeds = {side: self.random.uniform(3.0, 6.0) for side in sides}
        self.value = self.speeds
        self.slipped = {
            side: speed * (1 + self.random.gauss(0, SLIP))
            for side, speed in self.speeds.items()
        }


class Eye(Process):
    """Sees a robot in every n-th picture, and publishes the pose some ticks later.

    stamped: ticks by which it believes that a picture is newer than it is
    """

    options = Settings(
        late=integer(default=3),
        pictures=integer(default=1),
        covered=integer(default=10**6),
        again=integer(default=10**6),
        stamped=integer(default=0),
    )
    robot = In(source="robot/sim/state")
    value = Out(POSE)

    def open(self) -> None:
        self.states: list[Any] = []

    def step(self, tick: Tick) -> None:
        o = self.options
        self.states.append(self.robot.to_array())
        shot = tick.n - o.late
        there = shot < o.covered or shot >= o.again
        if shot < 1 or shot % o.pictures or not there:
            return
        spread = np.diag(np.square(SPREAD))
        spread[0, 2] = spread[2, 0] = SHARED * SPREAD[0] * SPREAD[2]
        noise = [self.random.gauss(0, 1) for _ in range(3)]
        pose = self.states[shot - 1] + np.linalg.cholesky(spread) @ noise
        x, y, heading = pose.tolist()
        self.value = {
            **{"id": 3, "x": x, "y": y, "heading": heading, "covariance": spread},
            **{"tick": shot + o.stamped, "age": (o.late - o.stamped) * tick.dt},
        }


def lab(
    kind: str = "ekf",
    seed: int = 0,
    eye: dict[str, Any] | None = None,
    host: str = "",
    start: dict[str, Any] | None = None,
    every: int = 1,
    **options: Any,
) -> Experiment:
    """A robot that drives about, a camera, and an estimator that reads no sensors."""
    made = Experiment(
        "lab", dt=DT, seed=seed, duration="3 s", folder=Path(__file__).parent
    )
    made.input("keys", Keys)
    at = start or {"x": 0.1, "y": -0.2, "heading": 3.0}
    made.robot("sim", Woodbot, "kinematic", command="input/keys/slipped", initial=at)
    made.process("eye", Eye, options=eye or {})
    options = {"definition": "woodbot", "slip": SLIP, **options}
    words = {"command": "input/keys/value", "pose": "process/eye"}
    more = {"host": host} if host else {}
    made.process("it", kind, options=options, every=every, **words, **more)
    return made


def errors(engine: Any) -> Any:
    it, robot = engine["process/it"], engine["robot/sim"]
    off = it.state.to_array() - robot.state.to_array()
    off[2] -= 2 * pi * round(off[2] / (2 * pi))
    return off


def nees(made: Experiment, ticks: int = 60, every: int = 10) -> list[float]:
    """Return squared errors by the stated covariance, per dimension, in one run."""
    found = []
    with made.engine() as engine:
        engine.step(12)  # it does not know where the robot is before the first pose
        for _ in range(ticks // every):
            engine.step(every)
            off, stated = errors(engine), covariance(engine["process/it"])
            found.append(float(off @ np.linalg.solve(stated, off)) / 3)
    return found


def warnings(events: list[Event]) -> list[str]:
    return [one.text for one in events if one.agent == "process/it"]


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_as_sure_as_it_should_be_with_poses_that_are_old(kind: str) -> None:
    """The mean of 20 runs of six looks deviates by about 0.1."""
    found = [nees(lab(kind, seed, {"pictures": 2})) for seed in range(20)]
    assert 0.75 < np.mean(found) < 1.3


@pytest.mark.slow  # 1000 runs
@pytest.mark.timeout(900)
@pytest.mark.parametrize("eye", [{}, {"late": 4, "pictures": 7}])
@pytest.mark.parametrize("kind", KINDS)
def test_with_poses_in_250_runs(kind: str, eye: dict[str, Any]) -> None:
    found = np.array([nees(lab(kind, seed, eye)) for seed in range(250)])
    print(kind, eye, found.mean(), found.mean(axis=0))
    assert 0.8 < found.mean() < 1.25
    assert ((found.mean(axis=0) > 0.8) & (found.mean(axis=0) < 1.25)).all()


def test_with_sensors_too() -> None:
    """A gyroscope's offset is found by the camera, and the bridge is better."""
    made = []
    for seed in range(10):
        one = lab(seed=seed, eye={"pictures": 5})
        one.plans["robot/sim"].options = {"noise": True}
        one.plans["process/it"].sources["sensors"] = "robot/sim/sensors"
        made += nees(one)
    assert 0.65 < np.mean(made) < 1.4


def test_an_old_pose_that_counts_as_new_is_wrong() -> None:
    """The tests above would notice it: at 0.15 s it is off by 15 mm."""
    found = [nees(lab(seed=seed, eye={"stamped": 3})) for seed in range(4)]
    assert np.mean(found) > 20


def test_a_picture_within_a_step_is_put_in_there() -> None:
    """It steps at every second tick, and the pictures are of odd ticks, too."""
    slip = SLIP / sqrt(2)  # of a step; the ticks in it slip on their own
    found = [
        nees(lab(seed=seed, eye={"pictures": 3}, every=2, slip=slip))
        for seed in range(16)
    ]
    assert 0.7 < np.mean(found) < 1.4


def test_two_seconds_without_a_picture_are_bridged() -> None:
    eye, ends = {"covered": 20, "again": 61}, []
    for seed in range(12):
        with lab(seed=seed, eye=eye).engine() as engine:
            engine.step(63)  # picture 61 comes at tick 65
            start = engine["robot/sim"].state.to_array()
            far = float(np.hypot(*errors(engine)[:2]))
            ends.append(far)
            sure = engine["process/it"].deviation.to_array()
            engine.step(5)
            assert (engine["process/it"].deviation.to_array() < sure).all()
            went = np.hypot(*(engine["robot/sim"].state.to_array() - start)[:2])
            assert went > 0.01
    assert 0 < max(ends) < 0.015


def test_the_first_pose_is_where_it_starts() -> None:
    """Before it, the estimate is 10 m unsure; afterwards, as unsure as the pose."""
    with lab().engine() as engine:
        it = engine["process/it"]
        engine.step(4)
        assert it.deviation.x == pytest.approx(10.0)
        engine.step()  # the picture of tick 1 is there at tick 4, and read at tick 5
        assert it.deviation.x == pytest.approx(SPREAD[0], rel=0.1)
        assert np.abs(errors(engine)[:2]).max() < 0.01


def test_a_robot_that_was_moved_by_hand_is_found_again() -> None:
    """Here its start is wrong by 224 mm, and counts as known."""
    events: list[Event] = []
    with listening(events.append), lab(initial="x = 0").engine() as engine:
        engine.step(30)
        assert np.abs(errors(engine)[:2]).max() < 0.01
    (text,) = warnings(events)
    assert "the robot was 21" in text
    assert "degrees from where its commands led: it was moved by hand" in text


def test_a_pose_that_is_too_old_is_passed_over_with_a_warning() -> None:
    events: list[Event] = []
    with listening(events.append), lab(eye={"late": 25}).engine() as engine:
        engine.step(60)
        assert engine["process/it"].deviation.x == pytest.approx(10.0)
    (text,) = warnings(events)
    assert "a pose is 1.3 s old, and 1 s are kept" in text


def test_a_pose_without_a_covariance_is_passed_over_with_a_warning() -> None:
    class Sure(Eye):
        def step(self, tick: Tick) -> None:
            self.value = {"x": 0.1, "tick": tick.n}

    events: list[Event] = []
    made = lab()
    made.plans["process/eye"].classes = [Sure]
    with listening(events.append), made.engine() as engine:
        engine.step(20)
        assert engine["process/it"].deviation.x == pytest.approx(10.0)
    (text,) = warnings(events)
    assert "a pose has no covariance" in text


class Go(Process):
    """Drives ahead once the robot's place is known."""

    unsure = In(source="process/it/deviation")
    value = Out(Schema("go", {"wheel": {"left": percent(), "right": percent()}}))

    def step(self, tick: Tick) -> None:
        speed = 50.0 if 0.0 < self.unsure["x"] < 1.0 else 0.0
        self.value = {"wheel": {"left": speed, "right": speed}}


def test_a_robot_that_obeys_it_stops_after_the_bridge() -> None:
    """The last picture is of tick 19: a bridge of 0.6 s, and 0.5 s of its max_age."""
    made = lab(eye={"covered": 20}, bridge=0.6)
    made.process("go", Go)
    made.plans["robot/sim"].sources["command"] = "process/go"
    made.plans["process/it"].sources["command"] = "robot/sim/command"
    with made.engine() as engine:
        places = []
        for _ in range(60):
            engine.step()
            places.append(engine["robot/sim"].state.x)
    moving = np.abs(np.diff(places)) > 1e-4
    (last,) = np.flatnonzero(np.diff(moving.astype(int)) < 0)
    assert last + 2 == pytest.approx(19 + (0.6 + 0.5) / DT, abs=2)


def test_the_same_bytes_in_one_process_and_in_many(tmp_path: Path) -> None:
    def rows(how: str) -> dict[str, list[float]]:
        made = lab(eye={"covered": 20, "again": 40})
        made.plans["input/keys"].host = made.plans["robot/sim"].host = HERE
        run = made.run(tmp_path / how, direct=how == "direct")
        found = rems_net.read(run.folder)["process/it"]
        ports = ("state/x", "state/heading", "covariance/x/heading", "deviation/y")
        return {port: [*found.plain(port)] for port in ports}

    direct = rows("direct")
    assert len(direct["state/x"]) == 60
    assert direct == rows("many")


#: made once: to make a unit takes longer than all the rest of a step
MM, DEG = mm / s, deg / s


class Cart(Definition):
    """A cart in mm and degrees."""

    command = In(Schema("c", {"speed": velocity(), "turn": angular_velocity()}))
    state = Out(
        Schema("s", {"x": length("mm"), "y": length("mm"), "heading": angle("deg")})
    )

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        v, heading = 1e3 * command["speed"], state["heading"] * pi / 180
        rates = {"x": v * cos(heading) * MM, "y": v * sin(heading) * MM}
        return rates | {"heading": command["turn"] * 180 / pi * DEG}


class Round(Input):
    value = Out(Cart.command)

    def read(self, tick: Tick) -> dict[str, float]:
        return {"speed": 0.1, "turn": 0.5}


class Metres(Process):
    """The exact pose of the cart, in m and rad, with the covariance of a camera."""

    robot = In(source="robot/sim/state")
    value = Out(POSE)

    def step(self, tick: Tick) -> None:
        r = self.robot
        pose = {"x": r.x / 1e3, "y": r.y / 1e3, "heading": r.heading * pi / 180}
        spread = np.diag(np.square(SPREAD))
        self.value = {**pose, "covariance": spread, "tick": tick.n}


def test_a_state_in_other_units() -> None:
    made = Experiment("lab", dt=DT)
    made.input("round", Round)
    start = {"x": 200.0, "heading": 90.0}
    made.robot("sim", Cart, "kinematic", command="input/round", initial=start)
    made.process("eye", Metres)
    words = {"command": "input/round", "pose": "process/eye"}
    made.process("it", "ekf", options={"definition": f"{__name__}:Cart"}, **words)
    with made.engine() as engine:
        engine.step(2)
        it, robot = engine["process/it"], engine["robot/sim"]
        first = [*it.deviation.to_array()]
        assert first == pytest.approx([2.0, 3.0, 0.02 * 180 / pi], rel=0.05)
        engine.step(10)
        assert it.state.to_array() == pytest.approx(robot.state.to_array(), abs=1e-3)


def test_an_in_that_is_left_out_is_not_shown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The page's experiment, with one camera more, and no sensors."""
    (text,) = blocks(ROOT / "docs" / "estimation.md", "toml")
    eyes = 'pose = "process/eyes/real"'
    text = text.replace('sensors = "robot/real/sensors"', eyes)
    text += """
        [[robot]]
        name = "cam"
        definition = "camera"
        driver = "kinematic"
        [[process]]
        name = "eyes"
        type = "localise"
        camera = "robot/cam/sensors"
        options = { robots = "real" }
        """
    (tmp_path / "lab.toml").write_text(text)
    main(["check", str(tmp_path / "lab.toml")])
    shown = (
        capsys.readouterr().out.partition("process/ekf")[2].split("process/eyes  ")[0]
    )
    assert "in   pose" in shown
    assert "sensors" not in shown


def test_an_estimator_that_nothing_corrects_is_refused() -> None:
    made = lab()
    del made.plans["process/it"].sources["pose"]
    with pytest.raises(
        ExperimentError, match=r"reads neither sensors nor a pose.*R1108"
    ):
        made.check()


class Slide(Definition):
    """It has no y."""

    command = In(Schema("slide.c", {"speed": velocity()}))
    state = Out(Schema("slide.s", {"x": length()}))

    def derivative(self, state: DefDict, command: DefDict) -> dict[str, Any]:
        return {"x": command["speed"]}


def test_a_state_without_a_pose_is_refused() -> None:
    made = lab(definition=f"{__name__}:Slide")
    with pytest.raises(ExperimentError, match=r"Slide has no 'y'.*R1108"):
        made.check()
