"""Agents of another machine: here, of another process that shares only a router."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from rems_net.router.find import serve
from rems_net.router.mail import Mailbox
from tests.agents.bringing import ROOT, bring
from tests.agents.runs import PARTS

RUN = f"""
import sys
sys.path.insert(0, {str(ROOT)!r})
from tests.agents.experiment.test_run import carts
lab = carts(2)
lab.plans["robot/r1"].machine = "b"
lab.wait = lab.wait._replace(back=3.0)
lab.run(sys.argv.pop(), pace=0.1)
"""


def test_a_host_of_another_machine_ends_when_the_clock_is_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session, note = serve()
    with session:
        monkeypatch.setenv("REMS_ROUTER", session.link.endpoint)
        teacher = subprocess.Popen([sys.executable, "-c", RUN, str(tmp_path)])
        student = bring(PARTS)
        box = Mailbox()
        session.watch("rems/robot/r1/state", box)
        assert box.get(60.0) is not None  # a tick takes 1 s
        teacher.kill()
        teacher.wait()
        _, said = student.communicate(timeout=40)
    note.unlink()
    assert student.returncode == 1
    first, last = [x for x in said.splitlines() if "[robot/r1] warning: the clock" in x]
    assert first == "[robot/r1] warning: the clock is out of sight; waiting for it"
    assert re.fullmatch(
        r"\[robot/r1\] warning: the clock is out of sight for [34] s: this host ends",
        last,
    )
    assert said.endswith(f"rems: robot/r1: {last.partition('warning: ')[2]}\n")
