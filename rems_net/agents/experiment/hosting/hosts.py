"""Hosts: the processes that a run, or a machine, starts for its agents."""

import os
import sys
import threading
from collections.abc import Mapping, Sequence
from dataclasses import replace
from secrets import randbits
from typing import TYPE_CHECKING, Any

from rems_net.agents.agent import Agent
from rems_net.agents.experiment.hosting.process import HostProcess
from rems_net.agents.experiment.show import Reports, Show
from rems_net.agents.experiment.source.values import values
from rems_net.agents.protocol.limits import OVER, backoff
from rems_net.agents.protocol.plan import HERE, Plan, taken, written
from rems_net.errors import AgentError, uncoded
from rems_net.events import Event
from rems_net.router.files import PROCESS, check_files
from rems_net.router.settings import Link

if TYPE_CHECKING:
    from rems_net.agents.experiment.hosting.thread import HostThread
    from rems_net.router.session import Session

#: s. A run ends within this time, also after errors.
END = 2.0
#: s. Time between two checks of processes that nothing else watches.
LOOK = 0.05


def restarts(plans: Mapping[str, Sequence[Plan]]) -> dict[str, int]:
    """Return how often each host may be started again: the maximum over its agents."""
    return {host: max(p.restart for p in some) for host, some in plans.items()}


class Hosts:
    """The host processes that this process has started."""

    def __init__(
        self,
        plans: Mapping[str, Sequence[Plan]],
        agents: Mapping[str, Agent],
        show: Show,
        dt: float,
        *,
        native: bool = False,
    ):
        self.plans, self.agents, self.show = plans, agents, show
        self._dt, self._native = dt, native
        self.processes: dict[str, HostProcess | HostThread] = {}
        #: the number by which each host proves to the clock that this run started it
        self.tickets = {name: 1 + randbits(62) for name in plans}
        self._dead: dict[str, int] = {}
        #: the spec that each host was started with
        self._specs: dict[str, dict[str, Any]] = {}
        self._lock = threading.Lock()
        #: for programs that look at the run, once it has a session
        self.reports: Reports | None = None
        #: the last STOP that was shown
        self._stop = ""
        self._failed: dict[str, str] = {}  # why, by host, as its process reported it

    def start(
        self,
        link: Link,
        *,
        clock: "Session | None" = None,
        free: bool = False,
    ) -> None:
        """Start each host: a process, or if the clock is here, a thread beside it.

        clock: the session of a clock in this process.
        free: the hosts join an open fabric, whose clock waits for no host.

        Raises FabricError for too few file handles.
        """
        check_files(PROCESS * len(self.plans))
        for name in self.plans:
            if clock is not None and name == HERE:
                self._start_here(clock)
                continue
            self._specs[name] = {
                "endpoint": link.endpoint,
                "fabric": link.fabric,
                "user": link.user,
                "password": link.password,
                "host": name,
                "free": free,
                "brought": False,
                "restarts": 0,
                "ticket": 0 if clock is None else self.tickets[name],
                # bytes, since a folder's name need not be UTF-8
                "path": [os.fsencode(entry) for entry in sys.path],
                **self.words(name),
            }
            self._start(name)

    def _start(self, name: str) -> None:
        self.processes[name] = HostProcess(name, self.say, native=self._native)
        self.processes[name].start(self._specs[name])

    def _start_here(self, clock: "Session") -> None:
        # Imported here: most runs have no use for the code of a host.
        from rems_net.agents.experiment.hosting.thread import HostThread

        plans = self.plans[HERE]
        self._specs[HERE] = {
            "free": False,
            "ticket": self.tickets[HERE],
            "plans": plans,
            "out": plans[0].out,
            "seed": plans[0].seed,
            "taken": taken(plans, self.agents),
        }
        self.processes[HERE] = HostThread(HERE, clock, self.say)
        self.processes[HERE].start(self._specs[HERE])

    def start_again(self, name: str) -> None:
        """Start a crashed host's process again; ignore a host of another machine."""
        crashed = self.processes.get(name)
        if crashed is not None:
            crashed.kill()
            crashed.end()
            self._dead.pop(name, None)
            self._specs[name]["restarts"] += 1
            self._start(name)

    def words(self, name: str) -> dict[str, Any]:
        """Return the plans of a host, and the arguments and values of its script."""
        plans = self.plans[name]
        return {
            "argv": [os.fsencode(word) for word in sys.argv],
            "values": values(plans),
            "folder": str(plans[0].folder),
            "out": str(plans[0].out),
            **written(plans, self.agents, self._dt),
        }

    def look(self) -> None:
        """Raise AgentError for the first process that died, with its exit status.

        Raises it once for each process.
        """
        for name, process in self.processes.items():
            if death := process.death():
                self._dead[name] = self._dead.get(name, 0) + 1
                # At the first look, its last lines may still be on their way.
                if self._dead[name] == 2:
                    raise AgentError(name, f"{death} (R0522)")

    def wait(self) -> None:
        """Wait until every process has ended by itself; start crashed ones again.

        Raises AgentError for one that failed, and is not to be started again.
        """
        allowed, pause = restarts(self.plans), threading.Event()
        left = list(self.processes)
        while left:
            for name in list(left):
                process, count = self.processes[name], self._specs[name]["restarts"]
                death = process.death()
                if death is None:
                    continue
                if process.status in (0, OVER) or count >= allowed[name]:
                    left.remove(name)
                    if process.status:
                        raise AgentError(name, self._reported(name, death))
                    continue
                count += 1
                why = uncoded(self._reported(name, death)).removeprefix("was ")
                text = (
                    f"{name} crashed ({why}); started again, {count} of {allowed[name]}"
                )
                self.say(name, Event("info", 0, name, "crashed", text))
                pause.wait(backoff(count))
                self.start_again(name)
            pause.wait(LOOK)

    def lives(self, name: str) -> bool:
        """Return whether the process of this host runs, seen on the fabric or not."""
        return name in self.processes and self.processes[name].death() is None

    def leave(self) -> None:
        """Let every process close its agents and send its farewell; then end it."""
        for process in self.processes.values():
            process.leave()
        self.end(END)

    def end(self, patience: float) -> None:
        """Wait at most `patience` seconds for all of them to end, then kill them."""
        timer = threading.Timer(patience, self._kill)
        timer.start()
        for process in self.processes.values():
            process.end()
        timer.cancel()

    def _kill(self) -> None:
        for process in self.processes.values():
            process.kill()

    def _reported(self, name: str, death: str) -> str:
        """Return why a process ended, as it has reported, or else how it ended."""
        self.processes[name].end()  # its last message may still be on its way
        said = self._failed.pop(name, "").removeprefix(f"{name}: ")
        return said or f"{death} (R0522)"

    def say(self, source: str, event: Event) -> None:
        """Pass on the reports of a process, one event at a time."""
        with self._lock:
            if event.kind == "failed":
                self._failed[source] = event.text
                if self._specs[source]["free"]:  # shown once, by wait()
                    return
            if event.kind == "stop":  # each process receives it
                if event.text == self._stop:
                    return
                self._stop = event.text
            # An agent `here` has no process of its own: people look for its key.
            here = source == HERE and event.agent
            self.show.say(event.agent if here else source, event)
            if self.reports is not None:
                self.reports.put(replace(event, agent=event.agent or source))
