"""Stopping: whether it stands still in fabric time, without commands and at STOP."""

from typing import Any

from rems_net.agents.robot import Robot
from rems_net.agents.runtime import runtime
from rems_net.testing import lines
from rems_net.testing.bench import Bench
from rems_net.testing.checks.driving import NOTHING, share_of
from rems_net.testing.checks.standing import stops_in_wall_time
from rems_net.testing.report import Outcome
from rems_net.testing.subject import Subject
from rems_net.testing.values import Values, medley, positions, together

#: Ratio to the way while driven. Less counts as standing.
STANDS = 0.02
#: s. How long it drives, and how long it is watched.
DRIVEN = 0.5
#: s of fabric time. A robot may roll for so long after the safe command.
ROLLS = 2.0


def stops(subject: Subject, outcome: Outcome) -> None:
    """Drive, then send no more commands; drive again, then put STOP."""
    if subject.driven:
        stops_in_wall_time(subject, outcome)
        return
    still = _stands_when_safe(subject)
    if not still:
        outcome.notes.append(
            "its safe command, the defaults of its command, is no standstill: it goes "
            "on when no command comes."
        )
    for put_stop in (False, True):
        with subject.opened() as robot:
            values = medley(robot, share_of(subject))
            where = Bench(robot)
            far = where.go(values, DRIVEN)
            if put_stop:
                runtime(robot).stopped = True
                why = "rems/stop was put"
                again: dict[str, Any] | None = values
                where.run(values, where.dt)
            else:
                why = f"no command came for {robot.max_age:g} s (max_age)"
                again = None
                where.cease(robot.max_age + 2 * where.dt)
            _is_safe(robot, why, outcome)
            where.go(again, ROLLS)
            on = where.go(again, DRIVEN)
            if still and outcome.ok:
                _stands(robot, why, far, on, outcome)
    outcome.remark = f"{robot.max_age:g} s of fabric time after the last command"


def _stands_when_safe(subject: Subject) -> bool:
    """Return whether it stays where it begins under its safe command."""
    with subject.opened() as robot:
        rest = Bench(robot).go(robot.schemas()["command"]().flat(), DRIVEN)
    with subject.opened() as robot:
        far = Bench(robot).go(medley(robot, share_of(subject)), DRIVEN)
    return not moving(robot, rest, far)


def moving(robot: Robot, by: Values, far: Values) -> str:
    """Return the field that moves more than a standing robot; "" if there is none.

    far: how far each field goes in the same time while it is driven
    """
    scale = together(robot.schemas()["state"], far)
    found = [p for p in positions(robot) if by[p] > STANDS * scale[p] + NOTHING]
    return max(found, key=lambda p: by[p], default="")


def _is_safe(robot: Robot, why: str, outcome: Outcome) -> None:
    """Check that it obeys its safe command now."""
    safe, have = robot.schemas()["command"](), robot.__dict__["command"]
    if have == safe:
        return
    path = next(p for p in safe.schema.paths if safe[p] != have[p])
    outcome.wrong(
        expected=f"it to obey its safe command, as {why}: {path} = {safe[path]!r}",
        came=f"it obeys {path} = {have[path]!r} still",
        where=lines.method(robot, "step", "obey", "drive"),
        type="leave step() out, and write drive(self, command, dt) and sense(self): "
        "then it stops by itself",
    )


def _stands(robot: Robot, why: str, far: Values, on: Values, outcome: Outcome) -> None:
    if field := moving(robot, on, far):
        outcome.wrong(
            expected=f"it to stand still {ROLLS:g} s after {why}: drive() is given the "
            "safe command from then on",
            came=f"{field} goes on by {on[field]:.3g} in {DRIVEN:g} s; by "
            f"{far[field]:.3g} while it was driven",
            where=lines.method(robot, "drive", "derivative", "step"),
            type="obey the command that drive() is given, at every step, and keep no "
            "speed of an earlier one",
        )
