"""What a script changes before a run and its agents cannot see: told, and no more."""

from __future__ import annotations

from pathlib import Path

from tests.agents.scripts import HAND, script

USES = """
gain = 1


class Hand(Input):
    value = Out(VALUE)
    turn = 2.5

    def read(self, tick):
        return {"wheel/left": 10 * gain + self.turn}


"""
LOOP = """
for {loop}:
    lab = Experiment(f"lab{{time.time_ns()}}", duration="0.3 s")
    lab.input("hand", Hand)
    lab.robot("sim", "woodbot", "kinematic", command="input/hand")
    lab.output("log", "csv")
    lab.run()
"""
TOLD = (
    "[input/hand] warning: {name} is {there} in lab.py where it was started, and "
    "{here} in its agents: they are processes that read the file anew, up to its first "
    "run(). "
    "Make it a setting: options = Settings({bare}={field}) in Hand, "
    'self.options["{bare}"] in its methods, and {bare}={there} where input/hand is '
    "added (docs/agents.md).\n"
)


def told(name: str, there: str, here: str, field: str = "number()") -> str:
    bare = name.rpartition(".")[2]
    return TOLD.format(name=name, there=there, here=here, bare=bare, field=field)


def test_a_global_that_a_loop_changes(tmp_path: Path) -> None:
    """The first run has the first value; of the others each difference is told."""
    text = HAND + USES + LOOP.format(loop="gain in (1, 5, 9)")
    said = told("gain", "5", "1") + told("gain", "9", "1")
    assert script(tmp_path, text) == (0, said)


def test_a_class_attribute_that_a_loop_changes(tmp_path: Path) -> None:
    text = HAND + USES + LOOP.format(loop="Hand.turn in (2.0, 3.0)")
    assert script(tmp_path, text) == (0, told("Hand.turn", "3.0", "2.0"))


def test_what_is_set_where_no_agent_comes(tmp_path: Path) -> None:
    uses = USES.replace("gain = 1\n", "names = (1, 2)\nfast = False\n").replace(
        "10 * gain", "10 * fast + len(names)"
    )
    main = 'if __name__ == "__main__":\n    names = (1,)\n    fast = True\n'
    text = HAND + uses + main + LOOP.format(loop="_ in (1,)")
    status, said = script(tmp_path, text)
    assert status == 0
    assert set(said.splitlines(keepends=True)) == {
        told("fast", "True", "False", "boolean()"),
        told("names", "(1,)", "(1, 2)", "array((1,))"),
    }


CONFIG = """
gain = 1
name = "slow"


class Limits:
    top = 5


def most():
    return Limits.top * len(name)
"""


def test_a_module_of_settings(tmp_path: Path) -> None:
    """`config.gain = 5` reaches nobody; nor what a function that is called uses."""
    (tmp_path / "config.py").write_text(CONFIG)
    uses = USES.replace("10 * gain", "config.gain + config.most()")
    change = "config.gain, config.name = 5, 'quick'\n    config.Limits.top = 8\n"
    main = f'import config\n\nif __name__ == "__main__":\n    {change}'
    status, said = script(tmp_path, HAND + uses + main + LOOP.format(loop="_ in (1,)"))
    assert status == 0
    lines = [
        told("gain", "5", "1"),
        told("Limits.top", "8", "5"),
        told("name", "'quick'", "'slow'", "text()"),
    ]
    wanted = {line.replace("lab.py", "config.py") for line in lines}
    assert set(said.splitlines(keepends=True)) == wanted


NORMAL = """
import os
from datetime import datetime

# what is another whenever the file is read
born = time.time()
me = os.getpid()
draw = random.random()
late = draw + 1
day = str(datetime.now())
# what the agent itself sets
count = 0
LIMIT = 50.0


class Hand(Input):
    value = Out(VALUE)
    options = Settings(gain=number())
    made = 0

    def prepare(self):
        global count
        count += 1
        type(self).made += 1
        super().prepare()

    def read(self, tick):
        gain = self.options["gain"]
        used = born, me, late, day, count, self.made
        return {"wheel/left": min(LIMIT, 10 * gain + 0 * len(used))}


# the name of an option
for gain in (1, 5):
    lab = Experiment(f"lab{time.time_ns()}", duration="0.3 s")
    lab.input("hand", Hand, gain=gain)
    lab.robot("sim", "woodbot", "kinematic", command="input/hand")
    lab.output("log", "csv")
    lab.run()
"""


def test_what_is_no_mistake_is_not_told(tmp_path: Path) -> None:
    assert script(tmp_path, HAND + NORMAL) == (0, "")


def test_a_parameter_of_a_robot(tmp_path: Path) -> None:
    robot = """
from math import cos

from rems_net import Definition
from rems_net.defdict import length, velocity

slip = 0.0


class Cart(Definition):
    command = In(Schema("command", {"speed": velocity()}))
    state = Out(Schema("state", {"x": length()}))

    def derivative(self, state, command):
        return {"x": command["speed"] * (1 - slip)}


class Steady(Input):
    value = Out(Cart.command)

    def read(self, tick):
        return {"speed": 1.0}


if __name__ == "__main__":
    slip = 0.25
    lab = Experiment("lab", duration="0.3 s")
    lab.input("steady", Steady)
    lab.robot("cart", Cart, "kinematic", command="input/steady")
    lab.run()
"""
    assert script(tmp_path, HAND + robot) == (
        0,
        "[robot/cart] warning: slip is 0.25 in lab.py where it was started, and 0.0 in "
        "its agents: they are processes that read the file anew, up to its first "
        "run(). Make it a setting: parameters = Settings(slip=number()) in Cart, "
        'self.parameters["slip"] in its methods, and parameters={"slip": 0.25} where '
        "robot/cart is added (docs/agents.md).\n",
    )
