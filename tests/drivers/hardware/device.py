"""A cart's firmware in a process of its own, behind a pseudo-terminal.

`python device.py LINK LOG [--watchdog 0.5]`: LINK leads to the terminal, as a udev rule
would have it; LOG gets a line of JSON for everything that happens, stamped by
`time.monotonic`, which is one for all processes of a machine.

It is told `<number> <speed> <turn> <check>`, and answers
`<number> <x> <y> <heading> <check>`, one after the other: who writes before he has read
breaks the rule of a half-duplex line, and is noted. It stops by itself when it is told
nothing valid for `--watchdog` seconds.

On its standard input it is told to misbehave: `drop 0.1`, `corrupt 0.1` (share of the
replies), `late 0.2` (s), `hang 3` (s; reads and answers nothing), `unplug 2` (s; the
terminal is gone, and comes back under the same link), `fine`.
"""

import argparse
import json
import math
import os
import pty
import random
import select
import sys
import time
import tty
from pathlib import Path
from typing import Any

STEP = 0.002  # s, between two looks at the watchdog
THINKS = 0.001  # s, before it answers
SLOW = 0.02  # s, after which a driver may have given up on a reply
FORGIVES = 0.2  # s, in which both may still be out of step then


def check(text: str) -> str:
    return f"{sum(text.encode()) % 256:02x}"


class Firmware:
    def __init__(self, link: Path, log: Path, watchdog: float):
        self.link, self.watchdog = link, watchdog
        self.log = log.open("a", encoding="utf-8")
        self.x = self.y = self.heading = self.speed = self.turn = 0.0
        self.moved = self.told = time.monotonic()
        self.drop = self.corrupt = self.late = 0.0
        self.deaf_until = self.away_until = 0.0
        self.buffer = b""
        self.looked = time.monotonic()
        self.slept = 0.0
        self.random = random.Random(1)
        self.plug()

    def note(self, **what: Any) -> None:
        print(json.dumps({"t": time.monotonic()} | what), file=self.log, flush=True)

    def plug(self) -> None:
        self.master, self.slave = pty.openpty()
        tty.setraw(self.slave)
        self.link.unlink(missing_ok=True)
        self.link.symlink_to(os.ttyname(self.slave))
        self.buffer, self.away_until = b"", 0.0
        self.note(plugged=True)

    def unplug(self, seconds: float) -> None:
        self.link.unlink()
        os.close(self.master)
        os.close(self.slave)
        self.away_until = time.monotonic() + seconds
        self.note(plugged=False)

    def move(self) -> None:
        now = time.monotonic()
        dt, self.moved = now - self.moved, now
        self.x += dt * self.speed * math.cos(self.heading)
        self.y += dt * self.speed * math.sin(self.heading)
        self.heading += dt * self.turn
        if now - self.told > self.watchdog and (self.speed or self.turn):
            self.speed = self.turn = 0.0
            self.note(watchdog=True)

    def misbehave(self, words: list[str]) -> None:
        match words[0], float(words[1]) if len(words) > 1 else 0.0:
            case "drop", share:
                self.drop = share
            case "corrupt", share:
                self.corrupt = share
            case "late", seconds:
                self.late = seconds
            case "hang", seconds:
                self.deaf_until = time.monotonic() + seconds
            case "unplug", seconds:
                self.unplug(seconds)
            case _:
                self.drop = self.corrupt = self.late = self.deaf_until = 0.0
        self.note(told=" ".join(words))

    def run(self) -> None:
        """Live until the standard input ends."""
        words = sys.stdin.fileno()
        while True:
            self.awake()  # or it had a pause at the end of the last round
            self.looked = now = time.monotonic()
            plugged = not self.away_until
            if not plugged and now > self.away_until:
                self.plug()
            deaf = not plugged or now < self.deaf_until
            self.slept = now if deaf else self.slept
            ready, _, _ = select.select(
                [words] if deaf else [words, self.master], [], [], STEP
            )
            self.move()
            if words in ready:
                told = os.read(words, 4096).decode()
                if not told:
                    return
                for line in told.splitlines():
                    self.misbehave(line.split())
            elif ready:
                self.hear(os.read(self.master, 4096))

    def hear(self, data: bytes) -> None:
        *lines, self.buffer = (self.buffer + data).split(b"\n")
        for i, line in enumerate([line for line in lines if line]):
            if self.awake() and i:
                self.note(broken="two requests at once")
            text, _, mark = line.decode(errors="replace").rpartition(" ")
            if check(text) != mark:
                self.note(broken=f"a request that does not fit: {line!r}")
                continue
            number, speed, turn = text.split()[:3]
            self.speed, self.turn = float(speed), float(turn)
            self.told = time.monotonic()
            self.note(heard=[self.speed, self.turn], number=int(number))
            self.answer(number)

    def awake(self) -> bool:
        """Whether it has had no pause lately, for which it was taken to be silent."""
        now = time.monotonic()
        if now - self.looked > SLOW:
            self.slept = now
        return now - self.slept > FORGIVES

    def answer(self, number: str) -> None:
        time.sleep(self.late or THINKS)
        more = select.select([self.master], [], [], 0)[0]
        if self.awake() and more and not self.late:
            self.note(broken="written before the reply was read")
        text = f"{number} {self.x!r} {self.y!r} {self.heading!r}"
        reply = f"{text} {check(text)}\n"
        if self.random.random() < self.drop:
            return
        if self.random.random() < self.corrupt:
            at = self.random.randrange(len(reply) - 1)
            reply = f"{reply[:at]}{chr(ord(reply[at]) ^ 1)}{reply[at + 1 :]}"
        os.write(self.master, reply.encode())


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("link", type=Path)
    parser.add_argument("log", type=Path)
    parser.add_argument("--watchdog", type=float, default=0.5)
    told = parser.parse_args()
    Firmware(told.link, told.log, told.watchdog).run()


if __name__ == "__main__":
    main()
