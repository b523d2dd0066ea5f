"""An agent is a process: its arguments, its keyboard, and how it ends."""

import gzip
import os
from pathlib import Path

import pytest

from tests.agents.runs import calm
from tests.agents.scripts import ALONE, HAND, LAB, script

ARGUMENTS = """
class Hand(Input):
    value = Out(VALUE)

    def read(self, tick):
        return {"wheel/left": float(sys.argv[1])}
"""
ASKS = """
class Hand(Input):
    value = Out(VALUE)
    options = Settings(left=percent())

    def read(self, tick):
        return {"wheel/left": self.options["left"]}


left = float(input("left? "))
lab = Experiment("lab", duration="1 s", record=False)
lab.input("hand", Hand, options={"left": left})
lab.robot("sim", "woodbot", "kinematic", command="input/hand", host="here")
lab.output("log", "csv", host="here")
lab.run()
"""
WRITES = """
class Hand(Input):
    value = Out(VALUE)

    def open(self):
        self.text = open("text.txt", "w")
        self.bytes = open("bytes.bin", "wb")
        self.packed = gzip.open("packed.gz", "wt")
        atexit.register(self.leave)

    def read(self, tick):
        self.text.write(f"{tick.n}\\n")
        self.bytes.write(b"%d\\n" % tick.n)
        self.packed.write(f"{tick.n}\\n")
        self.value = {"wheel/left": 1}

    def leave(self):
        self.text.write("left\\n")
"""
FAILS = """\
        if tick.n == 5:
            1 / 0

    def leave"""


def left(folder: Path) -> set[float]:
    """What the left wheel was told, in rad/s."""
    _, *rows = (folder / "runs/lab/sim.csv").read_text().splitlines()
    return {float(row.split(",")[1]) for row in rows}


def unpacked(path: Path) -> str:
    return gzip.decompress(path.read_bytes()).decode().replace(os.linesep, "\n")


#: a line in a file for each process that reads the script; too many end it
READ = """
import os, threading
print("read", flush=True)
with open("read.txt", "a+") as file:
    print(os.getpid(), file=file)
    file.seek(0)
    if len(file.readlines()) > 9:
        os._exit(9)
"""
CLASS = """
print("class read", flush=True)


class Hand(Input):
    value = Out(VALUE)

    def read(self, tick):
        return {"wheel/left": 1.0}


def half(x):
    return x / 2
"""
#: it begins when an agent's process has read the script to its end
THREAD = """
later = threading.Timer(0.5, lab.run)
later.start()
while __name__ == "__main__" and later.is_alive():
    time.sleep(0.1)
"""
JOB = """
class Busy(Hand):
    def open(self):
        self.jobs.submit(half, 9, then=self.take, process=True)

    def take(self, result):
        print(result, flush=True)
        self.taken = True


lab = Experiment("lab", duration="1 s")
lab.input("hand", Busy)
with lab.engine() as engine:
    while not hasattr(engine["input/hand"], "taken"):
        engine.step()
        time.sleep(0.01)
"""


@pytest.mark.parametrize(
    ("text", "read"),
    [
        (READ + HAND + "from hand import Hand\n" + ALONE + "lab.run()\n", 1),
        (READ + HAND + CLASS + ALONE + "lab.run()\n", 2),
        (READ + HAND + CLASS + ALONE + THREAD, 2),
    ],
    ids=["of a module", "of the script", "in a thread"],
)
def test_a_script_without_a_guard(tmp_path: Path, text: str, read: int) -> None:
    """A class of a module is imported; nothing is printed twice, or started twice."""
    (tmp_path / "hand.py").write_text(HAND + CLASS)
    assert script(tmp_path, text) == (0, "read\nclass read\n")
    assert len((tmp_path / "read.txt").read_text().split()) == read


def test_a_job_of_a_script_without_a_guard(tmp_path: Path) -> None:
    """Its process read the script as a script, and ran all of it again."""
    text = READ + HAND + CLASS + JOB
    assert script(tmp_path, text) == (0, "read\nclass read\n4.5\n")
    assert len((tmp_path / "read.txt").read_text().split()) == 2


def test_an_agent_starts_no_run(tmp_path: Path) -> None:
    asks = ARGUMENTS.replace("        return", "        lab.run()\n        return")
    status, said = script(tmp_path, HAND + asks + ALONE + "lab.run()\n", "40")
    assert status == 1
    assert "run() is called in a process of an agent, which starts no others: " in said


def test_its_arguments_are_those_of_the_script(tmp_path: Path) -> None:
    assert script(tmp_path, HAND + ARGUMENTS + LAB + "lab.run()\n", "40") == (0, "")
    assert left(tmp_path) == {2.92}  # 40 % of 7.3 rad/s


def test_a_print_that_the_terminal_cannot_show(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It ended the run, as in a pipe on Windows."""
    monkeypatch.setenv("PYTHONIOENCODING", "cp1252")
    text = ARGUMENTS.replace(
        "        return", '        print("θ") if tick.n == 1 else 0\n        return'
    )
    told = script(tmp_path, HAND + text + ALONE + "lab.run()\n", "40")
    assert told == (0, "[input/hand] \\u03b8\n")


def test_what_a_script_asks_is_asked_once(tmp_path: Path) -> None:
    """It hung for half a minute: a host read its lifeline."""
    assert script(tmp_path, HAND + ASKS, typed="40\n") == (0, "left? ")
    assert left(tmp_path) == {2.92}  # 40 % of 7.3 rad/s


def test_what_is_asked_before_the_class_is_told(tmp_path: Path) -> None:
    text = HAND + 'name = input("name? ")\n' + ARGUMENTS + ALONE + "lab.run()\n"
    status, said = script(tmp_path, text, typed="x\n")
    assert status == 1
    assert (
        "lab.py has no class 'Hand' before line 8, where it calls input(); an agent's "
        "process reads it up to there: put classes before."
    ) in said


def test_what_never_stops_asking_is_told(tmp_path: Path) -> None:
    asks = """
while True:
    try:
        left = float(input("left? "))
        break
    except:
        pass
"""
    text = HAND + asks + ARGUMENTS + ALONE + "lab.run()\n"
    status, said = script(tmp_path, text, "1", typed="40\n")
    assert status == 1
    assert (
        "lab.py calls input() again and again, and catches each error that ends it: "
        "write `except ValueError:` in place of `except:`."
    ) in said


def test_an_agent_that_waits_for_the_keyboard_is_told(tmp_path: Path) -> None:
    for asks in ('input("left? ")', "sys.stdin.readline()", "next(sys.stdin)"):
        text = HAND + ARGUMENTS.replace("sys.argv[1]", asks) + ALONE + "lab.run()\n"
        status, said = script(tmp_path, text)
        assert status == 1
        assert said.splitlines()[-1].endswith(
            "input/hand: an agent cannot ask the keyboard, which is its script's "
            "(lab.py, line 13, in read); ask before run(), and give it the answer as a "
            "setting. (tick 1) (R0430)"
        )


def test_files_that_nobody_closed_are_whole(tmp_path: Path) -> None:
    assert script(tmp_path, HAND + WRITES + ALONE + "lab.run()\n") == (0, "")
    ticks = "".join(f"{n}\n" for n in range(1, 11))
    assert (tmp_path / "text.txt").read_text() == ticks + "left\n"
    assert (tmp_path / "bytes.bin").read_text() == ticks
    assert unpacked(tmp_path / "packed.gz") == ticks


def test_files_of_an_agent_that_fails_are_whole(tmp_path: Path) -> None:
    text = HAND + WRITES.replace("    def leave", FAILS) + ALONE + "lab.run()\n"
    status, said = script(tmp_path, text)
    assert status == 1
    assert "input/hand: ZeroDivisionError" in said
    assert (tmp_path / "text.txt").read_text() == "1\n2\n3\n4\n5\nleft\n"
    assert unpacked(tmp_path / "packed.gz") == "1\n2\n3\n4\n5\n"


def test_what_hangs_at_exit_holds_nobody_up(tmp_path: Path) -> None:
    hangs = WRITES.replace('self.text.write("left\\n")', "time.sleep(60)")
    began = calm()
    status, said = script(tmp_path, HAND + hangs + ALONE + "lab.run()\n")
    assert (status, said) == (
        0,
        "[input/hand] warning: what it does at exit took longer than 1 s\n",
    )
    assert calm() - began < 30
    assert (tmp_path / "text.txt").read_text().splitlines()[-1] == "10"


def test_what_fails_at_exit_is_told(tmp_path: Path) -> None:
    fails = WRITES.replace('self.text.write("left\\n")', "1 / 0")
    assert script(tmp_path, HAND + fails + ALONE + "lab.run()\n") == (
        0,
        "[input/hand] warning: at exit: ZeroDivisionError: division by zero "
        "(lab.py, line 25, in leave) (R0520)\n",
    )
    assert (tmp_path / "text.txt").read_text().splitlines()[-1] == "10"
