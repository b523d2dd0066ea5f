"""What a script changes before a run: its agents see it in their processes, too."""

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
    lab.input("hand", Hand, host="a")
    lab.robot("sim", "woodbot", "kinematic", command="input/hand", host="a")
    lab.output("log", "csv", host="a")
    lab.run()
"""


def lefts(folder: Path) -> list[float]:
    """What the left wheel of each run was commanded at first, in percent."""
    runs = sorted((folder / "runs").glob("lab*/sim.csv"))
    rows = [path.read_text().splitlines()[1].split(",") for path in runs]
    return [round(float(row[1]) / 0.073, 6) for row in rows]


def test_what_a_loop_changes(tmp_path: Path) -> None:
    """Of a global and of a class: before, the agents had the first value for ever."""
    text = HAND + USES + LOOP.format(loop="gain, Hand.turn in ((1, 2.0), (5, 3.0))")
    assert script(tmp_path, text) == (0, "")
    assert lefts(tmp_path) == [12.0, 53.0]


def test_what_is_set_where_no_agent_comes(tmp_path: Path) -> None:
    uses = USES.replace("gain = 1\n", "names = (1, 2)\nfast = False\n").replace(
        "10 * gain", "10 * fast + len(names)"
    )
    main = 'if __name__ == "__main__":\n    names = (1,)\n    fast = True\n'
    text = HAND + uses + main + LOOP.format(loop="_ in (1,)")
    assert script(tmp_path, text) == (0, "")
    assert lefts(tmp_path) == [13.5]


CONFIG = """
gain = 1
name = "slow"


class Limits:
    top = 5


def most():
    return Limits.top * len(name)
"""


def test_a_module_of_settings(tmp_path: Path) -> None:
    """`config.gain = 5` reaches all; so does what a function that is called uses."""
    (tmp_path / "config.py").write_text(CONFIG)
    uses = USES.replace("10 * gain", "config.gain + config.most()")
    change = "config.gain, config.name = 5, 'quick'\n    config.Limits.top = 8\n"
    main = f'import config\n\nif __name__ == "__main__":\n    {change}'
    assert script(tmp_path, HAND + uses + main + LOOP.format(loop="_ in (1,)")) == (
        0,
        "",
    )
    assert lefts(tmp_path) == [5 + 8 * len("quick") + 2.5]


NORMAL = """
import os
from datetime import datetime

# what is another whenever the file is read, and one for all agents
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
        used = born, late, day, count, self.made
        own = (me == os.getpid()) + 0 * len(used)
        return {"wheel/left": min(LIMIT, 10 * gain + own)}


# the name of an option
for gain in (1, 5):
    lab = Experiment(f"lab{time.time_ns()}", duration="0.3 s")
    lab.input("hand", Hand, options={"gain": gain}, host="a")
    lab.robot("sim", "woodbot", "kinematic", command="input/hand", host="a")
    lab.output("log", "csv", host="a")
    lab.run()
"""


def test_what_an_agent_sets_itself_is_its_own(tmp_path: Path) -> None:
    assert script(tmp_path, HAND + NORMAL) == (0, "")
    assert lefts(tmp_path) == [10.0, 50.0]
