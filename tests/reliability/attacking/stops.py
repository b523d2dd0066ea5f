"""Attacks on STOP, and on who holds it."""

import re
import struct
import subprocess
import sys
from functools import partial

from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import free_port, until
from tests.client.programs import programs
from tests.commands import command
from tests.reliability.attacks import Bench, Outcome, attack
from tests.reliability.one_machine import SETTIME


@attack(
    "a full disk where `rems router serve` writes its lines",
    "not tried",
)
def full_disk(bench: Bench) -> Outcome:
    if not sys.platform.startswith("linux"):
        return Outcome("not tried: `ulimit -f` is Unix's", True)
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    words = " ".join(command("router", "serve", "--listen", endpoint))
    with (bench.folder / "log").open("w") as log:
        served = subprocess.Popen(
            ["sh", "-c", f"ulimit -f 1; exec {words}"],
            cwd=bench.folder,
            env=bench.environment({}),
            stdin=subprocess.PIPE,
            stdout=log,
            stderr=subprocess.STDOUT,
            text=True,
        )
        bench.stack.callback(served.communicate)
        bench.stack.callback(served.kill)
        text = bench.folder / "log"
        until(lambda: re.search("Open fabric", text.read_text()), 60.0)
        assert served.stdin is not None
        with Session(Link(endpoint, timeout=20.0)) as session, programs() as beside:
            beside("standin.py", endpoint, "a=stands")
            for _ in range(8):  # each is answered by some lines
                served.stdin.write("nonsense\nstop\n")
                served.stdin.flush()
            until(lambda: text.stat().st_size >= 512)
            until(lambda: session.ask("rems/stop/@holds", timeout=0.5))
            tick = session.ask("rems/clock/tick")[0].payload
            until(lambda: session.ask("rems/clock/tick")[0].payload != tick)
    return Outcome("lines are lost; it serves on, and STOP holds", True)


@attack(
    "the system's time set 1 h forward and back where `rems router serve` holds STOP",
    "not tried",
    quick=False,
)
def stepped_time(bench: Bench) -> Outcome:
    if not sys.platform.startswith("linux"):
        return Outcome("not tried: it is done by a library for Linux", True)
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    library, offset = bench.folder / "settime.so", bench.folder / "offset"
    words = ["cc", "-shared", "-fPIC", "-o", str(library), str(SETTIME)]
    subprocess.run(words, check=True)
    offset.write_bytes(struct.pack("q", 0))
    told = {"LD_PRELOAD": str(library), "SETTIME_FILE": str(offset)}
    served = bench.start("router", "serve", "--listen", endpoint, **told)
    assert served.stdout is not None
    assert served.stdout.readline().startswith("Open fabric")
    with Session(Link(endpoint, timeout=20.0)) as session, programs() as beside:
        beside("standin.py", endpoint, "a=stands")
        assert bench.rems("stop", REMS_ROUTER=endpoint).returncode == 0
        for seconds in (3600, -3600):
            with offset.open("r+b") as file:
                file.write(struct.pack("q", seconds))
            ticks: set[bytes] = set()
            until(partial(_goes_on, session, ticks))
            assert session.ask("rems/stop/@holds", timeout=0.5)
            assert session.who("rems/robot/a/@alive")
        done = bench.rems("stop", REMS_ROUTER=endpoint)
    return Outcome(
        "ticks go on, STOP holds, and nobody is lost",
        done.returncode == 0 and "robot/a stands" in done.stdout,
    )


def _goes_on(session: Session, ticks: set[bytes]) -> bool:
    """Return whether several ticks have come."""
    ticks.add(session.ask("rems/clock/tick")[0].payload)
    return len(ticks) > 3
