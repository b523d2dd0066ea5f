"""`machine = "b"` and `rems bring --as b`: two laptops, one run, the same bytes.

Each laptop is a folder, a user, settings and notes of its own; they share a router.
"""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rems_net.agents.experiment.placement.bring import serve_run
from rems_net.agents.experiment.run import Show
from rems_net.agents.protocol.placement import File, Offer
from rems_net.errors import ExperimentError, FabricError, WireError
from rems_net.router.find import machine as name_of_this
from rems_net.router.mail import Question
from rems_net.router.message import pack
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.protocol.fuzz import OFFER, PLAN
from tests.agents.runs import Router, digest
from tests.cli.conftest import KEYS, LAB, command, environment

KEYS_LINE, TOLD = 'file = "keys.csv"', 'command = "input/keys"'
#: the input and the robot of `LAB` are on machine b
ON_B = LAB.replace(KEYS_LINE, 'file = "data/keys.csv"\nmachine = "b"').replace(
    'command = "input/keys"', 'command = "input/keys"\nmachine = "b"'
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
    LAB
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
robots = "process/follow/*"
"""
)


class Laptop:
    """A folder, a user, his settings and notes. `rems` runs there."""

    def __init__(self, folder: Path, user: str, router: str):
        self.folder = folder / user
        self.folder.mkdir()
        own = {"LOGNAME": user, "USER": user, "REMS_ROUTER": router}
        for name in ("XDG_RUNTIME_DIR", "XDG_CONFIG_HOME"):
            (folder / f"{user}.{name}").mkdir(mode=0o700)
            own[name] = str(folder / f"{user}.{name}")
        self.environment = environment() | own
        self.running: list[subprocess.Popen[str]] = []

    def start(self, *args: str) -> subprocess.Popen[str]:
        return self.python(*command(*args)[1:])

    def python(self, *args: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, *args],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        self.running.append(process)
        return process

    def rems(self, *args: str) -> tuple[int, str, str]:
        """Run it to its end: exit status, output, complaints."""
        return ended(self.start(*args))

    def write(self, **files: str) -> None:
        for name, text in files.items():
            path = self.folder / name.replace("__", "/").replace("_", ".")
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)

    def end(self) -> None:
        for process in self.running:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            process.communicate(timeout=30)


def ended(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    out, error = process.communicate(timeout=100)
    return process.returncode, out, error


def wait_for(process: subprocess.Popen[str], words: str) -> str:
    """What it says, up to these words."""
    said = ""
    assert process.stdout is not None
    while line := process.stdout.readline():
        said += line
        if words in line:
            return said
    raise AssertionError(f"it ended: {process.communicate()}")


Pair = tuple[Laptop, Laptop]


@pytest.fixture
def pair(tmp_path: Path) -> Iterator[Pair]:
    """Anna's laptop, which runs lab.toml, and Ben's, which is machine b."""
    with Router() as router:
        laptops = [Laptop(tmp_path, user, router.endpoint) for user in ("anna", "ben")]
        yield laptops[0], laptops[1]
        for laptop in laptops:
            laptop.end()


def one_line(text: str) -> str:
    """Without the line breaks of a console of 80 columns."""
    return " ".join(text.split())


def test_the_same_bytes_and_no_file_on_the_other_laptop(pair: Pair) -> None:
    anna, ben = pair
    anna.write(lab_toml=ON_B, data__keys_csv=KEYS)
    status, out, error = anna.rems("run", "lab.toml", "--alone", "--out", "alone")
    assert (status, error) == (0, "")
    assert "waiting" not in out
    run = anna.start("run", "lab.toml", "--out", "both")
    brought = ben.rems("bring", "--as", "b")
    router = anna.environment["REMS_ROUTER"]
    assert brought[:2] == (
        0,
        f"lab, which {name_of_this()} runs on the fabric 'rems' at {router}, wants of "
        "machine b:\n  input/keys  CsvInput\n  robot/model  Woodbot done by Kinematic\n"
        f"  data/keys.csv, {len(KEYS)} bytes, comes from there\nThe run has ended.\n",
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


def test_a_native_run_is_native_on_both(pair: Pair) -> None:
    anna, ben = pair
    native = ON_B.replace('name = "lab"', 'name = "lab"\nnative = true', 1)
    anna.write(lab_toml=native, data__keys_csv=KEYS)
    run = anna.start("run", "lab.toml")
    assert ben.rems("bring", "--as", "b")[0] == 0
    status, out, error = ended(run)
    assert (status, error) == (0, "")
    assert "computes on" not in out  # what is told of platforms that differ


def test_each_has_joined_and_comes_first_or_last(pair: Pair) -> None:
    """After `rems join`, runs are on a fabric of one's own: the other finds it."""
    anna, ben = pair
    anna.write(lab_toml=ON_B, data__keys_csv=KEYS)
    for laptop in pair:
        router = laptop.environment.pop("REMS_ROUTER")
        assert laptop.rems("join", router)[0] == 0
    waits = ben.start("bring", "--as", "b")
    assert waits.stderr is not None
    assert waits.stderr.readline() == (
        f"rems: no run at {router} waits for machine b yet; waiting, until one does "
        "(Ctrl+C ends it)\n"
    )
    status, _, error = anna.rems("run", "lab.toml")
    assert (status, error) == (0, "")
    status, out, error = ended(waits)
    assert (status, error) == (0, "")
    assert "runs on the fabric 'anna-" in out


def test_code_never_travels_and_is_compared(pair: Pair) -> None:
    anna, ben = pair
    files = {"follow_py": FOLLOW, "helper_py": HELPER}
    anna.write(lab_toml=WITH_CODE, keys_csv=KEYS, gain_txt="1.5", **files)
    status, _, error = anna.rems("run", "lab.toml", "--alone", "--out", "alone")
    assert (status, error) == (0, "")
    run = anna.start("run", "lab.toml", "--out", "both")
    wait_for(run, "rems bring")
    status, out, error = ben.rems("bring", "--as", "b")
    assert (status, out) == (2, "")
    assert error == (
        f"rems: follow.py is not here, helper.py is not here (here is {ben.folder}). "
        f"Code never travels: copy it from {name_of_this()}, which runs lab.\n"
    )
    # Git on Windows changes how lines end, which makes no other code.
    ben.write(follow_py=FOLLOW.replace("\n", "\r\n"), helper_py=HELPER + "# mine\n")
    status, out, error = ben.rems("bring", "--as", "b")
    assert (status, out) == (2, "")
    assert error.startswith(
        f"rems: helper.py differs here and on {name_of_this()} (here is "
    )
    shutil.copy(anna.folder / "helper.py", ben.folder)
    status, out, error = ben.rems("bring", "--as", "b")
    assert (status, error) == (0, "")
    assert "  process/follow  Follow\n  gain.txt, 3 bytes, comes from there\n" in out
    assert "  follow.py is the same here\n" in out
    status, out, error = ended(run)
    assert (status, error) == (0, "")
    told = f"machine b ({name_of_this()}): "
    assert f"{told}follow.py is not here, helper.py is not" in one_line(out)
    assert f"{told}helper.py differs here and on {name_of_this()}" in one_line(out)
    assert digest(anna.folder / "alone") == digest(anna.folder / "both")
    assert (anna.folder / "both" / "follow.csv").is_file()


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
    status, out, error = ben.rems("bring", "--as", "b")
    assert status == 0, error
    assert "  lab.py is the same here\n" in out
    status, _, error = ended(run)
    assert status == 0, error
    assert "waiting for machine b: process/count (on it: rems bring --as b)" in error
    assert digest(anna.folder / "alone") == digest(anna.folder / "both")
    assert "25.0" in (anna.folder / "both" / "count.csv").read_text()


def test_who_cannot_is_told_on_both_sides_and_may_try_again(pair: Pair) -> None:
    anna, ben = pair
    files = {"follow_py": FOLLOW, "helper_py": HELPER}
    lab = WITH_CODE.replace(
        'command = "input/keys"', 'command = "input/keys"\nmachine = "b"'
    )
    files["follow_py"] = "import os\n" + FOLLOW.replace(
        "    def open(self):\n",
        "    def open(self):\n        if os.environ['LOGNAME'] == 'ben':\n"
        "            raise OSError('no gripper is plugged in')\n",
    )
    anna.write(lab_toml=lab, keys_csv=KEYS, gain_txt="1.5", **files)
    ben.write(**files)
    run = anna.start("run", "lab.toml")
    status, _, error = ben.rems("bring", "--as", "b")
    assert status == 1
    assert "rems: process/follow: " in error
    assert "no gripper is plugged in" in error.splitlines()[-1]
    ben.environment["LOGNAME"] = "clara"
    status, _, error = ben.rems("bring", "--as", "b")
    assert (status, error) == (0, "")  # it had left no folder
    status, out, error = ended(run)
    assert (status, error) == (0, "")
    assert "no gripper is plugged in" in one_line(out)


def test_who_leaves_before_the_start_may_come_again(pair: Pair) -> None:
    """Ctrl+C there, and one of two processes that fails: the run still waits."""
    anna, ben = pair
    lab = WITH_CODE.replace(
        'command = "input/keys"', 'command = "input/keys"\nmachine = "b"'
    )
    lab = lab.replace(KEYS_LINE, f'{KEYS_LINE}\nmachine = "c"')
    files = {"follow_py": FOLLOW, "helper_py": HELPER}
    anna.write(lab_toml=lab, keys_csv=KEYS, gain_txt="1.5", **files)
    ben.write(**files)
    run = anna.start("run", "lab.toml", "--out", "both")
    wait_for(run, "machine c: ")
    first = ben.start("bring", "--as", "b")
    wait_for(run, "waiting for machine c: input/keys (on it: rems bring --as c)")
    first.send_signal(signal.SIGINT)
    status, _, error = ended(first)
    assert (status, "Traceback" in error) == (130, False)
    said = wait_for(run, "waiting for machine b: ")
    assert "has left; it may come again" in said
    again = ben.start("bring", "--as", "b")
    other = ben.start("bring", "--as", "c")
    assert ended(again)[0] == ended(other)[0] == 0
    status, _, error = ended(run)
    assert (status, error) == (0, "")
    assert anna.rems("run", "lab.toml", "--alone", "--out", "alone")[0] == 0
    assert digest(anna.folder / "alone") == digest(anna.folder / "both")


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
    assert ben.rems("bring", "--as", "b")[0] == 0
    assert ended(run)[0] == 0
    assert (
        "[clock] warning: this run brings a router of its own, which only this laptop "
        "can reach; for others, first: rems join ADDRESS"
    ) in one_line(said)


def test_an_output_writes_where_it_is(pair: Pair) -> None:
    anna, ben = pair
    anna.write(lab_toml=LAB + 'machine = "b"\n', keys_csv=KEYS)
    run = anna.start("run", "lab.toml")
    assert ben.rems("bring", "--as", "b")[0] == 0
    status, out, error = ended(run)
    assert (status, error) == (0, "")
    assert "The outputs wrote no files." in out
    assert (ben.folder / "runs" / "lab-b" / "model.csv").is_file()
    assert not (anna.folder / "runs" / "lab" / "model.csv").exists()


def test_stay_serves_one_run_after_the_other(pair: Pair) -> None:
    anna, ben = pair
    anna.write(lab_toml=ON_B, data__keys_csv=KEYS)
    stays = ben.start("bring", "--as", "b", "--stay")
    for out in ("first", "second"):
        assert anna.rems("run", "lab.toml", "--out", out)[0] == 0
    assert digest(anna.folder / "first") == digest(anna.folder / "second")
    stays.send_signal(signal.SIGINT)
    status, out, error = ended(stays)
    assert status == 130
    assert "Traceback" not in error
    assert out.count("wants of machine b:") == 2


def test_two_runs_that_want_one_machine(pair: Pair) -> None:
    anna, ben = pair
    anna.write(lab_toml=ON_B, data__keys_csv=KEYS)
    for team in ("team1", "team2"):
        run = anna.start("run", "lab.toml", "--fabric", team, "--out", team)
        wait_for(run, "rems bring")
    status, out, error = ben.rems("bring", "--as", "b")
    assert (status, out) == (2, "")
    assert error.endswith(
        "2 runs wait for a machine b, on the fabrics team1, team2; say which, by "
        "--fabric.\n"
    )
    assert ben.rems("bring", "--as", "b", "--fabric", "team2")[0] == 0


BEFORE = {
    "one process on two machines": (
        ON_B.replace('machine = "b"', 'machine = "b"\nhost = "x"', 1).replace(
            'command = "input/keys"\nmachine = "b"',
            'command = "input/keys"\nhost = "x"',
        ),
        "input/keys and robot/model share the process 'x', and are on machine b and "
        "this one; give both the same machine, or a host each.",
    ),
    "a file of elsewhere": (
        ON_B.replace("data/keys.csv", "../keys.csv"),
        '[[input]] "keys": ../keys.csv is ',
    ),
    "a file that is no data": (
        ON_B.replace("data/keys.csv", "keys.py"),
        "can't be had on another machine: a file is 'keys.py'; expected one that ends",
    ),
    "a machine that is no name": (
        ON_B.replace('machine = "b"', 'machine = "a/b"', 1),
        "machine is 'a/b'; a name has 1 to 63 letters",
    ),
}


@pytest.mark.parametrize("name", BEFORE)
def test_what_is_said_before_anything_starts(pair: Pair, name: str) -> None:
    anna, _ = pair
    lab, sentence = BEFORE[name]
    anna.write(lab_toml=lab, data__keys_csv=KEYS, keys_py=KEYS)
    (anna.folder.parent / "keys.csv").write_text(KEYS)
    status, _, error = anna.rems("run", "lab.toml")
    assert status == 2
    assert sentence in error


WORDS = {
    "neither": ((), "expected either `rems bring --as MACHINE`"),
    "both": (("lab.toml", "--as", "b"), "expected either `rems bring --as MACHINE`"),
    "no agents": (("lab.toml",), "--only is missing: which agents?"),
    "no name": (("--as", "a/b"), "--as is 'a/b'; a name has 1 to 63 letters"),
}


@pytest.mark.parametrize("name", WORDS)
def test_words_that_say_nothing(pair: Pair, name: str) -> None:
    words, sentence = WORDS[name]
    status, _, error = pair[1].rems("bring", *words)
    assert status == 2
    assert sentence in error


# -- another rems_net, another definition --------------------------------------------

OTHER = (
    "import rems_net; rems_net.__version__ = '0.0.9'\n"
    "from rems_net.cli import main\nraise SystemExit(main({!r}))\n"
)


def test_an_open_fabric_of_another_version(pair: Pair) -> None:
    anna, ben = pair
    served = anna.start("serve")
    words = ["agent", "robot", "woodbot", "kinematic", "--name", "ben"]
    assert served.stdout is not None
    assert served.stdout.readline().startswith("Open fabric")
    status, _, error = ended(ben.python("-c", OTHER.format(words)))
    assert status == 2
    assert 'Type: pip install "rems-net==0.1.0"' in error
    served.send_signal(signal.SIGINT)
    _, out, error = ended(served)
    assert f"{name_of_this()} has rems_net 0.0.9, and this laptop" in out + error


@pytest.mark.parametrize("how", ["as", "only"])
def test_another_version_is_told_on_both_sides(pair: Pair, how: str) -> None:
    anna, ben = pair
    for laptop in pair:
        laptop.write(lab_toml=ON_B, data__keys_csv=KEYS)
    words = ["bring", "lab.toml", "--only", "robot/model", "input/keys"]
    words = ["bring", "--as", "b"] if how == "as" else words
    run = anna.start("run", "lab.toml")
    wait_for(run, "rems bring")
    status, out, error = ended(ben.python("-c", OTHER.format(words)))
    assert (status, out) == (2, "")
    assert (
        f"this laptop has rems_net 0.0.9, and the clock's, {name_of_this()}, has "
        '0.1.0. Type: pip install "rems-net==0.1.0"\n'
    ) in error
    assert ben.rems("bring", "--as", "b")[0] == 0
    status, out, _ = ended(run)
    assert status == 0
    assert (
        f"[clock] {name_of_this()} has rems_net 0.0.9, and this laptop 0.1.0: it is "
        "not let in until both have one version"
    ) in one_line(out)


CART = """\
from rems_net import Definition, Driver, In, Out, Schema
from rems_net.defdict import length, velocity


class Cart(Definition):
    command = In(Schema("cart.command", {"speed": velocity("m/s")}))
    state = Out(Schema("cart.state", {"x": length("m")}))


class Roll(Driver):
    def drive(self, command, dt):
        self.state.x += command.speed * dt

    def sense(self):
        pass
"""
CARTS = """\
[experiment]
dt = "0.1 s"
duration = "1 s"
wait = "20 s"

[[robot]]
name = "cart"
definition = "cart.py:Cart"
driver = "cart.py:Roll"

[[output]]
name = "log"
type = "csv"
"""


def test_another_definition_is_told_on_both_sides(pair: Pair) -> None:
    anna, ben = pair
    anna.write(lab_toml=CARTS, cart_py=CART)
    ben.write(lab_toml=CARTS, cart_py=CART.replace('length("m")', 'length("mm")'))
    run = anna.start("run", "lab.toml", "--elsewhere", "robot/cart")
    wait_for(run, "waiting for robot/cart")
    status, _, error = ben.rems("bring", "lab.toml", "--only", "robot/cart")
    assert status == 1
    sentence = (
        f"robot/cart is defined differently on {name_of_this()} and on the clock's "
        "machine: 'x' is float [mm] there, and float [m] here. Give both the same "
        "files."
    )
    assert sentence in one_line(error)
    shutil.copy(anna.folder / "cart.py", ben.folder)
    assert ben.rems("bring", "lab.toml", "--only", "robot/cart")[0] == 0
    status, out, _ = ended(run)
    assert status == 0
    assert sentence in one_line(out)


# -- a run that is none --------------------------------------------------------------


def forge(offer: Offer, classes: list[str]) -> bytes:
    hosts = {"robot/sim": [PLAN | {"classes": classes}]}
    code = offer.code if classes[0].startswith("lab.py:") else {}
    return offer._replace(hosts=hosts, code=code).to_wire()


MADE = "rems_net.drivers.kinematic.kinematic:Kinematic"
FORGED = {
    "another module": (
        forge(OFFER, ["subprocess:Popen", MADE]),
        "'subprocess:Popen', which is no definition of rems_net",
    ),
    "a driver as a definition": (
        forge(OFFER, [MADE, MADE]),
        "which is no definition of rems_net",
    ),
    "code without a digest": (
        forge(OFFER, ["other.py:Cart", MADE]),
        "expected the digest of other.py, too",
    ),
    "code of elsewhere": (
        forge(OFFER, ["../lab.py:Cart", MADE]),
        "expected a name below the folder",
    ),
    "code behind a link": (
        OFFER._replace(
            hosts={"robot/sim": [PLAN | {"classes": ["link.py:Cart", MADE]}]},
            code={"link.py": "f" * 64},
        ).to_wire(),
        "link.py is not here",
    ),
    "code that is not the same": (OFFER.to_wire(), "lab.py differs here and on laptop"),
    "a class inside a module": (
        forge(OFFER, ["lab.py:a b", MADE]),
        "expected module:Class or file.py:Class",
    ),
    "an absolute file": (
        OFFER._replace(files={"/etc/keys.csv": File(1, "0" * 64)}).to_wire(),
        "expected a name below the folder",
    ),
    "a file above": (
        OFFER._replace(files={"a/../../keys.csv": File(1, "0" * 64)}).to_wire(),
        "expected a name below the folder",
    ),
    "a file with a drive": (
        OFFER._replace(files={"C:keys.csv": File(1, "0" * 64)}).to_wire(),
        "expected a name below the folder",
    ),
    "a hidden file": (
        OFFER._replace(files={".ssh/keys.txt": File(1, "0" * 64)}).to_wire(),
        "expected a name below the folder",
    ),
    "code as data": (
        OFFER._replace(files={"site.py": File(1, "0" * 64)}).to_wire(),
        "expected one that ends with",
    ),
    "too large a file": (
        OFFER._replace(files={"keys.csv": File(2**40, "0" * 64)}).to_wire(),
        "expected a whole number from 0 to 67108864",
    ),
    "too many bytes": (
        OFFER._replace(
            files={f"{i}.csv": File(2**26, "0" * 64) for i in range(2)}
        ).to_wire(),
        "67108864 bytes at most",
    ),
    "too many files": (
        OFFER._replace(
            files={f"{i}.csv": File(1, "0" * 64) for i in range(201)}
        ).to_wire(),
        "a map of at most 200 words",
    ),
    "two files that are one elsewhere": (
        OFFER._replace(
            files={"a.csv": File(1, "0" * 64), "A.csv": File(1, "0" * 64)}
        ).to_wire(),
        "names that differ in letters",
    ),
    "too many processes": (
        OFFER._replace(hosts={f"robot/r{i}": [PLAN] for i in range(101)}).to_wire(),
        "a map of at most 100 words",
    ),
    "a folder as the experiment's name": (
        OFFER._replace(name="../x").to_wire(),
        "the experiment's name is '../x'",
    ),
    "noise": (b"\xc1", "no message"),
    "five": (pack(5), "expected a map of name, laptop, hosts"),
}


@pytest.fixture
def link() -> Iterator[Link]:
    with Router() as router:
        yield Link(router.endpoint)


def serve(link: Link, folder: Path) -> list[str]:
    """Be machine b of whoever says he has a run; what it was told."""
    told: list[str] = []
    with Session(link) as session:
        serve_run(session, "b", folder, Show(), told.append)
    return told


@pytest.mark.parametrize("name", FORGED)
def test_a_forged_offer_starts_nothing(name: str, link: Link, tmp_path: Path) -> None:
    payload, sentence = FORGED[name]
    (tmp_path / "here").mkdir()
    (tmp_path / "lab.py").write_text("raise SystemExit('it was run')")
    (tmp_path / "here" / "lab.py").write_text("raise SystemExit('it was run')")
    (tmp_path / "here" / "link.py").symlink_to(tmp_path / "lab.py")
    troubles: list[bytes] = []

    def answer(question: Question) -> None:
        troubles.append(question.payload)
        question.answer("rems/machine/b/@start", payload)

    with Session(link) as session:
        session.answer_at_once("rems/machine/b/@start", answer)
        with pytest.raises((ExperimentError, WireError)) as caught:
            serve(link, tmp_path / "here")
    assert sentence in str(caught.value)
    assert len(troubles) <= 2


DATA = b"x" * (2**20 + 5)
PIECES = {
    "nothing": (None, FabricError, "does not send its files"),
    "too much": (lambda part: DATA, WireError, "in a piece of 1048581 bytes"),
    "too little": (lambda part: b"", WireError, "in a piece of 0 bytes"),
    "something else": (
        lambda part: bytes(2**20 if part == 0 else 5),
        WireError,
        "another SHA-256 came",
    ),
}


@pytest.mark.parametrize("name", PIECES)
def test_a_file_that_does_not_come_whole(
    name: str, link: Link, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    send, error, sentence = PIECES[name]
    plan = PLAN | {"classes": ["rems_net.robots.woodbot:Woodbot", MADE]}
    files = {"keys.csv": File(len(DATA), "0" * 64)}
    offer = OFFER._replace(hosts={"robot/sim": [plan]}, code={}, files=files).to_wire()

    def piece(question: Question) -> None:
        if send is not None:
            part = int(question.parameters["part"])
            question.answer(f"rems/machine/b/@file/{'0' * 64}", send(part))

    (tmp_path / "here").mkdir()
    with Session(link) as session:
        session.answer_at_once(
            "rems/machine/b/@start",
            lambda question: question.answer("rems/machine/b/@start", offer),
        )
        session.answer_at_once("rems/machine/b/@file/*", piece)
        with pytest.raises(error) as caught:
            serve(link, tmp_path / "here")
    assert sentence in str(caught.value)
    assert not list((tmp_path / "here").iterdir())


def test_who_asks_a_run_nonsense_is_refused_and_bounded(pair: Pair) -> None:
    anna, ben = pair
    anna.write(lab_toml=ON_B, data__keys_csv=KEYS)
    run = anna.start("run", "lab.toml")
    wait_for(run, "rems bring")
    key = "rems/machine/b"
    with Session(Link(anna.environment["REMS_ROUTER"])) as session:
        for payload in (b"\xc1", pack(5), pack(["x"]), pack(["x", "y\x1b" * 9000])):
            with pytest.raises(FabricError):
                session.ask(f"{key}/@start", payload)
        for i in range(100):
            session.ask(f"{key}/@start", pack(["x", f"trouble {i}\x1b[2J"]))
        for file in ("passwd", "0" * 64, "*"):
            assert session.ask(f"{key}/@file/{file}?part=0") == []
        assert session.ask(f"{key}/@file/{'0' * 64}?part=-1") == []
    assert ben.rems("bring", "--as", "b")[0] == 0
    status, out, error = ended(run)
    assert (status, error) == (0, "")
    assert 20 < out.count("trouble") <= 30
    assert "\x1b" not in out
