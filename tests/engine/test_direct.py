"""`rems run --direct`: the same words, files and statuses as a run in processes."""

import json
import random
from pathlib import Path

import pytest

from rems_net import Experiment, Input, Out, Tick
from rems_net.errors import AgentError
from rems_net.maths.numerics import _can_be_pinned
from tests.agents.runs import Told, quiet, until
from tests.commands import ROOT, begun, command, finished, rems
from tests.engine.parts import COMMAND, STATE, Cart
from tests.interrupts import interrupt
from tests.pages import blocks


class Silent(Input):
    """Draws without the seed, and never sets its Out."""

    value = Out(COMMAND)

    def read(self, tick: Tick) -> None:
        random.random()


class Far(Input):
    """Says what no cart takes."""

    value = Out(STATE)

    def read(self, tick: Tick) -> dict[str, float]:
        if tick.n == 3:
            raise ValueError("no")
        return {"x": 1.0}


def test_it_warns_of_what_a_run_in_processes_warns_of(tmp_path: Path) -> None:
    new = Experiment("warned", dt=0.1, duration=1.0)
    new.input("silent", Silent)
    new.robot("sim", Cart, "kinematic", command="input/silent")
    new.robot("idle", Cart, "kinematic")
    told = Told()
    new.run(tmp_path, direct=True, show=told)
    idle, never, draws = told.lines
    assert "warning: nothing commands robot/idle, and at pace" in idle
    assert "warning: input/silent never set 'value'; who reads it saw its" in never
    assert "draws from the global random, which the experiment's seed" in draws


def test_it_says_how_far_it_came(tmp_path: Path) -> None:
    new = Experiment("far", dt=0.1, duration=1.0)
    new.input("far", Far)
    with pytest.raises(AgentError, match=r"^input/far: ValueError: no") as told:
        new.run(tmp_path, direct=True)
    (note,) = told.value.__notes__
    assert note.startswith("Ended after tick 2 (0.20 s); what the outputs had written")


#: where the README's `weave.py` writes, as this system writes a path
RUN = Path("runs/weave")


@pytest.fixture
def weave(tmp_path: Path) -> Path:
    """The README's `weave.py`, in a folder of its own."""
    (tmp_path / "weave.py").write_text(blocks(ROOT / "README.md", "python")[0], "utf-8")
    return tmp_path


def test_it_loads_no_network_and_no_tables(weave: Path) -> None:
    """Each of them takes as long as the whole run."""
    run = [*command("run", "weave.py", "--direct")]
    done = finished([run[0], "-X", "importtime", *run[1:]], weave)
    assert done.returncode == 0, done.stderr
    loaded = {line.rpartition("|")[2].strip() for line in done.stderr.splitlines()}
    heavy = {"zenoh", "rich", "matplotlib", "subprocess"}
    assert not loaded & heavy
    rooms = ("rems_net.agents.clock", "rems_net.agents.host", "rems_net.router.session")
    assert not [name for name in loaded if name.startswith(rooms)]
    assert done.stdout.split() == [
        "files",
        str(RUN / "cart.csv"),
        str(RUN / "run.mcap"),
    ]


@pytest.mark.skipif(not _can_be_pinned(), reason="only Linux can pin a process")
def test_it_is_pinned_if_what_it_uses_depends_on_the_processor(weave: Path) -> None:
    """And what the script prints is printed once."""
    script = weave / "weave.py"
    script.write_text(f"import numpy\nprint('once')\n{script.read_text()}")
    done = rems(weave, "run", "weave.py", "--direct")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.split() == [
        "once",
        "files",
        "runs/weave/cart.csv",
        "runs/weave/run.mcap",
    ]
    told = json.loads((weave / "runs" / "weave" / "run.json").read_text())
    assert told["numerics"].endswith(", pinned")


def test_ctrl_c_ends_it(weave: Path) -> None:
    script = weave / "weave.py"
    script.write_text(script.read_text().replace('"10 s"', '"1000000 s"'))
    process = begun(command("run", "weave.py", "--direct"), weave)
    log = weave / "runs" / "weave" / "cart.csv"
    try:
        until(lambda: log.exists() and log.stat().st_size > 1000)
        interrupt(process)
        _, said = process.communicate(timeout=20)
    finally:
        process.kill()
    assert process.returncode == 130
    assert quiet(said).startswith("rems: Interrupted after tick ")
    assert said.endswith(f"what the outputs had written is in {RUN}.\n")
    assert log.read_text().endswith("\n")
