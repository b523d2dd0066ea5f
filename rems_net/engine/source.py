"""Source: the origin of an In's value. All values enter the engine through it."""

from typing import Any, Protocol, TypeAlias

from rems_net.agents.about.wiring import Entry
from rems_net.agents.agent import Agent
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick
from rems_net.defdict import Converter, ToCdr
from rems_net.errors import RemsError

#: what makes the reader's value of its writer's
Conversion = Converter | ToCdr
#: A value in the reader's schema, and the tick at which its source made it. The value
#: is a DefDict; bytes, if the In takes messages.
Value: TypeAlias = tuple[Any, int]


class Gone(Exception):  # noqa: N818 - not an error: the writer has left the run
    """There will be no value: the writer has left at this very tick."""


class Source(Protocol):
    """The origin of one value of one In.

    key: of the port that is read (`robot/sim/state`); "" for values from outside.
    label: its name in messages.  entry: the agent that writes it, if it is known.
    """

    key: str
    label: str
    entry: Entry | None

    def take(self, tick: Tick) -> Value | None:
        """Return the value to read at this tick; None if there is no new one.

        Raises Gone, and RemsError for a value that does not fit.
        """


class Local:
    """Another agent of this engine, in lock-step.

    earlier: whether it steps in an earlier phase than its reader, which then reads
    the value of this tick; otherwise the value of the tick before.
    """

    def __init__(
        self,
        entry: Entry,
        agent: Agent,
        port: str,
        converter: Conversion,
        earlier: bool,
    ):
        self.key = self.label = f"{entry.key}/{port}"
        self.entry: Entry | None = entry
        self.own, self.port, self.convert = agent.__dict__, port, converter
        self._every, self._since = entry.every, entry.since
        self._run, self._earlier = runtime(agent), earlier
        #: tick of the value that the reader has
        self.have = 0
        self._kept: Value | None = None

    def alike(self) -> object:
        """Return the same for all sources that are due and converted in one way."""
        about = self._every, self._since, self._earlier, self.have
        return *about, self.own[self.port].schema

    def is_due(self, tick: Tick) -> bool:
        """Return whether there is a new value, and take it as taken."""
        due = tick.n if self._earlier else tick.n - 1
        due -= due % self._every  # as `Entry.due`, without a call
        if due == self.have or due < self._since:
            return False
        self.have = due
        return True

    def take(self, tick: Tick) -> Value | None:
        """Return what the agent has written since the last call."""
        if self._kept is not None:
            kept, self._kept = self._kept, None
            return kept
        if not self.is_due(tick):
            return None
        return self.convert(self.own[self.port]), self._run.source_tick

    def keep(self, n: int) -> None:
        """Take now what is to be read at tick n: a call is about to change it.

        So a reader here reads what a reader in another process does.
        """
        if not self._earlier and self._kept is None:
            have = self.have
            try:
                self._kept = self.take(Tick(n, 0.0, 0.0))
            except RemsError:
                self.have = have  # it is dropped, with a warning, when it is due
