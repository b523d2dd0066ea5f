"""Attacks on STOP, and on who holds it."""

import os
import platform
import re
import signal
import struct
import subprocess
import sys
from functools import partial

from rems_net.client import join
from rems_net.router.find import VARIABLE
from rems_net.router.session import Session
from rems_net.router.settings import Link
from tests.agents.runs import PARTS, free_port, until
from tests.client.programs import programs
from tests.commands import command
from tests.reliability.attacks import Bench, Outcome, attack
from tests.reliability.one_machine import SETTIME

SCRIPT = f"""
from rems_net import Experiment
lab = Experiment("lab", dt=0.02, duration="60 s", pace=1, folder={str(PARTS)!r})
for name in ("a", "b"):
    lab.robot(name, "parts.py:Cart", "parts.py:FreeEuler")
lab.run("out")
"""


@attack(
    "`rems stop` while a robot's host is frozen, and its liveliness token gone",
    "names the other robots only, exit status 0",
    quick=False,
)
def frozen_host(bench: Bench) -> Outcome:
    router = bench.router()
    where = {VARIABLE: router.endpoint}
    (bench.folder / "lab.py").write_text(SCRIPT, encoding="utf-8")
    bench.start("run", "lab.py", **where)
    with join(at=router.endpoint) as fabric:
        tokens = fabric.session.key("robot", "*", "@alive")
        until(lambda: len(fabric.session.who(tokens)) == 2, 60.0)
        rows = until(fabric.agents, 60.0)
        until(lambda: all(row["tick"] > 2 for row in fabric.agents()), 60.0)
        pid = next(r["host"] for r in rows if r["agent"] == "robot/a")
        frozen = int(pid.rpartition(":")[2])
        os.kill(frozen, signal.SIGSTOP)
        try:
            until(lambda: len(fabric.session.who(tokens)) == 1)
            done = bench.rems("stop", **where)
        finally:
            os.kill(frozen, signal.SIGCONT)
    named = f"robot/a on {platform.node()} has not answered" in done.stdout
    return Outcome(
        f"{'names' if named else 'does not name'} it and its machine, exit status "
        f"{done.returncode}",
        named and done.returncode == 1,
    )


@attack(
    "`rems stop` while the router of `rems router serve` is down",
    "one error, exit status 2; the robots drive on after its restart",
    quick=False,
)
def router_down(bench: Bench) -> Outcome:
    endpoint = f"tcp/127.0.0.1:{free_port()}"

    def serve() -> int:
        served = bench.start("router", "serve", "--listen", endpoint)
        assert served.stdout is not None
        assert served.stdout.readline().startswith("Open fabric")
        return served.pid

    first = serve()
    with programs() as beside:
        beside("standin.py", endpoint, "a=stands")
        os.kill(first, signal.SIGKILL)
        stop = bench.start("stop")
        assert stop.stdout is not None
        repeats = "STOP is repeated until it does" in stop.stdout.readline()
        serve()
        said, _ = stop.communicate(timeout=60)
    stands = "robot/a stands" in said
    return Outcome(
        "said again until the router is back; the robots stand, exit status "
        f"{stop.returncode}"
        if stands
        else "the robots do not stand",
        repeats and stands and stop.returncode == 0,
    )


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
