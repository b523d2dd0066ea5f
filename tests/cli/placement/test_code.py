"""Classes of the user's own on two laptops: code never travels, data does."""

import re
import shutil

from rems_net.agents.experiment.placement.bring import REFUSED
from rems_net.router.message import machine as name_of_this
from tests.agents.runs import digest
from tests.cli.conftest import KEYS, LAB, together
from tests.cli.placement.conftest import (
    B,
    Laptop,
    Pair,
    ended,
    one_line,
    wait_for,
)
from tests.interrupts import interrupt

#: a class of the user's own, which reads a file and imports another of his files
FOLLOW = """\
from helper import factor
from rems_net import In, Out, Process, Settings
from rems_net.defdict import Schema, number, text


class Follow(Process):
    options = Settings(table=text(max_len=100))
    target = In()
    value = Out(Schema("follow.value", {"x": number()}))

    def open(self):
        path = self.folder / self.options.table
        self.gain = float(path.read_text(encoding="utf-8"))

    def step(self, tick):
        self.value = {"x": factor() * self.gain * self.target.x}
"""


HELPER = "def factor():\n    return 2.0\n"


#: it has a process for the agents of machine b only
WITH_CODE = (
    together(LAB, "here").replace("[experiment]", "[experiment]\nrecord = false")
    + """
[[process]]
name = "follow"
type = "follow.py:Follow"
target = "robot/model/state"
options.table = "gain.txt"
machine = "b"

[[output]]
name = "follow"
type = "csv"
host = "here"
robots = "process/follow/*"
"""
)


def recorded(laptop: Laptop, out: str) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in (laptop.folder / out).glob("*.csv")}


def recorded_alone(laptop: Laptop, lab: str) -> dict[str, bytes]:
    """Return what one process of this laptop records, if no agent is elsewhere."""
    laptop.write(alone_toml=re.sub('machine = "."\n', "", lab))
    status, _, error = laptop.rems("run", "--direct", "alone.toml", "--out", "alone")
    assert (status, error) == (0, "")
    return recorded(laptop, "alone")


def test_code_never_travels_and_is_compared(pair: Pair) -> None:
    anna, ben = pair
    files = {"follow_py": FOLLOW, "helper_py": HELPER}
    anna.write(lab_toml=WITH_CODE, keys_csv=KEYS, gain_txt="1.5", **files)
    alone = recorded_alone(anna, WITH_CODE)
    run = anna.start("run", "lab.toml", "--out", "both")
    wait_for(run, "rems agent bring")
    status, out, error = ended(ben.bring("--as", "b"))
    assert (status, out) == (2, "")
    assert error == (
        f"rems: follow.py is not here, helper.py is not here (here is {ben.folder}). "
        f"Code never travels: copy it from {name_of_this()}, which runs lab."
        " (R0440)\n"
    )
    # Git on Windows changes how lines end, which makes no other code; a blank does.
    edited = HELPER.replace("2.0", " 2.0")
    ben.write(follow_py=FOLLOW.replace("\n", "\r\n"), helper_py=edited)
    status, out, error = ended(ben.bring("--as", "b"))
    assert (status, out) == (2, "")
    assert error == (
        f"rems: helper.py differs here and on {name_of_this()} (here is {ben.folder}). "
        f"Code never travels: copy it from {name_of_this()}, which runs lab."
        " (R0440)\n"
    )
    shutil.copy(anna.folder / "helper.py", ben.folder)
    status, out, error = ended(ben.bring("--as", "b"))
    assert (status, error) == (0, "")
    assert "  process/follow  Follow\nwith " in out
    assert "  gain.txt, 3 bytes\n" in out
    assert f"in {ben.folder}, which are the same there:\n  follow.py\n" in out
    status, out, error = ended(run)
    assert (status, error) == (0, "")
    assert REFUSED in one_line(out)
    assert "is not here" not in out  # of Ben's files nothing is said to Anna
    assert recorded(anna, "both") == alone
    assert "process.follow.csv" in alone


SCRIPT = """\
import sys
from rems_net import Experiment, Out, Process, Schema
from rems_net.defdict import number

factor = float(sys.argv[1])


class Count(Process):
    value = Out(Schema("count.value", {"x": number()}))

    def step(self, tick):
        self.value = {"x": factor * tick.n}


lab = Experiment("lab", dt="0.1 s", duration="1 s")
lab.process("count", Count, machine="b")
lab.output("log", "csv", robots="process/count/*")
lab.run("alone", alone=True)
lab.run("both")
"""


def test_a_script_with_an_argument(pair: Pair) -> None:
    """The class is in the script itself, and is told what the script was told."""
    for laptop in pair:
        laptop.write(lab_py=SCRIPT)
    anna, ben = pair
    run = anna.python("lab.py", "2.5")
    status, out, error = ended(ben.bring("--as", "b"))
    assert status == 0, error
    assert "which are the same there:\n  lab.py\n" in out
    status, _, error = ended(run)
    assert status == 0, error
    assert (
        "waiting for machine b: process/count (on it: rems agent bring --as b)" in error
    )
    assert digest(anna.folder / "alone") == digest(anna.folder / "both")
    assert "25.0" in (anna.folder / "both" / "process.count.csv").read_text()


def test_who_cannot_is_told_on_both_sides_and_may_try_again(pair: Pair) -> None:
    anna, ben = pair
    files = {"follow_py": FOLLOW, "helper_py": HELPER}
    lab = WITH_CODE.replace('host = "here"\nname = "model"', f'{B}\nname = "model"')
    files["follow_py"] = "import os\n" + FOLLOW.replace(
        "    def open(self):\n",
        "    def open(self):\n        if os.environ['LOGNAME'] == 'ben':\n"
        "            raise OSError('no gripper is plugged in')\n",
    )
    anna.write(lab_toml=lab, keys_csv=KEYS, gain_txt="1.5", **files)
    ben.write(**files)
    run = anna.start("run", "lab.toml")
    status, _, error = ended(ben.bring("--as", "b"))
    assert status == 1
    assert "rems: process/follow: " in error
    assert "no gripper is plugged in" in error.splitlines()[-1]
    ben.environment["LOGNAME"] = "clara"
    status, _, error = ended(ben.bring("--as", "b"))
    assert (status, error) == (0, "")  # it had left no folder
    status, out, error = ended(run)
    assert (status, error) == (0, "")
    assert REFUSED in one_line(out)
    assert "gripper" not in out


def test_who_leaves_before_the_start_may_come_again(pair: Pair) -> None:
    """Ctrl+C there: the run still waits."""
    anna, ben = pair
    lab = WITH_CODE.replace('machine = "b"', B).replace(
        'host = "here"\nname = "model"', f'{B}\nname = "model"'
    )
    lab = lab.replace('host = "here"\nname = "keys"', 'machine = "c"\nname = "keys"')
    files = {"follow_py": FOLLOW, "helper_py": HELPER}
    anna.write(lab_toml=lab, keys_csv=KEYS, gain_txt="1.5", **files)
    ben.write(**files)
    run = anna.start("run", "lab.toml", "--out", "both")
    wait_for(run, "machine c: ")
    first = ben.bring("--as", "b")
    wait_for(run, "waiting for machine c: input/keys (on it: rems agent bring --as c)")
    interrupt(first)
    status, _, error = ended(first)
    assert (status, "Traceback" in error) == (130, False)
    said = wait_for(run, "waiting for machine b: ")
    assert "has left; it may come again" in said
    again = ben.bring("--as", "b")
    other = ben.bring("--as", "c")
    assert ended(again)[0] == ended(other)[0] == 0
    status, _, error = ended(run)
    assert (status, error) == (0, "")
    assert recorded(anna, "both") == recorded_alone(anna, lab)
