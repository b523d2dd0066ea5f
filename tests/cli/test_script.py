"""`rems run script.py`: as Python would run it, with what `rems run` brings."""

import os
import re
from pathlib import Path

import pytest

from rems_net.agents import registry
from rems_net.cli import main
from rems_net.errors import uncoded
from tests.commands import Run, python

WEAVE = """\
import sys
from math import sin

from rems_net import Experiment, Input, Out, Schema
from rems_net.defdict import percent


class Weave(Input):
    value = Out(Schema("weave", {"wheel": {"left": percent(), "right": percent()}}))

    def read(self, tick):
        return {"wheel/left": 60 + 40 * sin(tick.t), "wheel/right": 60}


lab = Experiment("weave", duration="1 s")
lab.input("hand", Weave)
lab.robot("sim", "woodbot", "kinematic", command="input/hand")
lab.output("log", "csv")
print("arguments", sys.argv[1:], flush=True)
"""
RUN = "lab.run()\n"
#: the same, with all agents in one process
TOGETHER = re.sub(r"^(lab\.[ior].*)\)$", r'\1, host="one")', WEAVE, flags=re.M)
GUARDED = 'if __name__ == "__main__":\n    lab.run()\n'
TWICE = """\
for name in ("one", "two"):
    lab.name = name
    done = lab.run()
    print(name, done.ticks, [path.name for path in done.files], flush=True)
"""


def script(folder: Path, text: str, name: str = "weave.py") -> Path:
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    return path


@pytest.mark.parametrize("end", [RUN, GUARDED], ids=["plain", "guarded"])
def test_as_python_would_run_it(
    folder: Path, rems: Run, program: Run, end: str
) -> None:
    """In a process for each agent, or with all of them in one."""
    script(folder, (WEAVE if end == RUN else TOGETHER) + end)
    words = ("weave.py", "--", "fast", "--pace", "3")
    done = rems("run", "--direct", *words) if end == RUN else program("run", *words)
    assert (done.returncode, done.stderr) == (0, "")
    said = done.stdout.splitlines()
    assert said[0] == "arguments ['fast', '--pace', '3']"
    if end == GUARDED:
        assert said[1].startswith("weave: 1 s of fabric time, as fast as possible; ")
    assert said[-2].split() == ["files", str(Path("runs/weave/run.mcap"))]
    assert said[-1].strip() == str(Path("runs/weave/sim.csv"))
    ours = (folder / "runs/weave/sim.csv").read_bytes()
    plain = python(folder, "weave.py", "fast", "--pace", "3")
    assert (plain.returncode, plain.stdout) == (0, said[0] + "\n")
    assert (folder / "runs/weave/sim.csv").read_bytes() == ours


def test_what_the_command_line_says_wins(folder: Path, rems: Run) -> None:
    script(folder, TOGETHER + 'lab.run("elsewhere", pace="fast")\n')
    done = rems("run", "weave.py", "--pace", "4", "--out", "here")
    assert (done.returncode, done.stderr) == (0, "")
    assert "4 x real time" in done.stdout.splitlines()[1]
    assert (folder / "here" / "sim.csv").is_file()
    assert not (folder / "elsewhere").exists()


def test_several_runs(folder: Path, rems: Run) -> None:
    script(folder, WEAVE + TWICE)
    done = rems("run", "--direct", "weave.py")
    assert (done.returncode, done.stderr) == (0, "")
    for name in ("one", "two"):
        assert f"{name} 10 ['sim.csv', 'run.mcap']" in done.stdout.splitlines()
        assert (folder / "runs" / name / "sim.csv").is_file()


def test_several_runs_and_one_folder(folder: Path, rems: Run) -> None:
    script(folder, WEAVE + TWICE)
    done = rems("run", "--direct", "weave.py", "--out", "here")
    assert done.returncode == 2
    assert done.stderr == (
        "rems: weave.py, line 22: this is the second run after one, and --out names "
        "one folder for both; leave it out, and give each experiment its name."
        " (R0904)\n"
    )


def test_in_another_folder(folder: Path, rems: Run) -> None:
    """It imports what lies beside it, and relative files are relative to here."""
    script(folder, "NAME = 'neighbour'\n", "lib/names.py")
    text = TOGETHER.replace("import sys\n", "import sys\n\nfrom names import NAME\n")
    script(folder, text + "lab.name = NAME\n" + RUN, "lib/weave.py")
    done = rems("run", "lib/weave.py")
    assert (done.returncode, done.stderr) == (0, "")
    assert (folder / "runs/neighbour/sim.csv").is_file()


def test_its_own_exit_status(folder: Path, rems: Run) -> None:
    script(folder, WEAVE + RUN + "sys.exit(5)\n")
    assert rems("run", "--direct", "weave.py").returncode == 5


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            WEAVE.replace("kinematic", "kinematik") + RUN,
            "weave.py, line 17: robot 'sim': There is no driver 'kinematik'; there is "
            f"{', '.join(registry.BUILT_IN['driver'])}, or your own as "
            "'my_file.py:MyClass'. Did you mean 'kinematic'?",
        ),
        (
            WEAVE.replace('"hand", Weave', '"hand", "Weave"') + RUN,
            "weave.py, line 16: input 'hand': input is 'Weave', a class of this "
            "script: write Weave, without quotes.",
        ),
        (
            WEAVE.replace("input/hand", "input/hnad") + RUN,
            "weave.py, line 20: robot 'sim': robot/sim.command is connected to "
            "'input/hnad', and there is no 'input/hnad'; there is input/hand, "
            "robot/sim. Did you mean 'input/hand'?",
        ),
        (
            WEAVE + 'lab.run(pace="fats")\n',
            "weave.py, line 20: pace is 'fats'; expected \"fast\" or a factor of real "
            "time, 0.001 to 10000, such as 1.0. Did you mean 'fast'?",
        ),
        (
            WEAVE,
            "weave.py makes an experiment and does not run it; write lab.run() at its "
            "end.",
        ),
        (
            "x = 1\n",
            "weave.py runs no experiment; expected a script that ends with the run() "
            "of one. Type `rems new robot my_robot` to see such a script.",
        ),
        (
            "1 / 0\n",
            "ZeroDivisionError: division by zero (weave.py, line 1, in <module>)",
        ),
        ("def f(:\n", "FOLDER/weave.py, line 1: invalid syntax."),
        (
            "import no_such_library\n",
            "ModuleNotFoundError: No module named 'no_such_library' (weave.py, line 1, "
            "in <module>)",
        ),
    ],
    ids=[
        "unknown driver",
        "a class in quotes",
        "unknown source",
        "wrong pace",
        "no run",
        "no experiment",
        "an exception",
        "no Python",
        "no library",
    ],
)
@pytest.mark.parametrize("verb", ["run", "check"])
def test_mistakes(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    verb: str,
    text: str,
    sentence: str,
) -> None:
    script(folder, text)
    assert main([verb, "weave.py"]) == 2
    told = capsys.readouterr()
    came = sentence.replace("FOLDER/", f"FOLDER{os.sep}").replace("FOLDER", str(folder))
    assert uncoded(told.err.rstrip("\n")) == f"rems: {came}"
    assert told.out in ("", "arguments []\n")
    assert not (folder / "runs").exists()
    assert registry.runner() is None


@pytest.mark.parametrize(
    ("args", "sentence"),
    [
        (
            ["check", "lib/x.py"],
            "There is no file x.py, nor its folder FOLDER/lib.",
        ),
        (
            ["run", "lab.toml", "--", "a", "b"],
            "lab.toml takes no arguments of its own, but got 'a b' after '--'; only a "
            "script (.py) does.",
        ),
        (
            ["check", "lab.toml", "--", "a"],
            "lab.toml takes no arguments of its own, but got 'a' after '--'; only a "
            "script (.py) does.",
        ),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_on_the_command_line(
    folder: Path, capsys: pytest.CaptureFixture[str], args: list[str], sentence: str
) -> None:
    script(folder, WEAVE + RUN)
    assert main(args) == 2
    came = sentence.replace("FOLDER/", f"FOLDER{os.sep}").replace("FOLDER", str(folder))
    assert uncoded(capsys.readouterr().err.rstrip("\n")) == f"rems: {came}"
    assert not (folder / "runs").exists()
