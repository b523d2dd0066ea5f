"""A clock in real time goes on when what was frozen goes on, whoever it was."""

import os
import random
import re
import signal
import sys
import time
from pathlib import Path

import pytest

from rems_net.client import Fabric
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import until
from tests.reliability.rig.programs import send
from tests.reliability.rig.rig import Rig

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not sys.platform.startswith("linux"),
        reason="it freezes processes, and is tried on Linux only",
    ),
]
PAUSES = 20 * int(os.environ.get("REMS_TRIALS", "1"))
#: s. A pause; one of twenty is longer than a session may be silent.
SHORT, LONG = (0.05, 1.0), (3.5, 4.5)
#: s. The next tick comes so soon after the last process goes on.
SOON = 0.5
LAB = """
[experiment]
name = "lab"
dt = "50 ms"
pace = 1.0
duration = "3600 s"
[[input]]
name = "keys"
type = "hand"
[[robot]]
name = "one"
definition = "woodbot"
driver = "kinematic"
command = "input/keys"
[[robot]]
name = "two"
definition = "woodbot"
driver = "kinematic"
command = "input/keys"
"""


@pytest.mark.timeout(120 + 4 * PAUSES)
@pytest.mark.parametrize("way", ["a run", "an open fabric"])
def test_a_clock_goes_on_after_pauses(way: str, tmp_path: Path) -> None:
    with Rig(tmp_path) as rig:
        router, endpoint = rig.router()
        (tmp_path / "lab.toml").write_text(LAB, encoding="utf-8")
        programs = [router]
        if way == "a run":
            programs.append(rig.rems("run", tmp_path / "lab.toml", router=endpoint))
        else:
            programs.append(rig.rems("router", "serve", "--no-qr", router=endpoint))
            programs[-1].wait_for("^Open fabric", 60.0)
            words = ("agent", "start", tmp_path / "lab.toml")
            programs.append(rig.rems(*words, router=endpoint))
        with Session(Link(endpoint)) as session:
            fabric = Fabric(session)

            def hosts() -> set[int]:
                return {int(row["host"].rpartition(":")[2]) for row in fabric.agents()}

            until(lambda: tick(fabric) > 10, 60.0)
            until(lambda: len(hosts()) >= 3, 60.0)
            pids = sorted({program.pid for program in programs} | hosts())
            late = []
            for n in range(PAUSES):
                pid = pids[n % len(pids)]
                least, most = LONG if random.random() < 0.05 else SHORT
                lasts = random.uniform(least, most)
                send(pid, signal.SIGSTOP)
                time.sleep(lasts)  # the length of the pause is what is tried
                send(pid, signal.SIGCONT)
                begun = time.monotonic()
                first = tick(fabric)
                until(lambda: tick(fabric) > first, 60.0)  # noqa: B023
                seconds = time.monotonic() - begun
                if seconds > SOON:
                    late.append(f"{seconds:.2f} s after {lasts:.2f} s of {pid}")
        for program in programs:
            assert program.ended is None, program.text()
            assert re.search("Traceback", program.text()) is None
    assert late == []


def tick(fabric: Fabric) -> int:
    """Return the newest tick; it is asked for again while nobody answers."""

    def look() -> int | None:
        told = fabric.get("clock/tick").get("rems/clock/tick", {})
        return int(told["n"]) + 1 if told else None

    found: int = until(look, 60.0)
    return found - 1
