"""A script that Python runs: what it does not catch is a sentence and its own lines."""

import sys
from pathlib import Path

import pytest

from rems_net.agents.registry import BUILT_IN
from rems_net.errors import UnitError, uncoded
from rems_net.uncaught import sentences
from tests.agents.runs import quiet, until
from tests.cli.test_script import RUN, TOGETHER, script
from tests.commands import Run, begun, python
from tests.interrupts import INTERRUPTED, interrupt_all

QUIET = TOGETHER.replace('print("arguments", sys.argv[1:], flush=True)', "")
IMPORTS = "from rems_net import Experiment, Input, Out, Schema"


def test_a_mistake(folder: Path) -> None:
    script(folder, QUIET.replace("kinematic", "kinematik") + RUN)
    done = python(folder, "weave.py")
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == (
        f'  File "{folder / "weave.py"}", line 17, in <module>\n'
        '    lab.robot("sim", "woodbot", "kinematik", command="input/hand", '
        'host="one")\n'
        "ExperimentError: robot 'sim': There is no driver 'kinematik'; there is "
        f"{', '.join(BUILT_IN['driver'])}, or your own as 'my_file.py:MyClass'. Did "
        "you mean 'kinematic'?"
        " (R0425)\n"
    )


def test_an_agent_that_fails(folder: Path) -> None:
    """Where the script stood, and where the agent's own code did."""
    script(folder, QUIET.replace("sin(tick.t)", "sin(1 / (tick.n - 3))") + RUN)
    done = python(folder, "weave.py")
    assert done.returncode == 1
    assert done.stderr == (
        f'  File "{folder / "weave.py"}", line 20, in <module>\n'
        "    lab.run()\n"
        "AgentError: input/hand: ZeroDivisionError: division by zero (weave.py, line "
        "12, in read, tick 3) (R0520)\n"
    )


@pytest.mark.parametrize("text", ["1 / 0\n", "import no_such_library\n"])
def test_what_is_pythons_own(folder: Path, text: str) -> None:
    script(folder, f"{IMPORTS}\n{text}")
    assert python(folder, "weave.py").stderr.startswith(
        "Traceback (most recent call last):\n"
    )


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        (
            "from rems_net.unit import cm",
            "There is no module rems_net.unit. Did you mean 'rems_net.units'?",
        ),
        (
            "from rems_net import length",
            "rems_net has no 'length'. Write: from rems_net.units import length",
        ),
        (
            "from rems_net import Experimnt",
            "rems_net has no 'Experimnt'. Did you mean: from rems_net import "
            "Experiment?",
        ),
        (
            "rems_net.zzz",
            "rems_net has no 'zzz'. All public names are in rems_net, rems_net.units, "
            "rems_net.bodies, rems_net.drivers and rems_net.gym.",
        ),
        (
            "from rems_net.units import lenght",
            "unyt knows no unit 'lenght'. Did you mean 'length'?",
        ),
    ],
)
def test_a_name_that_is_not_there(line: str, sentence: str) -> None:
    with pytest.raises((ImportError, AttributeError, UnitError)) as caught:
        exec(f"import rems_net\n{line}")
    said = list(sentences(caught.value, caught.tb))[-1]
    assert uncoded(said) == f"{type(caught.value).__name__}: {sentence}"


def test_the_front_doors_are_there_without_an_import_of_their_own(
    tmp_path: Path,
) -> None:
    said = python(tmp_path, "-c", "import rems_net as r; print(r.units.cm, r.bodies)")
    assert (said.returncode, said.stderr) == (0, ""), said
    assert said.stdout.startswith("cm ")


def test_ctrl_c(folder: Path) -> None:
    script(folder, QUIET.replace("1 s", "60 s") + 'lab.run(pace="1")\n')
    process = begun([sys.executable, "-W", "error", "weave.py"], folder)
    log = folder / "runs" / "weave" / "sim.csv"
    until(lambda: log.exists() and len(log.read_text().splitlines()) > 3)
    interrupt_all(process)
    _, told = process.communicate(timeout=20)
    assert process.returncode in INTERRUPTED
    line, *more = quiet(told).splitlines()
    assert more == []
    assert line.startswith("Interrupted after tick ")
    assert line.endswith(
        f" s); what the outputs had written is in {Path('runs/weave')}."
    )
    assert log.read_text().endswith("\n")


@pytest.mark.parametrize("name", ["pathlib", "traceback", "types", "typing"])
def test_a_name_that_hides_what_tells_of_errors(folder: Path, name: str) -> None:
    text = f"print('once')\n{QUIET}{RUN}"
    script(folder, text, f"{name}.py")
    done = python(folder, f"{name}.py")
    assert done.returncode == 1
    assert done.stderr == (
        f"{name}.py hides the module '{name}', which rems_net needs. Rename it, "
        f"for example to my_{name}.py.\n"
    )
    # as a script, and as the module that it hides; not again to tell of that
    assert done.stdout.count("once") == 2
    assert not (folder / "runs").exists()


@pytest.mark.parametrize(
    ("name", "line", "code"), [("zenoh", 20, "lab.run()"), ("random", 4, IMPORTS)]
)
def test_a_name_that_hides_a_module(
    folder: Path, program: Run, name: str, line: int, code: str
) -> None:
    """Python cannot run it, nor what lies beside it; `rems run` can run both."""
    text = QUIET + RUN
    script(folder, text, f"{name}.py")
    script(folder, text, "base.py")
    for file in (f"{name}.py", "base.py"):
        done = python(folder, file)
        assert done.returncode == 1
        assert done.stderr == "".join(
            f'  File "{folder / place}", line {line}, in <module>\n    {code}\n'
            for place in (file, f"{name}.py")
        ) + (
            f"{name}.py hides the module '{name}', which rems_net needs. Rename it, "
            f"for example to my_{name}.py. (R0312)\n"
        )
        done = program("run", file)
        assert (done.returncode, done.stderr) == (0, "")
        files = [Path("runs/weave/run.mcap"), Path("runs/weave/sim.csv")]
        word, *listed = done.stdout.split()[-3:]
        assert (word, [Path(one) for one in listed]) == ("files", files)


def test_a_name_that_hides_the_library_of_environments(tmp_path: Path) -> None:
    pytest.importorskip("gymnasium", reason="gymnasium is not installed")
    text = 'from rems_net.gym import make\n\nmake("lab.toml", act="", observe="")\n'
    script(tmp_path, text, "gymnasium.py")
    done = python(tmp_path, "gymnasium.py")
    assert done.returncode == 1
    assert "gymnasium.py hides the module 'gymnasium', which rems_net" in done.stderr


@pytest.mark.parametrize("guard", ["", 'if __name__ == "__main__":\n    '])
def test_a_name_that_hides_a_library_of_an_agent(
    folder: Path, rems: Run, guard: str
) -> None:
    pytest.importorskip("mujoco", reason="mujoco is not installed (an extra)")
    script(folder, QUIET.replace("kinematic", "mujoco") + guard + RUN, "mujoco.py")
    said = "mujoco.py hides the module 'mujoco', which rems_net needs. Rename it, for "
    for done in (python(folder, "mujoco.py"), rems("run", "mujoco.py")):
        assert done.returncode == 1
        assert f"robot/sim: {said}example to my_mujoco.py." in quiet(done.stderr)
        assert "__main__" not in done.stderr.replace(guard, "")
