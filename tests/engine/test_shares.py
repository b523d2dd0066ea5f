"""A robot whose command several agents write, each some of its fields."""

from pathlib import Path
from typing import Any

import pytest

from rems_net import Experiment
from rems_net.agents.clock.clock import Clock
from rems_net.agents.experiment.file import load
from rems_net.agents.experiment.solo import Solo
from rems_net.agents.protocol.plan import HERE
from rems_net.agents.runtime import runtime
from rems_net.client import Fabric
from rems_net.errors import ExperimentError
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import Told, until
from tests.engine.sharers import Above, Base, Silent
from tests.engine.thrice import in_three_ways

PARTS = Path(__file__).parent


def youbot(*writers: str, **more: Any) -> Experiment:
    """An experiment of one youBot with these writers."""
    lab = Experiment("youbot", dt=0.1, duration=3.0, folder=PARTS)
    lab.input("base", "sharers.py:Base", **more)
    lab.process("arm", "sharers.py:Above", robot="robot/kuka/state", **more)
    lab.robot("kuka", "youbot", "kinematic", command=list(writers), **more)
    lab.output("log", "csv", **more)
    return lab


def told(engine: Solo) -> list[float]:
    """What the robot obeys: of the base, the arm, and what nobody writes."""
    command = engine["kuka"].command
    paths = ("linear/x", "arm/joint/1", "arm/speed", "linear/y", "arm/joint/5")
    return [command[path] for path in paths]


def test_each_writes_its_fields_and_the_others_are_safe() -> None:
    with youbot("input/base", "process/arm").engine() as engine:
        engine.step(1)
        assert told(engine) == [0.2, 0.0, 0.0, 0.0, 0.0]  # the arm is told next tick
        engine.step(4)
        assert told(engine) == [0.2, 0.5, 1.0, 0.0, 0.0]
        state = engine["kuka"].state
        assert state.x == pytest.approx(0.1)
        assert state["arm/joint/1"] == pytest.approx(0.5)


@pytest.mark.parametrize("silent", ["base", "arm"])
def test_only_the_fields_of_a_silent_writer_become_safe(silent: str) -> None:
    lab = Experiment("silent", dt=0.1, duration=3.0)
    lab.input("base", Silent if silent == "base" else Base)
    lab.process(
        "arm", Above, robot="robot/kuka/state", options={"quiet": silent == "arm"}
    )
    lab.robot("kuka", "youbot", "kinematic", command=["input/base", "process/arm"])
    with lab.engine() as engine:
        engine.step(6)
        both = [0.2, 0.5, 1.0, 0.0, 0.0]
        assert told(engine) == both
        engine.step(1)
        assert told(engine) == both  # what was said at tick 2 is obeyed for 0.5 s
        engine.step(1)
        safe = [0.0, *both[1:]] if silent == "base" else [0.2, 0.0, 0.0, 0.0, 0.0]
        assert told(engine) == safe
        engine.step(5)
        assert told(engine) == safe
        # What a device thread holds against the wall clock is of the one that speaks.
        assert runtime(engine["kuka"]).source_ticks["command"] >= 12


def test_one_writer_of_some_fields_leaves_the_others_safe() -> None:
    with youbot("process/arm").engine() as engine:
        engine.step(4)
        assert told(engine) == [0.0, 0.5, 1.0, 0.0, 0.0]


def test_stop_holds_all_fields() -> None:
    with youbot("input/base", "process/arm").engine() as engine:
        engine.step(4)
        engine.stop()
        engine.step(1)
        assert told(engine) == [0.0] * 5
        engine.release()
        engine.step(1)
        assert told(engine) == [0.2, 0.5, 1.0, 0.0, 0.0]


def test_the_same_bytes_in_the_engine_in_one_host_and_in_many() -> None:
    def build(host: dict[str, Any]) -> Experiment:
        return youbot("process/arm", "input/base", **host)

    rows = in_three_ways(build, "kuka.csv")["kuka.csv"].decode().splitlines()
    assert float(rows[-1].split(",")[1]) == 0.2
    assert len(rows) == 31


def test_a_writer_that_has_left_is_silent(tmp_path: Path) -> None:
    lab = youbot("input/base", "process/arm", host=HERE)
    lab.record = False
    lab.on_failure = "drop"
    lab.process("fails", "sharers.py:Fails", robot="robot/kuka/state")
    both = ["input/base", "process/fails"]
    lab.robot("other", "youbot", "kinematic", command=both, host=HERE)
    done = lab.run(tmp_path)
    assert done.ticks == 30
    rows = [row.split(",") for row in (tmp_path / "other.csv").read_text().splitlines()]
    speed = rows[0].index("command/arm/speed [ratio]")
    assert {row[speed] for row in rows[4:8]} == {"1.0"}
    assert {row[speed] for row in rows[20:]} == {"0.0"}
    assert {row[1] for row in rows[1:]} == {"0.2"}


@pytest.mark.parametrize(
    ("writers", "says"),
    [
        (
            ["input/base", "input/again"],
            "robot 'kuka': input/base/value and input/again/value both write "
            "'linear/x' of its command; a field has one writer: leave it out of the "
            "schema of one, or let a process choose.",
        ),
        (
            ["input/base", "input/other"],
            "robot 'kuka': input/other/value is one of several writers of "
            "robot/kuka/command and gives none of its fields: it has left, and ",
        ),
        (
            ["input/base", "input/base"],
            "robot 'kuka': command is ['input/base', 'input/base']; expected one "
            "writer, such as 'input/keys', or several, each named once, such as "
            "['input/base', 'process/arm'].",
        ),
        (
            ["input/slip"],
            "robot 'kuka': input/slip/value writes 'linear/yy', which "
            "robot/kuka/command does not have. Did you mean 'linear/y'?",
        ),
        ([], "robot 'kuka': command is []; expected one writer, such as "),
        (["input/base", 3], "robot 'kuka': command is 3; expected the one port "),
        (["input/base", "input/ba*"], "robot 'kuka': command is ['input/base', 'inp"),
        (["input/base", "input/bse"], "robot 'kuka': robot/kuka/command is connected"),
        (
            ["input/base", "input/wrong"],
            "robot 'kuka': input/wrong/value (wrong) cannot become robot/kuka/command",
        ),
    ],
)
def test_writers_that_are_refused(writers: list[Any], says: str) -> None:
    lab = Experiment("refused", folder=PARTS)
    lab.input("base", "sharers.py:Base")
    lab.input("again", "sharers.py:Base")
    lab.input("other", "sharers.py:Other")
    lab.input("wrong", "sharers.py:WrongUnit")
    lab.input("slip", "sharers.py:Slip")

    def add_and_check() -> None:
        lab.robot("kuka", "youbot", "kinematic", command=writers)
        lab.check()

    with pytest.raises(ExperimentError) as refused:
        add_and_check()
    assert str(refused.value).startswith(says)


def test_another_number_is_another_field() -> None:
    lab = Experiment("numbered", folder=PARTS)
    for name, kind in (("base", "Base"), ("arm", "Numbered")):
        lab.input(name, f"sharers.py:{kind}")
    lab.robot("kuka", "youbot", "kinematic", command=["input/base", "input/arm"])
    lab.check()


TOML = """
[experiment]
duration = "1 s"
[[input]]
name = "base"
type = "{folder}/sharers.py:Base"
[[process]]
name = "arm"
type = "{folder}/sharers.py:Above"
robot = "robot/kuka/state"
[[robot]]
name = "kuka"
definition = "youbot"
driver = "kinematic"
command = ["input/base", "process/arm"]
"""


def test_in_a_file(tmp_path: Path) -> None:
    (tmp_path / "lab.toml").write_text(TOML.format(folder=PARTS.as_posix()))
    with load(tmp_path / "lab.toml").engine() as engine:
        engine.step(5)
        assert told(engine) == [0.2, 0.5, 1.0, 0.0, 0.0]


def test_why_tells_of_each_writer(tmp_path: Path) -> None:
    said: list[str] = []

    def ask(clock: Clock) -> None:
        until(lambda: clock.tick.n > 12)
        with Session(Link(show.endpoint)) as session:
            fabric = Fabric(session)
            said.extend(fabric.why("robot/kuka/command"))
            fabric.clock("end")

    lab = Experiment("why", dt=0.1, duration=100.0, folder=PARTS, record=False)
    lab.input("base", "sharers.py:Silent", host=HERE)
    lab.process("arm", "sharers.py:Above", robot="robot/kuka/state", host=HERE)
    both = ["input/base", "process/arm"]
    lab.robot("kuka", "youbot", "kinematic", command=both, host=HERE)
    show = Told(ask)
    lab.run(tmp_path, show=show, pace=5)
    assert not show.errors
    base = [one for one in said if "robot/kuka/command/input/base" in one]
    assert "has the value from input/base at 0.20 s" in base[0]
    assert any("command/process/arm has the value" in one for one in said)
    (safe,) = (one for one in said if "0.5 s for which" in one)
    assert safe.startswith("robot/kuka obeys the safe values of its fields: that is ")
