"""Acts of no agent: calls of verbs, values that are put at an In, STOP and release.

Such as `fabric.robot("sim").reset()` and, of an engine, `engine.put(...)`: it is done
between two ticks. Outputs that record receive it; a rerun repeats it.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from fnmatch import fnmatchcase
from functools import wraps
from typing import Any

from rems_net.agents.about.outside import HOLD, PUT, Outside
from rems_net.agents.agent import Agent
from rems_net.agents.runtime import runtime
from rems_net.agents.verbs import perform, request, verbs_of
from rems_net.engine.inlet import Inlet
from rems_net.engine.recorded import MessageInlet
from rems_net.engine.source import Local


def _nobody(key: str, text: str) -> None:
    """Send nothing: there is no other process."""


class Visits:
    """Calls from outside, of the agents of one engine.

    inlets: all Ins of the engine.
    """

    def __init__(self, inlets: Sequence[Inlet]):
        self._inlets = inlets
        #: the newest tick
        self.n = 0
        #: whether agents act now: what is called then, an agent has called
        self.busy = False
        #: sends a call to other processes: the key of its agent, and a sentence
        self.send: Callable[[str, str], None] = _nobody
        #: agents whose ports other processes read, and so may record
        self.read: Set[str] = frozenset()
        #: the Ins that record
        self.recorders: list[MessageInlet] = []
        self._repeats: list[tuple[Agent, Outside]] = []

    def verbs(self, agent: Agent) -> dict[str, Callable[..., Any]]:
        """Return the verbs of an agent, by name, for a caller outside."""
        return {
            name: self._noting(agent, name, method)
            for name, method in verbs_of(agent).items()
        }

    def put(self, inlet: Inlet, value: Any, n: int, source_tick: int) -> None:
        """Note a value that was put at an In after tick n. On an open fabric, don't."""
        key = inlet.agent.key
        if inlet.run.in_step and (self.recorders or key in self.read):
            sent = [inlet.port, value, source_tick]
            text = Outside.of(n, PUT, sent, {}).text()
            self.receive(key, text)
            if key in self.read:
                self.send(key, text)

    def _noting(
        self, agent: Agent, name: str, method: Callable[..., Any]
    ) -> Callable[..., Any]:
        @wraps(method)
        def noting(*args: Any, **kwargs: Any) -> Any:
            if self.busy:
                return method(*args, **kwargs)
            self._note(agent, name, args, kwargs)
            self.busy = True
            try:
                return method(*args, **kwargs)
            finally:
                self.busy = False

        return noting

    def _note(
        self, agent: Agent, name: str, args: Sequence[Any], kwargs: Mapping[str, Any]
    ) -> None:
        """Pass a call on to outputs, and keep for readers what it may change."""
        for inlet in self._inlets:
            for source in inlet.sources:
                if isinstance(source, Local) and source.own is agent.__dict__:
                    source.keep(self.n + 1)
        if self.recorders or self.send is not _nobody:
            text = Outside.of(self.n, name, args, kwargs).text()
            self.receive(agent.key, text)
            self.send(agent.key, text)

    def receive(self, key: str, text: str, badge: int | None = None) -> None:
        """Pass a call on to the outputs here. badge: of the process that sent it."""
        for inlet in self.recorders:
            what = "/".join((inlet.source or "").split("/")[:2])
            if fnmatchcase(key, what):
                inlet.messages.called.append((key, text, badge))

    def plan(self, agent: Agent, rows: Iterable[Sequence[Any]]) -> None:
        """Repeat these calls of a recording: rows of `Outside`, in their order."""
        self._repeats += [(agent, Outside(*row)) for row in rows]
        self._repeats.sort(key=lambda pair: pair[1].n)

    def begin(self, n: int) -> None:
        """Begin tick n: repeat the calls that were done before it."""
        while self._repeats and self._repeats[0][1].n < n:
            agent, one = self._repeats.pop(0)
            if one.verb == HOLD:
                runtime(agent).stopped = bool(one.args[0])
            elif one.verb == PUT:
                port, values, source_tick = one.args
                for inlet in self._inlets:
                    mine = inlet.agent is agent and inlet.port == port
                    if mine and inlet.source is None:
                        inlet.put(values, source_tick)
            else:  # an error went to its caller then
                perform(self.verbs(agent), one.verb, request((*one.args,), one.kwargs))
        self.n, self.busy = n, True

    def end(self) -> None:
        """End a tick."""
        self.busy = False
