"""A device thread at 50 Hz on a pseudo-terminal, against a bare loop of pyserial.

python -m benchmarks.programs.driving rems|bare EXCHANGES

At the other end, in a process of its own, an emulated Create 2 notes when each command
arrives. The jitter is by how much the time from one to the next differs from 20 ms.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path
from statistics import median, quantiles
from typing import Any

import serial

from rems_net.agents.robot import combine
from rems_net.drivers.hardware.create2 import commands, readings
from rems_net.drivers.hardware.create2.commands import Op
from rems_net.drivers.hardware.create2.open_interface import OpenInterface
from rems_net.emulators.create2.device import Create2Device
from rems_net.emulators.emulator import Emulator
from rems_net.emulators.terminal import Terminal
from rems_net.robots.create2 import Create2

PERIOD = 0.02


class Noting(Create2Device):
    """Notes when it is told something."""

    def __init__(self) -> None:
        super().__init__()
        self.times: list[float] = []

    def hear(self, portion: bytes) -> list[bytes]:
        now = time.monotonic()
        answers = super().hear(portion)
        done = self.interface.done
        self.times += [now for op, _ in done if op is Op.DRIVE_DIRECT]
        done.clear()
        return answers


def device(path: Path) -> None:
    """Be there until the standard input ends; then say when it was told something."""
    noting = Noting()
    with Emulator(noting, Terminal(path)):
        print("ready", flush=True)
        sys.stdin.read()
    print(json.dumps(noting.times))


def rems(port: str, exchanges: int) -> None:
    """The driver, told something new at 20 Hz, as a host would."""
    robot: Any = combine(Create2, OpenInterface)("b", options={"port": port})
    robot.prepare()
    robot.open()
    while robot.figures()["cycles"] < exchanges:
        robot.command = {"wheel/left": 5.0, "wheel/right": 4.0}
        robot.drive(robot.command, 0.05)
        robot.sense()
        time.sleep(0.05)
    robot.close()


def bare(port: str, exchanges: int) -> None:
    """Write, read what is there, sleep until start + n * 20 ms."""
    with serial.Serial(port, 115_200, timeout=0.1) as line:
        line.write(bytes([Op.START, Op.SAFE]) + commands.stream(readings.numbers()))
        time.sleep(0.1)
        start = time.monotonic()
        for n in range(exchanges):
            line.write(commands.drive_direct(144, 180))
            line.read(line.in_waiting)
            while (left := start + (n + 1) * PERIOD - time.monotonic()) > 0:
                time.sleep(left)


def main() -> None:
    what, count = sys.argv[1:3]
    if what == "device":
        device(Path(count))
        return
    with tempfile.TemporaryDirectory() as folder:
        port = str(Path(folder) / "port")
        module = [sys.executable, "-m", "benchmarks.programs.driving", "device", port]
        child = subprocess.Popen(
            module, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert child.stdout is not None
        child.stdout.readline()
        (rems if what == "rems" else bare)(port, int(count))
        times = json.loads(child.communicate()[0])
    apart = [b - a for a, b in pairwise(times)]
    # The first and the last are at the beginning and the end, which have no rhythm.
    jitter = [1e6 * abs(one - PERIOD) for one in apart[5:-5]]
    result = {
        "p50": median(jitter),
        "p99": quantiles(jitter, n=100)[98],
        "exchanges": len(times),
    }
    print(json.dumps(result))


if __name__ == "__main__":
    main()
