"""Watchdog: whether a driven robot obeys what it was told, or its safe command."""

from math import inf
from typing import NamedTuple

from rems_net.agents.runtime import Runtime
from rems_net.agents.wall import wall
from rems_net.defdict import DefDict, Schema


class Told(NamedTuple):
    """A command, the tick at which its source said it, and when it came here."""

    command: DefDict
    said: int | None
    at: float


class Watchdog:
    """Asked before every exchange, what to obey.

    A command is obeyed while it is so fresh that it stays valid until the next
    exchange, `period` seconds later, and only if its source said it after the last
    fault: after STOP was released, and after the device had come back.
    """

    def __init__(self, run: Runtime, max_age: float, schema: Schema, period: float):
        self._run, self._max_age = run, max_age
        self._schema, self._period = schema, period
        self._told: Told | None = None
        #: what was said before does not count; nothing does before the device answers
        self._since = inf
        #: why the safe command is obeyed; "" while the robot does as it was told
        self.why = "not connected"
        #: how often it stopped a robot because nobody told it anything new
        self.expired = 0

    def tell(self, command: DefDict, said: int | None) -> None:
        """Take in a command; from the stepping thread."""
        self._told = Told(command.copy(), said, wall())

    def trust(self) -> None:
        """From now on: the device answers, and stands."""
        self._since = wall()

    def distrust(self, why: str) -> None:
        """Until `trust`, nothing is obeyed but the safe command."""
        self._since, self.why = inf, why

    @property
    def trusts(self) -> bool:
        """Whether the device answered, and nothing has happened to it since."""
        return self._since < inf

    @property
    def safe(self) -> DefDict:
        """The safe command, made anew: whoever changes it changes his own."""
        return self._schema()

    def choose(self) -> DefDict:
        """Return what to obey now."""
        now, told, guard = wall(), self._told, self._run.guard
        if not self.trusts:
            return self.safe
        if self._run.held:
            self._since, self.why = now, "stopped"
            return self.safe
        if told is None:
            self.why = "told nothing yet"
            return self.safe
        # No tick makes it old, too: drive() is called at every one that is heard.
        ages = [now - told.at]
        if guard is not None:
            ages.append(inf if told.said is None else guard.age(told.said))
        if any(self._run.must_stand(a + self._period, self._max_age) for a in ages):
            if not self.why and told.command != self.safe:
                self.expired += 1
            self.why = f"what it was told is {max(ages):.2f} s old"
            return self.safe
        if not max(ages) < now - self._since:
            self.why = "told nothing new since it stopped"
            return self.safe
        self.why = ""
        return told.command.copy()
