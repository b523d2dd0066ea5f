"""An experiment in a file is the same experiment as in Python."""

from pathlib import Path

import pytest

from rems_net import Experiment, Field, load
from rems_net.errors import ExperimentError

FILE = """\
[experiment]
name = "lab2"
dt = "20 ms"
duration = "10 s"
pace = 2.0
fabric = "class"

[[input]]
name = "keys"
type = "csv"
options.file = "keys.csv"

[[robot]]
name = "model"
definition = "woodbot"
driver = "kinematic"
command = "input/keys"
parameters = { track = "0.1 m", max_wheel_speed = "6.8 rad/s" }
options = { integrator = "rk4" }
initial = { heading = "90 deg" }
every = 2
host = "models"

[[robot]]
name = "mine"
definition = "my_robot.py:Cart"
driver = "kinematic"

[[process]]
name = "follow"
type = "my_robot.py:Follow"
leader = "robot/mine/state"

[[output]]
name = "log"
type = "csv"
robots = "robot/mine/*"
"""
MINE = """\
from rems_net import Definition, In, Out, Process, Schema
from rems_net.defdict import length, velocity

class Cart(Definition):
    command = In(Schema("command", {"speed": velocity()}))
    state = Out(Schema("state", {"x": length()}))

    def derivative(self, state, command):
        return {"x": command["speed"]}

class Follow(Process):
    leader = In(Cart.state)
    value = Out(Cart.command)

    def step(self, tick):
        self.value = {"speed": 0.5}
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "my_robot.py").write_text(MINE)
    (tmp_path / "keys.csv").write_text("timestamp,inpt.wh.l,inpt.wh.r\n1.0,50,50\n")
    path = tmp_path / "lab.toml"
    path.write_text(FILE)
    return path


def test_it_is_a_thin_layer(path: Path) -> None:
    lab = Experiment(
        "lab2",
        dt="20 ms",
        duration="10 s",
        pace=2.0,
        fabric="class",
        folder=path.parent,
    )
    lab.input("keys", "csv", options={"file": "keys.csv"})
    lab.robot(
        "model",
        "woodbot",
        "kinematic",
        command="input/keys",
        parameters={"track": "0.1 m", "max_wheel_speed": "6.8 rad/s"},
        options={"integrator": "rk4"},
        initial={"heading": "90 deg"},
        every=2,
        host="models",
    )
    lab.robot("mine", "my_robot.py:Cart", "kinematic")
    lab.process("follow", "my_robot.py:Follow", leader="robot/mine/state")
    lab.output("log", "csv", robots="robot/mine/*")
    loaded = load(path)
    assert vars(loaded) == vars(lab)
    agents = loaded.check()
    assert loaded.ticks(agents) == 500
    wheel = agents["robot/model"].schemas()["command"]["wheel/left"]
    assert isinstance(wheel, Field)
    assert wheel.range == (-6.8, 6.8)


def test_what_may_be_left_out(path: Path) -> None:
    path.write_text(
        '[[robot]]\nname = "a"\ndefinition = "woodbot"\ndriver = "kinematic"'
    )
    lab = load(str(path))
    assert (lab.name, lab.dt, lab.duration, lab.pace) == ("lab", 0.1, None, 0.0)
    with pytest.raises(ExperimentError, match="has no duration"):
        lab.ticks(lab.check())


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (('"my_robot.py:Cart"', '"my_robot.py:Crat"'), "Did you mean 'Cart'?"),
        (('"my_robot.py:Cart"', '"my_robot.py:Follow"'), "Follow is no definition"),
        (('"my_robot.py:Follow"', '"my_robot.py:Cart"'), "Cart is no process"),
        (("leader =", "leadr ="), "Did you mean 'leader'?"),
        (("{ track", "{ trakc"), "Did you mean 'track'? (R0104)"),
        (("pace = 2.0", "pace = true"), "pace is True"),
        (("every = 2", 'every = "2"'), "every is '2'; expected a whole number"),
        (('name = "follow"', 'name = ["follow"]'), "expected text in quotes"),
        (("[experiment]", "[[experiment]]"), "[experiment] is one table"),
    ],
)
def test_mistakes(path: Path, edit: tuple[str, str], said: str) -> None:
    path.write_text(FILE.replace(*edit, 1))
    with pytest.raises(ExperimentError) as refused:
        load(path).check()
    assert said in str(refused.value)


def test_bytes_that_are_no_text(path: Path) -> None:
    path.write_bytes(b'[experiment]\nname = "\xff"\n')
    with pytest.raises(ExperimentError) as refused:
        load(path)
    assert str(refused.value) == (
        f"{path} is no text in UTF-8 (at byte 22); save it as UTF-8. (R0402)"
    )


ROBOT = '[[robot]]\nname = "a"\ndefinition = "woodbot"\ndriver = "kinematic"\n'
#: what stands beside a name -> the table that is to be written in its place
BESIDE = {
    '[[input]]\nname = "a"\ntype = "csv"\nfile = "a.csv"': (
        '[[input]] "a": file belongs in the options of CsvInput; write options = '
        '{ file = "a.csv" }. (R0407)'
    ),
    '[[output]]\nname = "a"\ntype = "plot"\nfields = ["x"]': (
        '[[output]] "a": fields belongs in the options of PlotOutput; write options = '
        "{ fields = ... }. (R0407)"
    ),
    '[[world]]\nname = "a"\nradius = 1\nboxes = []': (
        '[[world]] "a": radius, boxes belong in the options of World; write options = '
        "{ radius = 1, boxes = ... }. (R0407)"
    ),
    f"{ROBOT}track = 1": (
        '[[robot]] "a": track belongs in the parameters of Woodbot; write parameters = '
        "{ track = 1 }. (R0407)"
    ),
    f"{ROBOT}noise = true": (
        '[[robot]] "a": noise belongs in the options of Kinematic; write options = '
        "{ noise = true }. (R0407)"
    ),
}


@pytest.mark.parametrize("table", BESIDE)
def test_a_setting_beside_a_name_is_refused_with_its_table(
    tmp_path: Path, table: str
) -> None:
    (tmp_path / "lab.toml").write_text(f"{table}\n")
    with pytest.raises(ExperimentError) as caught:
        load(tmp_path / "lab.toml")
    assert str(caught.value) == f"{tmp_path / 'lab.toml'}, {BESIDE[table]}"


def test_a_setting_beside_a_name_is_refused_in_python() -> None:
    lab = Experiment()
    said = "^input 'a': file belongs in the options of CsvInput; write options="
    with pytest.raises(ExperimentError, match=said + r'\{"file": "a.csv"\}'):
        lab.input("a", "csv", file="a.csv")
    with pytest.raises(ExperimentError, match=r'Write options=\{"radius": ...\}'):
        lab.world("a", radius="1 m")  # type: ignore[call-arg]


def test_patience_is_refused_with_wait(tmp_path: Path) -> None:
    path = tmp_path / "lab.toml"
    path.write_text('[experiment]\npatience = "3 s"\n')
    with pytest.raises(ExperimentError, match=r'Write wait = \{ back = "30 s" \}\.'):
        load(path)
    path.write_text('[experiment]\nwait = { back = "3 s" }\n')
    assert load(path).wait == (300.0, 3.0)
    path.write_text('[experiment]\nwait = "60 s"\n')
    assert load(path).wait == (60.0, 30.0)


SCRIPT = """\
from rems_net import Experiment

lab = Experiment("cart", dt="50 ms", duration="1 s")
lab.robot("sim", "woodbot", "kinematic")
"""


@pytest.mark.parametrize(
    "end",
    [
        "lab.run()",
        "if __name__ == '__main__':\n    lab.run()",
        "Experiment('other')\nlab.run()",
        "other = Experiment('other')\nlab.run()\nother.run()",
    ],
)
def test_the_experiment_of_a_script(tmp_path: Path, end: str) -> None:
    script = tmp_path / "cart.py"
    script.write_text(f"{SCRIPT}{end}\n", encoding="utf-8")
    lab = load(script)
    assert (lab.name, lab.dt, [*lab.plans]) == ("cart", 0.05, ["robot/sim"])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "makes no experiment at its top level"),
        (SCRIPT + "two = Experiment('two')\n", r"makes 2 experiments \(cart, two\)"),
        (SCRIPT + "lab.robot('two', 'woodbott', 'kinematic')\n", "mean 'woodbot'"),
    ],
)
def test_a_script_without_one_experiment(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "cart.py").write_text(text, encoding="utf-8")
    with pytest.raises(ExperimentError, match=said):
        load(tmp_path / "cart.py")
