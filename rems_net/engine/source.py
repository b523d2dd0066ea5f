"""Source: the origin of an In's value. All values enter the engine through it."""

from typing import NamedTuple, Protocol

from rems_net.agents.agent import Agent
from rems_net.agents.runtime import runtime
from rems_net.agents.tick import Tick
from rems_net.defdict import Converter, DefDict
from rems_net.engine.wiring import Entry


class Value(NamedTuple):
    """A value in the reader's schema, and the tick at which its source made it."""

    value: DefDict
    source_tick: int


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
        ...


class Local:
    """Another agent of this engine, in lock-step.

    earlier: whether it steps in an earlier phase than its reader, which then reads
    the value of this tick; otherwise the value of the tick before.
    """

    def __init__(
        self, entry: Entry, agent: Agent, port: str, converter: Converter, earlier: bool
    ):
        self.key = self.label = f"{entry.key}/{port}"
        self.entry: Entry | None = entry
        self._due, self._port, self._converter = entry.due, port, converter
        self._own, self._run, self._earlier = agent.__dict__, runtime(agent), earlier
        #: tick of the value that the reader has
        self._have = 0

    def take(self, tick: Tick) -> Value | None:
        """Return what the agent has written since the last call."""
        due = self._due(tick.n if self._earlier else tick.n - 1)
        if due == self._have:
            return None
        self._have = due
        value = self._converter(self._own[self._port])
        return Value(value, self._run.source_tick)
