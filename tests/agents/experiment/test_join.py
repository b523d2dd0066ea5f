"""One experiment on two machines: here, two processes that share only a router."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from rems_net import Experiment
from rems_net.errors import ExperimentError, FabricError
from rems_net.router.find import serve
from rems_net.router.mail import Mailbox
from tests.agents.experiment.test_run import carts
from tests.agents.runs import until

JOIN = """
import sys
sys.path.insert(0, {root!r})
from tests.agents.experiment.test_run import carts
carts(2).join(["robot/r1"], out={out!r})
"""


def test_an_agent_joins_from_another_machine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    carts(2).run(tmp_path / "alone")
    session, note = serve()
    with session:
        monkeypatch.setenv("REMS_ROUTER", session.link.endpoint)
        lab = carts(2)
        teacher = threading.Thread(
            target=lab.run,
            args=(tmp_path / "both",),
            kwargs={"elsewhere": ["robot/r1"]},
        )
        teacher.start()
        root = str(Path(__file__).parents[3])
        script = JOIN.format(root=root, out=str(tmp_path / "there"))
        student = subprocess.run(
            [sys.executable, "-c", script], capture_output=True, text=True, check=False
        )
        teacher.join()
    note.unlink()
    assert (student.returncode, student.stderr) == (0, "")
    alone = (tmp_path / "alone/log.txt").read_bytes()
    assert (tmp_path / "both/log.txt").read_bytes() == alone


def test_joining_nothing_and_nobody(tmp_path: Path) -> None:
    with pytest.raises(FabricError, match="No fabric 'rems' is running"):
        carts(2).join(["robot/r1"], out=tmp_path)
    with pytest.raises(ExperimentError) as caught:
        carts(2).run(tmp_path, elsewhere=["robot/r2"])
    assert str(caught.value).startswith("elsewhere names 'robot/r2', and there is no")


def test_an_empty_experiment_says_what_to_add() -> None:
    with pytest.raises(ExperimentError, match="this experiment has no agents; add"):
        Experiment("empty", duration=1).run()


def test_a_host_elsewhere_ends_when_the_clock_is_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session, note = serve()
    root = str(Path(__file__).parents[3])
    script = f"import sys; sys.path.insert(0, {root!r})\n"
    script += "from tests.agents.experiment.test_run import carts\nlab = carts(2)\n"
    with session:
        monkeypatch.setenv("REMS_ROUTER", session.link.endpoint)
        script += "lab.patience = 3.0\n"
        run = f"lab.run({str(tmp_path)!r}, pace=0.01, elsewhere=['robot/r1'])"
        teacher = subprocess.Popen([sys.executable, "-c", script + run])
        until(lambda: session.who("rems/clock/@alive"))  # who comes early is refused
        student = subprocess.Popen(
            [
                sys.executable,
                "-c",
                f"{script}lab.join(['robot/r1'], {str(tmp_path)!r})",
            ],
            stderr=subprocess.PIPE,
            text=True,
        )
        box = Mailbox()
        session.watch("rems/robot/r1/state", box)
        assert box.get(60.0) is not None  # a tick takes 10 s
        teacher.kill()
        teacher.wait()
        _, said = student.communicate(timeout=40)
    note.unlink()
    assert student.returncode == 1
    first, last = [x for x in said.splitlines() if "clock" in x]
    assert first == ("[robot/r1] warning: the clock is out of sight; waiting for it")
    assert re.fullmatch(
        r"\[robot/r1\] warning: the clock is out of sight for [34] s: this host ends",
        last,
    )
    assert said.endswith("AgentError: robot/r1: has ended; the line above says why\n")
