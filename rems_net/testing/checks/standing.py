"""Standing: whether a driven robot stops by itself, in wall time."""

import time
from dataclasses import dataclass
from typing import Any

from rems_net.agents.runtime import runtime
from rems_net.drivers.hardware.driven import Driven
from rems_net.testing import lines
from rems_net.testing.bench import Bench, bench
from rems_net.testing.report import Outcome
from rems_net.testing.subject import Subject
from rems_net.testing.values import SLOW, Values, medley, positions, together

#: Ratio to the way while driven. Less counts as standing, despite noise.
STANDS = 0.1
#: s. How long it is watched.
WATCHED = 0.3
#: s. Additional time for a busy computer and a device.
BUSY = 3.0
SILENCE, OLD, STOP = "no tick comes any more", "its command is old", "STOP is put"


@dataclass
class Guard:
    """Guard that reports what this check sets: STOP, and the age of the command, s."""

    stopped: bool = False
    oldness: float = 0.0

    def age(self, n: int) -> float:
        """Return the wall time since tick n, s."""
        return self.oldness


def stops_in_wall_time(subject: Subject, outcome: Outcome) -> None:
    """Drive, then stop the ticks; then send old commands; then put STOP."""
    with subject.opened() as robot:
        if not isinstance(robot, Driven):
            _no_thread(subject, outcome)
            return
        values = medley(robot, SLOW)
        where = bench(robot)
        guard = Guard()
        runtime(robot).guard = guard
        worst = 0.0
        for why in (SILENCE, OLD, STOP):
            if not _obeys(robot, where, values):
                outcome.wrong(
                    expected="it to obey a new command, after it had stopped",
                    came=f"{robot.figures()['safe']}, {BUSY:g} s long",
                    where=lines.method(robot, "exchange", "connect"),
                    type="return what the device sends from exchange(); a WireError or "
                    "a TimeoutError is for a reply that does not fit, or is late",
                )
                return
            far = where.go(values, WATCHED)
            begun = time.monotonic()
            guard.stopped = why == STOP
            guard.oldness = 2 * robot.max_age if why == OLD else 0.0
            told = None if why == SILENCE else values
            while not robot.figures()["safe"]:
                if time.monotonic() - begun > robot.max_age + BUSY:
                    break
                where.go(told, where.dt)
            worst = max(worst, time.monotonic() - begun)
            _stands(robot, where, why, far, outcome)
            if not outcome.ok:
                return
            guard.stopped, guard.oldness = False, 0.0
        outcome.remark = f"after {worst:.2f} s of wall time at most"


def _no_thread(subject: Subject, outcome: Outcome) -> None:
    name = subject.driver.__name__
    outcome.wrong(
        expected="a robot that is really driven to stop in wall time, though nobody "
        "calls drive() any more: the clock may be frozen, or cut off",
        came=f"{name} has lockstep = False, and no device thread that would notice",
        where=name,
        type="from rems_net.drivers.hardware.driven import Driven\n"
        f"class {name}(Driven):\n"
        "    def exchange(self, command): ...  # docs/hardware.md",
    )


def _obeys(robot: Driven, where: Bench, values: dict[str, Any]) -> bool:
    """Command it to move; return whether it obeys within BUSY seconds."""
    end = time.monotonic() + BUSY
    where.run(values, 0.1)
    while robot.figures()["safe"] and time.monotonic() < end:
        where.step(values)
    return not robot.figures()["safe"]


def _stands(
    robot: Driven, where: Bench, why: str, far: Values, outcome: Outcome
) -> None:
    """Check that the device thread puts the safe command, and the robot obeys it."""
    if not robot.figures()["safe"]:
        outcome.wrong(
            expected=f"its device thread to put the safe command when {why}",
            came=f"it obeys its last command, {robot.max_age + BUSY:g} s later still",
            where=lines.method(robot, "figures", "drive", "exchange"),
            type="leave drive() and open() to Driven, and write exchange()",
        )
        return
    scale = together(robot.schemas()["state"], far)
    end = time.monotonic() + BUSY
    while True:
        on = where.go(None, WATCHED)
        moving = [p for p in positions(robot) if on[p] > STANDS * scale[p] + 1e-6]
        if not moving:
            return
        if time.monotonic() > end:
            field = max(moving, key=lambda path: on[path])
            outcome.wrong(
                expected=f"it to stand still when {why}, and the safe command is put",
                came=f"{field} goes on by {on[field]:.3g} in {WATCHED:g} s",
                where=lines.method(robot, "exchange"),
                type="write the command that exchange() is given, each time",
            )
            return
