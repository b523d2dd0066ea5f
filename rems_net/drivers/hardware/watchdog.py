"""Watchdog: chooses whether a driven robot obeys its command or its safe command.

Motion: whether a robot that was commanded to move has moved.
"""

from math import inf
from typing import NamedTuple

import numpy as np

from rems_net.agents.runtime import Runtime
from rems_net.agents.wall import wall
from rems_net.defdict import DefDict, Field, Schema

#: s. A robot that was commanded to move for longer, and never moved, gets a warning.
NEVER = 1.0


class Told(NamedTuple):
    """A command, its source tick, and the wall time at which it came here, s."""

    command: DefDict
    said: int | None
    at: float


class Watchdog:
    """Watchdog of commands: chooses what to obey before every exchange.

    A command is obeyed while it will still be valid at the next exchange, `period`
    seconds later, and only if its source tick is after the last
    fault: after STOP was released, and after the device had come back.
    """

    def __init__(self, run: Runtime, max_age: float, schema: Schema, period: float):
        self._run, self._max_age = run, max_age
        self._schema, self._period = schema, period
        self._told: Told | None = None
        #: wall s. Older commands do not count; none does before the device answers.
        self._since = inf
        #: why the safe command is obeyed; "" while the robot obeys its own
        self.why = "not connected"
        #: how often the robot was stopped because its command was too old
        self.expired = 0

    def tell(self, command: DefDict, said: int | None) -> None:
        """Take in a command and its source tick; called by the stepping thread."""
        self._told = Told(command.copy(), said, wall())

    def trust(self) -> None:
        """Obey commands from now on: the device answers, and stands."""
        self._since = wall()

    def distrust(self, why: str) -> None:
        """Obey nothing but the safe command until `trust`; `why` is for reports."""
        self._since, self.why = inf, why

    @property
    def trusts(self) -> bool:
        """Whether the device answered, and nothing has happened to it since."""
        return self._since < inf

    @property
    def safe(self) -> DefDict:
        """The safe command, a new copy each time: callers may change theirs."""
        return self._schema()

    def choose(self) -> DefDict:
        """Return the command to obey now."""
        now, told, guard = wall(), self._told, self._run.guard
        if not self.trusts:
            return self.safe
        if self._run.held:
            self._since, self.why = now, "stopped"
            return self.safe
        if told is None:
            self.why = "no command yet"
            return self.safe
        # Too few ticks make a command old, too: drive() runs at every tick received.
        ages = [now - told.at]
        if guard is not None:
            ages.append(inf if told.said is None else guard.age(told.said))
        if any(self._run.must_stand(a + self._period, self._max_age) for a in ages):
            if not self.why and told.command != self.safe:
                self.expired += 1
            self.why = f"its command is {max(ages):.2f} s old"
            return self.safe
        if not max(ages) < now - self._since:
            self.why = "no new command since it stopped"
            return self.safe
        self.why = ""
        return told.command.copy()


class Motion:
    """Comparison of a robot's commands with its readings: whether it ever moved.

    Its commands have speeds, in units such as m/s, or percent of a range.
    """

    def __init__(self, schema: Schema):
        fields = {path: schema[path] for path in schema.paths}
        self._speeds = [path for path, one in fields.items() if _is_speed(one)]
        #: s. Time for which it was commanded to move.
        self._commanded = 0.0
        self._first: DefDict | None = None
        self._moved = False

    def command(self, command: DefDict, seconds: float) -> None:
        """Take in a command that the device receives, for so long."""
        if not self._moved and any(np.any(command[path]) for path in self._speeds):
            self._commanded += seconds

    def read(self, state: DefDict | None) -> None:
        """Take in a state that was read from the device."""
        if state is not None and not self._moved:
            self._first = self._first or state
            self._moved = state != self._first

    def never(self) -> str:
        """Return a sentence part if it never moved, though it was commanded to."""
        if self._first is None or self._moved or self._commanded < NEVER:
            return ""
        return (
            f"was commanded to move for {self._commanded:.1f} s, and its state never "
            "changed. Check, in this order: 1. the messages above; 2. its power; 3. "
            "that its wheels can turn"
        )


def _is_speed(field: object) -> bool:
    """Return whether a robot should move if this field of its command is not 0."""
    if not isinstance(field, Field) or field.dtype == "str":
        return False
    return field.relative or "/" in field.unit or field.unit == "rpm"
