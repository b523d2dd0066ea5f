"""Resetting: a reset leaves nothing of the past, and robots share nothing."""

from typing import Any

from rems_net.agents.robot import Robot
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick, time_of
from rems_net.defdict import Field
from rems_net.testing import lines
from rems_net.testing.bench import Bench, bench
from rems_net.testing.checks.driving import share_of
from rems_net.testing.report import Outcome
from rems_net.testing.subject import Subject
from rems_net.testing.values import differs, medley, positions

SECONDS = 0.5
#: Units of the field. Distance of the other start, and its largest error.
ELSEWHERE, NEAR = 0.01, 1e-6


def resets(subject: Subject, outcome: Outcome) -> None:
    """Drive, reset, drive the same again, and compare."""
    with subject.opened() as robot:
        values = medley(robot, share_of(subject))
        where = bench(robot)
        begun, own = where.where(), lines.own_values(robot)
        first = where.run(values, SECONDS)
        robot.reset()
        if subject.driven:
            outcome.remark = "while it is connected"
            where.cease(0.1)
            return
        left = [n for n, text in lines.own_values(robot).items() if own.get(n) != text]
        if _begins(robot, begun, left, outcome):
            return
        second = Bench(robot).run(values, SECONDS)
    _same_again(robot, first, second, left, outcome)
    if outcome.ok:
        _goes_elsewhere(subject, robot, outcome)
    outcome.remark = "and drives the same again, to the last bit"


def _goes_elsewhere(subject: Subject, robot: Robot, outcome: Outcome) -> None:
    """Check that it begins at the state that `initial` gives."""
    given = _elsewhere(robot)
    if not given:
        return
    with subject.opened("elsewhere", initial=given) as robot:
        robot.sense()
        now = Bench(robot).where()
    for path, value in given.items():
        if abs(now[path] - value) > NEAR:
            outcome.wrong(
                expected=f"a robot with initial = {{{path!r}: {value:g}}} to be there "
                "when it has been opened",
                came=f"state {path} = {now[path]!r}",
                where=lines.method(robot, "open", "sense", "rewind"),
                type="begin at self.state in open(self) and rewind(self), and not at 0",
            )
            return


def _elsewhere(robot: Robot) -> dict[str, float]:
    """Return another place to begin at, of the fields that its mathematics moves."""
    if not hasattr(robot, "derivative"):
        return {}
    state = robot.begins()
    given = {}
    for path in positions(robot):
        field, value = state.schema[path], state[path]
        if isinstance(field, Field) and field.dtype == "float" and not field.shape:
            low, high = field.limits
            if low <= value + ELSEWHERE <= high:
                given[path] = value + ELSEWHERE
    return given


def _begins(
    robot: Robot, begun: dict[str, Any], left: list[str], outcome: Outcome
) -> bool:
    """Return whether the state is wrong now, after the reset."""
    schema = robot.schemas()["state"]
    now = Bench(robot).where()
    field, far = differs(schema, begun, now)
    if not far:
        return False
    outcome.wrong(
        expected=f"reset() to bring the state back: {field} = {begun[field]!r}",
        came=f"{field} = {now[field]!r}",
        where=lines.method(robot, "rewind", "drive"),
        type=_RESET.format(left[0] if left else "what_drive_changes"),
    )
    return True


_RESET = """\
def rewind(self):
    super().rewind()  # puts the state back
    self.{} = ...  # and here what you keep besides"""


def _same_again(
    robot: Robot,
    first: list[dict[str, Any]],
    second: list[dict[str, Any]],
    left: list[str],
    outcome: Outcome,
) -> None:
    schema = robot.schemas()["state"]
    for n, (one, other) in enumerate(zip(first, second, strict=True), 1):
        field, far = differs(schema, one, other)
        if not far:
            continue
        restless = lines.restless(robot)
        kept = f"; reset() leaves {', '.join(f'self.{one}' for one in left)}"
        outcome.wrong(
            expected="the same commands after reset() to lead along the same way, to "
            "the last bit",
            came=f"{field} is {other[field]!r} at step {n}, and was {one[field]!r}"
            f"{kept if left and not restless else ''}",
            where=restless
            or lines.setting(robot, dict.fromkeys(left))
            or lines.method(robot, "rewind", "drive"),
            type=lines.REPEATABLE
            if restless
            else _RESET.format(left[0] if left else "what_drive_changes"),
        )
        return


def shares(subject: Subject, outcome: Outcome) -> None:
    """Drive one of two in one process: the other stands. Then step both as a swarm."""
    if subject.driven:
        outcome.skipped = "a device has one user"
        return
    if subject.driver.one_per_process:
        outcome.skipped = "a process can hold one of it"
        return
    with subject.opened("drives") as a, subject.opened("stands") as b:
        values = medley(a, share_of(subject))
        b.sense()  # rounding inside the engine does not come from the other robot
        alone, before = Bench(a), Bench(b).where()
        path = alone.run(values, SECONDS)
        b.sense()
        after = Bench(b).where()
        schema = b.schemas()["state"]
        field, far = differs(schema, before, after)
        if far:
            name, text = lines.shared(b)
            outcome.wrong(
                expected="two robots in one process to have nothing in common",
                came=f"one was driven, and {field} of the other one changed from "
                f"{before[field]!r} to {after[field]!r}",
                where=f"{name} = {text}, which all of them share"
                if name
                else lines.method(b, "drive", "sense"),
                type=f"def open(self):\n    self.{name.rpartition('.')[2] or 'x'} "
                "= ...  # one for each robot",
            )
            return
    _swarm(subject, path, outcome)


def _swarm(subject: Subject, path: list[dict[str, Any]], outcome: Outcome) -> None:
    """Check that stepping many at once gives the same bits as stepping each alone."""
    outcome.remark = "two in one process have nothing in common"
    with subject.opened("a") as a, subject.opened("b") as b:
        together = subject.driver.swarm([a, b])
        if together is None:
            return
        values = medley(a, share_of(subject))
        dt = Bench(a).dt
        for n, alone in enumerate(path, 1):
            tick = Tick(n, time_of(n, dt), dt)
            for robot in (a, b):
                robot.__dict__["command"] = robot.schemas()["command"](values)
                run = runtime(robot)
                run.source_ticks["command"] = n
                run.begin(tick)
            together(tick)
            field, far = differs(b.schemas()["state"], alone, Bench(b).where())
            if far:
                outcome.wrong(
                    expected="swarm() to do what step() does for each, to the last bit",
                    came=f"at step {n} {field} differs by {far:.3g}",
                    where=lines.method(a, "swarm"),
                    type="return None  # from swarm(), until it does",
                )
                return
    outcome.remark += ", and step as a swarm"
