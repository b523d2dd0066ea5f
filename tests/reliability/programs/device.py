"""A device: robots that move in wall time, each behind a pseudo-terminal.

`python -m tests.reliability.programs.device LOG [--robots 1] [--watchdog 0.5]`

Each robot is a unicycle, integrated at 200 Hz in wall time, whoever is connected. It
is told, and answers, in lines, one at a time (half-duplex: it answers when it has been
told, and is told again when it has answered):

    V <speed m/s> <turn rad/s>    ->  S <x m> <y m> <heading rad> <speed> <turn>

Anything else is answered by `E <reason>` and changes nothing. Its own watchdog stands
it still when no valid line has come for so many seconds.

Its first line says where the terminals are: {"ports": [path...]}. LOG gets a line of
JSON whenever a robot begins to move or stands still: its number, `moves`, the reason
(`told` or `watchdog`), CLOCK_MONOTONIC and CLOCK_BOOTTIME in seconds.
"""

import argparse
import json
import math
import os
import select
import sys
import time
import tty
from contextlib import suppress
from pathlib import Path
from typing import TextIO

STEP = 1 / 200


class Robot:
    """A unicycle that stands still when it is told nothing."""

    def __init__(self, number: int, watchdog: float, log: TextIO):
        self.number, self.watchdog, self._log = number, watchdog, log
        self.master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self.master, False)
        self.port = os.ttyname(self._slave)
        self.x = self.y = self.heading = self.speed = self.turn = 0.0
        self.fed = time.monotonic()
        self._line = b""

    def hear(self) -> None:
        """Read what came, and answer each whole line."""
        try:
            self._line += os.read(self.master, 4096)
        except BlockingIOError:
            return
        *lines, self._line = self._line.split(b"\n")
        self._line = self._line[-256:]
        for line in lines:
            answer = self._obey(line)
            # Nobody may be there to read it: then it is lost, as on a wire.
            _, ready, _ = select.select((), (self.master,), (), 0)
            if ready:
                os.write(self.master, answer.encode() + b"\n")

    def _obey(self, line: bytes) -> str:
        word, *numbers = line.decode("ascii", errors="replace").split() or [""]
        try:
            speed, turn = map(float, numbers)
        except ValueError:
            return "E two numbers are expected"
        if word != "V" or not math.isfinite(speed) or not math.isfinite(turn):
            return "E unknown, or not finite"
        self.fed = time.monotonic()
        self._set(speed, turn, "told")
        where = self.x, self.y, self.heading, self.speed, self.turn
        return "S " + " ".join(f"{v:.6f}" for v in where)

    def _set(self, speed: float, turn: float, why: str) -> None:
        moved = bool(self.speed or self.turn)
        self.speed, self.turn = speed, turn
        moves = bool(speed or turn)
        if moved != moves:
            line = {
                "robot": self.number,
                "moves": moves,
                "why": why,
                "monotonic": time.monotonic(),
                "boottime": time.clock_gettime(time.CLOCK_BOOTTIME),
            }
            print(json.dumps(line), file=self._log, flush=True)

    def step(self, now: float) -> None:
        """Move for one step; stand still when nothing valid has come for too long."""
        if now - self.fed > self.watchdog:
            self._set(0.0, 0.0, "watchdog")
        self.x += STEP * self.speed * math.cos(self.heading)
        self.y += STEP * self.speed * math.sin(self.heading)
        self.heading += STEP * self.turn


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("log", type=Path)
    parser.add_argument("--robots", type=int, default=1)
    parser.add_argument("--watchdog", type=float, default=0.5)
    given = parser.parse_args()
    with suppress(PermissionError):
        # Firmware has a computer of its own, which is never busy with other things.
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
    with given.log.open("w", encoding="utf-8") as log:
        robots = [Robot(n, given.watchdog, log) for n in range(given.robots)]
        by_master = {robot.master: robot for robot in robots}
        print(json.dumps({"ports": [robot.port for robot in robots]}), flush=True)
        due = time.monotonic()
        while True:
            left = max(0.0, due - time.monotonic())
            for ready in select.select(list(by_master), (), (), left)[0]:
                by_master[ready].hear()
            now = time.monotonic()
            while due <= now:
                for robot in robots:
                    robot.step(now)
                due += STEP


if __name__ == "__main__":
    sys.exit(main())
