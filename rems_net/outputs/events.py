"""Events of a run that belong to a tick, found in what an output reads.

STOP and release, agents that join and leave, and calls of verbs by processes: these are
the same in every run of an experiment, in one process or in many. And calls of verbs
from outside, which a rerun repeats.
"""

from collections.abc import Iterator, Mapping, Sequence
from operator import is_not

from rems_net.agents.agent import Output
from rems_net.agents.ports import Messages
from rems_net.agents.runtime import runtime
from rems_net.agents.verbs import CALLS, Call, read_calls
from rems_net.defdict import cdr
from rems_net.recordings.mcap.log import CLOCK, INFO, RELEASED, STOPPED, WARN

#: level, key of the agent that the event is about, and a sentence
Row = tuple[int, str, str]


class Events:
    """Finds the events of each tick."""

    def __init__(self) -> None:
        self._stopped = False
        #: badges of the hosts of all agents, by key; None before the first tick
        self._agents: dict[str, int] | None = None
        self._seen: list[dict[str, int]] = []
        #: by port, the tick of the newest call that is known
        self._known: dict[str, int] = {}
        self._said: dict[str, bytes] = {}

    def of(self, output: Output, read: Sequence[Messages]) -> Iterator[Row]:
        """Yield the events of a tick. read: all that the output reads."""
        if (stopped := runtime(output).stopped) != self._stopped:
            self._stopped = stopped
            yield (WARN, CLOCK, STOPPED) if stopped else (INFO, CLOCK, RELEASED)
        # A new roster gives new objects: a crowd is looked through only then.
        seen = [some.agents for some in read]
        if len(seen) != len(self._seen) or any(map(is_not, seen, self._seen)):
            self._seen = seen
            now = {key: badge for some in read for key, badge in some.agents.items()}
            yield from _changes(self._agents, now)
            self._agents = now
        for some in read:
            yield from self._calls(some)
            yield from _outside(some)

    def _calls(self, messages: Messages) -> Iterator[Row]:
        """Yield the verbs that processes have called."""
        for key in messages.callers:
            said = messages.get(key, b"")
            if said in (b"", self._said.get(key)):
                continue
            self._said[key] = said
            known = self._known.get(key, -1)
            calls = read_calls(cdr(CALLS).decode(said)["calls"])
            for one in (one for one in calls if one.n > known):
                self._known[key] = one.n
                yield INFO, key.rpartition("/")[0], _shown(one)


def _outside(messages: Messages) -> Iterator[Row]:
    """Yield the calls from outside, of agents that take part."""
    agents, waiting = messages.agents, []
    for key, text, badge in messages.called:
        if key not in agents:
            waiting.append((key, text, badge))
        elif badge in (None, agents[key]):  # any program can put anything
            yield INFO, key, text
    messages.called[:] = waiting


def _changes(before: Mapping[str, int] | None, now: Mapping[str, int]) -> Iterator[Row]:
    if before is None:  # the first tick, at which all of them join
        return
    for key in sorted(before.keys() | now.keys()):
        if key not in before:
            yield INFO, key, "joined"
        elif key not in now:
            yield WARN, key, "left"
        elif before[key] != now[key]:
            yield WARN, key, "was started again"


def _shown(one: Call) -> str:
    given = [*map(repr, one.args), *(f"{k}={v!r}" for k, v in one.kwargs.items())]
    return f"called {one.robot}.{one.verb}({', '.join(given)})"
