"""Driving: whether the robot moves as commanded, and reports where it is."""

import time
from math import ceil
from typing import Any

from rems_net.agents.robot import Robot
from rems_net.testing import lines
from rems_net.testing.bench import Bench, bench
from rems_net.testing.report import Outcome
from rems_net.testing.subject import Subject
from rems_net.testing.values import SLOW, WELL, apart, medley, most, numbers, sweeps

#: s. Length of each sweep: of a simulated robot, and of a driven one.
EACH, EACH_DRIVEN = 0.4, 0.2
#: s. First reading of the sensors while moving: an arm that has arrived has no speed.
UNDER_WAY = 0.1
#: Any unit. Less than this counts as no motion.
NOTHING = 1e-9
#: Ratio. Largest difference of the way in the same time, by steps twice as long.
AGREE = 0.25
#: How many sweeps a driven robot makes, since each takes wall time.
FEW = 6


def drives(subject: Subject, outcome: Outcome) -> None:
    """Try all commands, and check what moves."""
    still = []
    moved: dict[str, float] = {}
    steps, lasted = 0, 0.0
    with subject.opened() as robot:
        where = bench(robot)
        seconds = _seconds(subject)
        given = list(sweeps(robot.schemas()["command"], share_of(subject)))
        for name, values in given[:FEW] if subject.driven else given:
            before = where.numbers(), _sensed(robot)
            begun = time.perf_counter()
            where.run(values, seconds)
            lasted += time.perf_counter() - begun
            steps += where.count(seconds)
            _obeyed(robot, values, outcome)
            gone = apart(before[0], where.numbers())
            seen = apart(before[1], _sensed(robot))
            moved = {p: max(moved.get(p, 0.0), d) for p, d in gone.items()}
            if most(gone)[1] <= NOTHING and most(seen)[1] <= NOTHING:
                still.append(name)
    if most(moved)[1] <= NOTHING:
        _nothing(robot, len(given), outcome)
        return
    outcome.notes += [f"command {name} alone changes nothing." for name in still]
    outcome.remark = f"commands tried: {len(given)}; {_each(subject, lasted / steps)}"
    if not subject.driven:
        _lasts(subject, outcome)


def share_of(subject: Subject) -> float:
    """Return how far commands go: little for hardware, which may fall off a table."""
    return SLOW if subject.driven else WELL


def _seconds(subject: Subject) -> float:
    return EACH_DRIVEN if subject.driven else EACH


def _each(subject: Subject, seconds: float) -> str:
    if subject.driven:
        return f"a command every {seconds * 1e3:.0f} ms"
    if seconds < 1e-3:
        return f"{seconds * 1e6:.0f} us a step"
    return f"{seconds * 1e3:.1f} ms a step"


def _sensed(robot: Robot) -> Any:
    return numbers(robot.sensors) if "sensors" in robot.schemas() else {}


def _nothing(robot: Robot, count: int, outcome: Outcome) -> None:
    outcome.wrong(
        expected="the state to change when it is commanded to move",
        came=f"{count} commands, and nothing in the state changes",
        where=lines.method(robot, "drive", "exchange", "derivative"),
        type="self.state.x += command.speed * dt  # in drive(self, command, dt)"
        if robot.lockstep
        else 'return {"state": {"x": ...}}  # from exchange(self, command)',
    )


def _obeyed(robot: Robot, values: dict[str, Any], outcome: Outcome) -> None:
    told = robot.schemas()["command"](values)
    have = robot.__dict__["command"]
    if have != told and outcome.ok:
        path = next(p for p in told.schema.paths if not _same(told[p], have[p]))
        outcome.wrong(
            expected="drive() to read its command, which is recorded as what it obeyed",
            came=f"its command was {path} = {told[path]!r}, and it took {have[path]!r}",
            where=lines.method(robot, "drive", "sense", "step"),
            type="command = command.copy()  # before it is changed",
        )


def _lasts(subject: Subject, outcome: Outcome) -> None:
    """Check that a second leads to about the same place in long and short steps."""
    ends = []
    for dt in (0.1, 0.05):
        with subject.opened() as robot:
            where = Bench(robot, dt)
            values = medley(robot, WELL)
            before = where.numbers()
            for _ in range(ceil(1.0 / dt)):
                where.step(values)
            ends.append(apart(before, where.numbers()))
    long, short = ends
    field, far = most(long)
    if abs(long[field] - short[field]) <= AGREE * max(far, short[field]) + NOTHING:
        return
    unread = lines.unread(robot, "drive", 2)
    outcome.wrong(
        expected="drive(command, dt) to act for dt seconds: a second of motion leads "
        "to the same place, in 10 steps of 0.1 s and in 20 of 0.05 s",
        came=f"{field} changes by {far:.4g} in 10 steps, by {short[field]:.4g} in 20"
        f"{f'; drive() never reads {unread}' if unread else ''}",
        where=lines.method(robot, "drive"),
        type="self.state.x += command.speed * dt",
    )


def senses(subject: Subject, outcome: Outcome) -> None:
    """Read twice without moving; check also that sensors change at all."""
    with subject.opened() as robot:
        where = bench(robot)
        changed: set[str] = set()
        first = _sensed(robot)
        for share in (SLOW, share_of(subject)):
            values = medley(robot, share)
            for lasts in (UNDER_WAY, _seconds(subject)):
                where.run(values, lasts)
                found = apart(first, _sensed(robot))
                changed |= {path for path, by in found.items() if by > 0}
        if robot.lockstep:
            _twice(robot, where, outcome)
        if first and not changed:
            outcome.notes.append(
                "no sensor ever has another value than at first: does sense() "
                f"set self.sensors? {lines.method(robot, 'sense', 'measure')}"
            )
        outcome.remark = (
            f"{len(changed)} of {len(first)} sensor values change"
            if first
            else "the state; it has no sensors"
        )


def _twice(robot: Robot, where: Bench, outcome: Outcome) -> None:
    before = where.where(), dict(_sensed(robot))
    robot.sense()
    after = where.where(), dict(_sensed(robot))
    for port, one, other in zip(("state", "sensors"), before, after, strict=True):
        for path in one:
            if not _same(one[path], other[path]):
                outcome.wrong(
                    expected="sense() to read: reading twice gives the same twice, "
                    "since no time has passed",
                    came=f"{port} {path} was {one[path]}, and is {other[path]} when it "
                    "is asked again",
                    where=lines.restless(robot) or lines.method(robot, "sense"),
                    type="move what changes the state into drive(self, command, dt)",
                )
                return


def _same(one: Any, other: Any) -> bool:
    same = one == other
    return bool(same.all()) if hasattr(same, "all") else bool(same)
