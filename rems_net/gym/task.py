"""Task: the reward, the end and the start of an episode."""

import re
from collections.abc import Mapping, Sequence
from random import Random
from typing import Any

from rems_net.defdict import Field, Schema, many_turns, parse_quantity
from rems_net.defdict.expression import Moment as Moment, Names as Names
from rems_net.errors import ExperimentError, nearest
from rems_net.events import warn

#: a letter of a unit, in a range; numbers have an `e`
UNIT = re.compile(r"[a-df-z]")


class Task:
    """A thing to learn: write those of its methods that differ from these."""

    def reward(self, now: Moment, before: Moment) -> Any:
        """Return the reward of the step from `before` to `now`."""
        return 0.0

    def ends(self, now: Moment) -> Any:
        """Return whether the episode is over: the goal is reached, or it has failed."""
        return False

    def start(self, random: Random) -> Mapping[str, Mapping[str, Any]]:
        """Return initial values, by robot: {"robot/sim": {"x": 0.1}}.

        random: made from the episode's seed; take all random numbers from it.
        """
        return {}


def judges(task: Task) -> bool:
    """Return whether it has rewards or ends of its own; else nothing is computed."""
    own = type(task)
    return own.reward is not Task.reward or own.ends is not Task.ends


class Drawn(Task):
    """A task whose start is drawn from ranges such as {"robot/sim.x": "-10..10 cm"}."""

    def __init__(self, ranges: Mapping[str, Any], schemas: Mapping[str, Schema]):
        if not isinstance(ranges, Mapping):
            raise ExperimentError(
                f"start is {ranges!r:.80}; expected ranges of initial values, such as "
                "{'robot/sim.x': '-10..10 cm'}. (R0926)"
            )
        self._ranges = [
            _range(str(where), given, schemas) for where, given in ranges.items()
        ]

    def start(self, random: Random) -> Mapping[str, Mapping[str, Any]]:
        """Return a value of each range."""
        found: dict[str, dict[str, Any]] = {}
        for robot, path, low, high in self._ranges:
            drawn = low + (high - low) * random.random()
            found.setdefault(robot, {})[path] = drawn
        return found


def _range(
    where: str, given: object, schemas: Mapping[str, Schema]
) -> tuple[str, str, float, float]:
    """Return robot, path, and both ends of a range in the unit of its field."""
    robot, dot, path = where.partition(".")
    if not dot or robot not in schemas:
        raise ExperimentError(
            f"start has {where!r}; expected a robot and a field of its state, such as "
            f"{next(iter(schemas), 'robot/sim')}.x.{nearest(robot, schemas)} (R0926)"
        )
    field = schemas[robot].find(path)
    if not isinstance(field, Field) or field.dtype != "float" or field.shape:
        raise ExperimentError(
            f"start has {where!r}, and {robot} has no number {path!r} in its start; it "
            f"has {', '.join(schemas[robot].paths)}."
            f"{nearest(path, schemas[robot].paths)} (R0926)"
        )
    low, high = _ends(where, given, field.unit)
    if not low <= high:
        raise ExperimentError(
            f"start of {where} is {given!r}; expected the lower end first. (R0926)"
        )
    turns = many_turns(max(high, -low), field.unit)
    if turns and not UNIT.search(str(given)):
        warn("start", f"start of {where} is {given!r}: {turns}")
    return robot, path, low, high


def _ends(where: str, given: object, unit: str) -> Sequence[float]:
    if isinstance(given, str) and ".." in given:
        low, _, high = given.partition("..")
        own = high.lstrip("+-0123456789.eE ")  # "-10..10 cm" has its unit once
        ends = low if low.strip("+-0123456789.eE ") else f"{low} {own}", high
        given = ends if own else [*map(_plain, ends)]
    both = given if isinstance(given, list | tuple) and len(given) == 2 else [given] * 2
    return [parse_quantity(one, unit, f"start of {where}") for one in both]


def _plain(text: str) -> object:
    """Return a number without a unit; the text, if it is none."""
    try:
        return float(text)
    except ValueError:
        return text
