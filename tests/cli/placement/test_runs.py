"""`machine = "b"` and `rems bring --as b`: two laptops, one run, the same bytes."""

from __future__ import annotations

import re
import shutil
import signal

from rems_net.agents.experiment.placement.bring import REFUSED
from rems_net.router.find import machine as name_of_this
from tests.agents.runs import digest
from tests.cli.conftest import KEYS, LAB, together
from tests.cli.placement.conftest import (
    ON_B,
    B,
    Laptop,
    Pair,
    ended,
    one_line,
    wait_for,
)

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
WITH_CODE = (
    together(LAB)
    + """
[[process]]
name = "follow"
type = "follow.py:Follow"
target = "robot/model/state"
table = "gain.txt"
machine = "b"

[[output]]
name = "follow"
type = "csv"
host = "one"
robots = "process/follow/*"
"""
)


def test_the_same_bytes_and_no_file_on_the_other_laptop(pair: Pair) -> None:
    anna, ben = pair
    anna.write(lab_toml=ON_B, data__keys_csv=KEYS)
    status, out, error = anna.rems("run", "lab.toml", "--alone", "--out", "alone")
    assert (status, error) == (0, "")
    assert "waiting" not in out
    run = anna.start("run", "lab.toml", "--out", "both")
    brought = ended(ben.bring("--as", "b"))
    router = anna.environment["REMS_ROUTER"]
    assert brought[:2] == (
        0,
        f"lab, a run of anna on {name_of_this()} (fabric 'rems' at {router}), asks "
        "machine b to start:\n"
        "  input/keys  CsvInput\n  robot/model  Woodbot done by Kinematic\n"
        "with these files, which it sends, and which are deleted at the end:\n"
        f"  data/keys.csv, {len(KEYS)} bytes\n"
        "Anybody at this router can send this under any name.\n"
        "Start it? [y/N] The run has ended.\n",
    )
    status, out, error = ended(run)
    assert (status, error) == (0, "")
    assert (
        "[clock] waiting for machine b: input/keys, robot/model (on it: rems bring "
        f"--as b) [clock] machine b is {name_of_this()}"
    ) in one_line(out)
    folders = (anna.folder / "alone", anna.folder / "both")
    assert digest(folders[0]) == digest(folders[1])
    assert (folders[0] / "model.csv").stat().st_size > 100
    assert not list(ben.folder.iterdir())  # nothing is left there


def test_each_has_joined_and_comes_first_or_last(pair: Pair) -> None:
    """After `rems join`, runs are on a fabric of one's own: the other finds it."""
    anna, ben = pair
    anna.write(lab_toml=ON_B, data__keys_csv=KEYS)
    for laptop in pair:
        router = laptop.environment.pop("REMS_ROUTER")
        assert laptop.rems("join", router)[0] == 0
    waits = ben.bring("--as", "b")
    assert waits.stderr is not None
    assert waits.stderr.readline() == (
        f"rems: no run at {router} waits for machine b yet; waiting, until one does "
        "(Ctrl+C ends it)\n"
    )
    status, _, error = anna.rems("run", "lab.toml")
    assert (status, error) == (0, "")
    status, out, error = ended(waits)
    assert (status, error) == (0, "")
    assert "(fabric 'anna-" in out


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
    wait_for(run, "rems bring")
    status, out, error = ended(ben.bring("--as", "b"))
    assert (status, out) == (2, "")
    assert error == (
        f"rems: follow.py is not here, helper.py is not here (here is {ben.folder}). "
        f"Code never travels: copy it from {name_of_this()}, which runs lab.\n"
    )
    # Git on Windows changes how lines end, which makes no other code; a blank does.
    edited = HELPER.replace("2.0", " 2.0")
    ben.write(follow_py=FOLLOW.replace("\n", "\r\n"), helper_py=edited)
    status, out, error = ended(ben.bring("--as", "b"))
    assert (status, out) == (2, "")
    assert error == (
        f"rems: helper.py differs here and on {name_of_this()} (here is {ben.folder}). "
        f"Code never travels: copy it from {name_of_this()}, which runs lab.\n"
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
    assert "follow.csv" in alone


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
    assert "waiting for machine b: process/count (on it: rems bring --as b)" in error
    assert digest(anna.folder / "alone") == digest(anna.folder / "both")
    assert "25.0" in (anna.folder / "both" / "count.csv").read_text()


def test_who_cannot_is_told_on_both_sides_and_may_try_again(pair: Pair) -> None:
    anna, ben = pair
    files = {"follow_py": FOLLOW, "helper_py": HELPER}
    lab = WITH_CODE.replace('host = "one"\nname = "model"', f'{B}\nname = "model"')
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
        'host = "one"\nname = "model"', f'{B}\nname = "model"'
    )
    lab = lab.replace('host = "one"\nname = "keys"', 'machine = "c"\nname = "keys"')
    files = {"follow_py": FOLLOW, "helper_py": HELPER}
    anna.write(lab_toml=lab, keys_csv=KEYS, gain_txt="1.5", **files)
    ben.write(**files)
    run = anna.start("run", "lab.toml", "--out", "both")
    wait_for(run, "machine c: ")
    first = ben.bring("--as", "b")
    wait_for(run, "waiting for machine c: input/keys (on it: rems bring --as c)")
    first.send_signal(signal.SIGINT)
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


def test_a_machine_that_never_comes(pair: Pair) -> None:
    anna, _ = pair
    lab = ON_B.replace('dt = "0.1 s"', 'dt = "0.1 s"\nwait = "2 s"')
    anna.write(lab_toml=lab, data__keys_csv=KEYS)
    status, _, error = anna.rems("run", "lab.toml")
    assert status == 1
    assert error == (
        "rems: input/keys: machine b did not bring it within 2 s; type there: rems "
        "bring --as b\n"
    )


def test_a_router_that_others_cannot_reach_is_told(pair: Pair) -> None:
    """Two terminals of one laptop: it works, and says what it would not."""
    anna, ben = pair
    for laptop in pair:
        del laptop.environment["REMS_ROUTER"]
    ben.environment["XDG_RUNTIME_DIR"] = anna.environment["XDG_RUNTIME_DIR"]
    anna.write(lab_toml=ON_B, data__keys_csv=KEYS)
    run = anna.start("run", "lab.toml")
    said = wait_for(run, "rems bring")
    assert ended(ben.bring("--as", "b"))[0] == 0
    assert ended(run)[0] == 0
    assert (
        "[clock] warning: this run brings a router of its own, which only this laptop "
        "can reach; for others, first: rems join ADDRESS"
    ) in one_line(said)


#: the output alone is on machine b; the run is native on both
APART = (
    together(LAB)
    .replace('name = "lab"', 'name = "lab"\nnative = true')
    .replace('host = "one"\nname = "log"', 'machine = "b"\nname = "log"')
)


def test_an_output_writes_where_it_is(pair: Pair) -> None:
    anna, ben = pair
    anna.write(lab_toml=APART, keys_csv=KEYS)
    run = anna.start("run", "lab.toml")
    assert ended(ben.bring("--as", "b"))[0] == 0
    status, out, error = ended(run)
    assert (status, error) == (0, "")
    assert "The outputs wrote no files." in out
    assert "computes on" not in out  # what is told of platforms that differ
    assert (ben.folder / "runs" / "lab-b" / "model.csv").is_file()
    assert not (anna.folder / "runs" / "lab" / "model.csv").exists()


def test_stay_serves_one_run_after_the_other(pair: Pair) -> None:
    anna, ben = pair
    anna.write(lab_toml=ON_B, data__keys_csv=KEYS)
    stays = ben.bring("--as", "b", "--stay", typed="y\ny\n")
    for out in ("first", "second"):
        assert anna.rems("run", "lab.toml", "--out", out)[0] == 0
    assert digest(anna.folder / "first") == digest(anna.folder / "second")
    stays.send_signal(signal.SIGINT)
    status, out, error = ended(stays)
    assert status == 130
    assert "Traceback" not in error
    assert out.count("asks machine b to start:") == 2


def test_two_runs_that_want_one_machine(pair: Pair) -> None:
    anna, ben = pair
    anna.write(lab_toml=ON_B, data__keys_csv=KEYS)
    for team in ("team1", "team2"):
        run = anna.start("run", "lab.toml", "--fabric", team, "--out", team)
        wait_for(run, "rems bring")
    status, out, error = ended(ben.bring("--as", "b"))
    assert (status, out) == (2, "")
    assert error.endswith(
        "2 runs wait for a machine b, on the fabrics team1, team2; say which, by "
        "--fabric.\n"
    )
    assert ended(ben.bring("--as", "b", "--fabric", "team2"))[0] == 0
