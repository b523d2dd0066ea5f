"""Hosts: the processes that a run, or a machine, starts for its agents."""

import os
import sys
import threading
from collections.abc import Mapping, Sequence
from secrets import randbits
from typing import Any

from rems_net.agents.agent import Agent
from rems_net.agents.experiment.process import HostProcess
from rems_net.agents.experiment.show import Show
from rems_net.agents.experiment.source.values import values
from rems_net.agents.protocol.limits import OVER, backoff
from rems_net.agents.protocol.plan import Plan, written
from rems_net.errors import AgentError
from rems_net.events import Event
from rems_net.router.files import PROCESS, check_files
from rems_net.router.settings import Link

#: seconds a run may take to end, whatever happened
END = 2.0
#: seconds between looks at processes that nobody else watches
LOOK = 0.05


def restarts(plans: Mapping[str, Sequence[Plan]]) -> dict[str, int]:
    """How often each host may be started again: as its agents say, the most of them."""
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
        self.processes: dict[str, HostProcess] = {}
        #: what each proves itself with to the clock
        self.tickets = {name: 1 + randbits(62) for name in plans}
        self._dead: dict[str, int] = {}
        #: what each was started with
        self._specs: dict[str, dict[str, Any]] = {}
        self._lock = threading.Lock()

    def start(self, link: Link, *, own: bool = True, free: bool = False) -> None:
        """Start one process for each host. own: the clock is in this process, too.

        free: they come to an open fabric, whose clock waits for nobody.

        Raises FabricError for too few files.
        """
        check_files(PROCESS * len(self.plans))
        for name in self.plans:
            self._specs[name] = {
                "endpoint": link.endpoint,
                "fabric": link.fabric,
                "user": link.user,
                "password": link.password,
                "host": name,
                "free": free,
                "brought": False,
                "restarts": 0,
                "ticket": self.tickets[name] if own else 0,
                # bytes, since a folder's name need not be UTF-8
                "path": [os.fsencode(entry) for entry in sys.path],
                **self.words(name),
            }
            self._start(name)

    def _start(self, name: str) -> None:
        self.processes[name] = HostProcess(name, self.say, native=self._native)
        self.processes[name].start(self._specs[name])

    def start_again(self, name: str) -> None:
        """Start the process of a host that crashed; of another machine's, nothing."""
        crashed = self.processes.get(name)
        if crashed is not None:
            crashed.kill()
            crashed.end()
            self._dead.pop(name, None)
            self._specs[name]["restarts"] += 1
            self._start(name)

    def words(self, name: str) -> dict[str, Any]:
        """What a host is told of its agents, and of the script that they are from."""
        plans = self.plans[name]
        return {
            "argv": [os.fsencode(word) for word in sys.argv],
            "values": values(plans),
            "folder": str(plans[0].folder),
            "out": str(plans[0].out),
            **written(plans, self.agents, self._dt),
        }

    def look(self) -> None:
        """Blame the first process that died, with what the system says of its death.

        Raises AgentError, once for each.
        """
        for name, process in self.processes.items():
            if death := process.death():
                self._dead[name] = self._dead.get(name, 0) + 1
                # At the first look its own last words may still be on their way.
                if self._dead[name] == 2:
                    raise AgentError(name, death)

    def wait(self) -> None:
        """Wait until every process has ended by itself; start again what crashed.

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
                        raise AgentError(name, death)
                    continue
                count += 1
                text = (
                    f"{name} crashed ({death.removeprefix('was ')}); started again, "
                    f"{count} of {allowed[name]}"
                )
                self.say(name, Event("info", 0, name, "crashed", text))
                pause.wait(backoff(count))
                self.start_again(name)
            pause.wait(LOOK)

    def lives(self, name: str) -> bool:
        """Whether the process of this host runs: seen on the fabric or not."""
        return name in self.processes and self.processes[name].death() is None

    def leave(self) -> None:
        """Let every process close its agents and say farewell, then end it."""
        for process in self.processes.values():
            process.leave()
        self.end(END)

    def end(self, patience: float) -> None:
        """Wait for their ends, for `patience` seconds in all, then make them."""
        timer = threading.Timer(patience, self._kill)
        timer.start()
        for process in self.processes.values():
            process.end()
        timer.cancel()

    def _kill(self) -> None:
        for process in self.processes.values():
            process.kill()

    def say(self, source: str, event: Event) -> None:
        """Pass on what a process reports: one event at a time."""
        with self._lock:
            self.show.say(source, event)
