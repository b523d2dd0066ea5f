"""Stick: what a person's hand wants, in percent, and the command it becomes.

A stick knows no robot. A rule for each kind of command turns it into wheel speeds or a
velocity, as a percentage of the command's own ranges; so one stick drives unlike
robots, each with its own speeds.
"""

from collections.abc import Callable, Mapping
from functools import cache, partial
from operator import itemgetter

from rems_net.defdict import DefDict, Field, Rule, Schema, percent
from rems_net.errors import ExperimentError, some

#: percent of each axis -> percent of one field
Motion = Callable[[Mapping[str, float]], float]
#: percent. Full deflection of an axis, in both directions.
FULL = 100.0


def axis(doc: str) -> Field:
    """Return the field of one axis: -100 to 100 percent, at rest in the middle."""
    return percent(range=(-FULL, FULL), doc=doc)


STICK = Schema(
    "stick",
    {
        "ahead": axis("of full speed; back is negative"),
        "left": axis("sideways, for robots that can; right is negative"),
        "turn": axis("counter-clockwise, seen from above; clockwise is negative"),
    },
)

#: Names of fields for each axis, best first: of our robots, ROS's Twist and what people
#: call them.
NAMES = {
    "ahead": ("linear/x", "ahead", "forward", "speed", "velocity", "throttle", "v"),
    "left": ("linear/y", "sideways", "strafe"),
    "turn": ("angular/z", "turn", "turning", "yaw", "steering", "steer", "omega", "w"),
}
#: last chunks of the names of two wheels, or two sides
SIDES = (("left", "right"), ("l", "r"))


@cache
def stick_rule(command: Schema) -> Rule | None:
    """Return the rule that makes fields of this command from a stick; None if it can't.

    Two sides of wheels turn at ahead - turn and ahead + turn; both are scaled down if
    one would exceed 100 %, so that the robot keeps its curve. A velocity takes each
    axis by itself. Fields without limits are left out: 100 % of them is no number.
    """
    return _wheels(command) or _velocity(command)


def check_drivable(command: Schema, robot: str) -> Rule:
    """Return the rule for this robot's command. Raises ExperimentError without one."""
    rule = stick_rule(command)
    if rule is None:
        fields = some(command.paths, 6)
        raise ExperimentError(
            f"a stick cannot drive {robot}: it moves fields with limits that are named "
            "such as wheel/left and wheel/right, or linear/x and angular/z, and its "
            f"command has {fields}. Type: rems put {robot}/command "
            f"{command.paths[0]}=0 (R0622)"
        )
    return rule


def _is_speed(command: Schema, path: str) -> bool:
    """Return whether a field is a speed with limits, as fast back as ahead.

    Fields called left and right may also be the angles of two arms.
    """
    field = command[path]
    if not isinstance(field, Field) or field.range is None or field.shape:
        return False
    low, high = field.range
    speed = field.relative or "/" in field.unit or field.unit == "rpm"
    return low == -high < 0 and speed


def _wheels(command: Schema) -> Rule | None:
    for one, other in SIDES:
        for path in command.paths:
            begin, slash, last = path.rpartition("/")
            partner = f"{begin}{slash}{other}"
            if last != one or partner not in command.paths:
                continue
            if _is_speed(command, path) and _is_speed(command, partner):
                left, right = partial(_side, sign=-1), partial(_side, sign=1)
                return _rule(command, {path: left, partner: right})
    return None


def _velocity(command: Schema) -> Rule | None:
    found: dict[str, Motion] = {}
    for axis, names in NAMES.items():
        paths = [p for name in names for p in command.paths if p == name]
        paths += [p for name in names for p in command.paths if p.endswith(f"/{name}")]
        if paths and _is_speed(command, paths[0]):
            found[paths[0]] = itemgetter(axis)
    return _rule(command, found) if found else None


def _rule(command: Schema, made: dict[str, Motion]) -> Rule:
    def drive(stick: DefDict) -> dict[str, float]:
        axes = {axis: float(stick[axis]) for axis in STICK.paths}
        return {path: motion(axes) for path, motion in made.items()}

    gives = Schema("driven", {path: axis("of its range") for path in made})
    return Rule(f"stick to {command.name}", STICK, gives, drive)


def _side(axes: Mapping[str, float], sign: int) -> float:
    """Return the speed of a side, slower if the other one would exceed FULL.

    sign: 1 for the right side, -1 for the left one.
    """
    ahead, turn = axes["ahead"], axes["turn"]
    slower = (ahead + sign * turn) * FULL / max(FULL, abs(ahead) + abs(turn))
    return max(-FULL, min(FULL, slower))  # of rounding
