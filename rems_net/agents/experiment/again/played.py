"""Played: an agent that gives its recorded values, at the ticks of the recording."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, ClassVar

from rems_net.agents.agent import Agent
from rems_net.agents.ports import Out
from rems_net.agents.protocol.plan import Plan
from rems_net.agents.tick import Tick
from rems_net.defdict import DefDict, cdr
from rems_net.recordings.mcap.reader import McapFile


class Played(Agent):
    """An agent of any kind that gives the values of a recording.

    A subclass has the Outs of what it plays. Before the first recorded value it has
    the default.
    """

    recording: ClassVar[McapFile]

    def __init__(self, name: str = "", **common: Any) -> None:
        common |= {"options": {}}
        for slot in ("parameters", "initial"):
            common.pop(slot, None)
        super().__init__(name, **common)

    def open(self) -> None:
        """Begin at the first recorded value."""
        self._values = {port: self._of(port) for port in self.outs()}
        self._next = {port: next(values) for port, values in self._values.items()}

    def _of(self, port: str) -> Iterator[tuple[int, DefDict | None]]:
        """Yield time [ns] and value of a port; at last a time that never comes."""
        key = f"{self.key}/{port}"
        decode = cdr(self.recording.schemas[key]).decode
        for times, messages in self.recording.messages(key):
            yield from zip(times, map(decode, messages), strict=True)
        yield 1 << 63, None

    def step(self, tick: Tick) -> None:
        """Give the newest values that were recorded until now."""
        for port in self._next:
            value: DefDict | None = None
            while self._next[port][0] <= round(tick.t * 1e9):
                value = self._next[port][1]
                self._next[port] = next(self._values[port])
            if value is not None:
                setattr(self, port, value)


def played(plan: Plan, file: McapFile) -> Plan:
    """Return the plan of what plays the recording of an agent."""
    ports = {
        key.rpartition("/")[2]: Out(schema)
        for key, schema in file.schemas.items()
        if key.rpartition("/")[0] == plan.key
    }
    about = {"kind": plan.kind, "recording": file}
    cls = type("Played", (Played,), about | ports)
    return replace(plan, classes=[cls], sources={}, options={})
