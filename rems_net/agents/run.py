"""One run of an experiment: its router, its clock and its host processes."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from rems_net.agents.agent import Agent
from rems_net.agents.clock import Clock
from rems_net.agents.launch import HostProcess
from rems_net.agents.plan import Plan
from rems_net.errors import AgentError
from rems_net.router import find
from rems_net.router.session import Session
from rems_net.router.settings import Link

if TYPE_CHECKING:
    from rems_net.agents.experiment import Experiment

#: seconds a run may take to end, whatever happened
END = 2.0


@dataclass
class Result:
    """What a run left behind.

    ticks: made            files: written by the outputs
    lines: (agent's host, what it printed), in order
    """

    ticks: int = 0
    files: list[Path] = field(default_factory=list)


class Show:
    """What a run tells while it runs; this one says warnings and prints, no more."""

    def begin(self, clock: Clock, ticks: int, endpoint: str) -> None:
        """The agents are being started; `clock` may be looked at from now on."""

    def say(self, source: str, line: str) -> None:
        """An agent printed a line."""
        print(f"[{source}] {line}", file=sys.stderr)

    def end(self) -> None:
        """The run is over."""


class Run:
    """One run of an experiment: its router, clock and host processes."""

    def __init__(
        self,
        experiment: Experiment,
        agents: Mapping[str, Agent],
        folder: Path,
        pace: float,
        show: Show,
    ):
        self.experiment, self.agents, self.folder = experiment, agents, folder
        self.pace, self.show = pace, show
        self.hosts: dict[str, HostProcess] = {}
        self._dead: dict[str, int] = {}
        self._ending = False
        self._lock = threading.Lock()

    def go(self, ticks: int) -> Result:
        session, note = self._session()
        try:
            clock = Clock(
                session,
                dt=self.experiment.dt,
                pace=self.pace,
                expect=frozenset(self._by_host()),
                drop=self.experiment.on_failure == "drop",
                look=self._look,
                tell=lambda sentence: self._say("clock", sentence),
            )
            clock.open()
            self.show.begin(clock, ticks, session.link.endpoint)
            try:
                return self._tick(clock, ticks, session.link)
            finally:
                self.show.end()
        finally:
            if note is not None:
                note.unlink(missing_ok=True)
            session.close()

    def _tick(self, clock: Clock, ticks: int, link: Link) -> Result:
        """Start the hosts, make the ticks, and end the hosts whatever happened."""
        try:
            self._start(link)
            clock.gather()
            clock.run(ticks)
        except BaseException:
            self._release(clock, patience=0.3)
            raise
        failure = self._release(clock, patience=END)
        if failure is not None:
            raise failure
        return Result(clock.tick.n, [Path(p) for p in clock.made()])

    def _release(self, clock: Clock, patience: float) -> AgentError | None:
        self._ending = True
        try:
            return clock.release(END)
        finally:
            for host in self.hosts.values():
                host.end(patience)

    def _session(self) -> tuple[Session, Path | None]:
        fabric = self.experiment.fabric
        if os.environ.get(find.VARIABLE):
            return find.open_session(fabric), None
        return find.serve(fabric)

    def _by_host(self) -> dict[str, list[Plan]]:
        hosts: dict[str, list[Plan]] = {}
        for plan in self.experiment.plans.values():
            hosts.setdefault(plan.host, []).append(plan)
        return hosts

    def _start(self, link: Link) -> None:
        for name, plans in self._by_host().items():
            host = HostProcess(name, self._say)
            self.hosts[name] = host
            host.start(
                {
                    "endpoint": link.endpoint,
                    "fabric": link.fabric,
                    "host": name,
                    "path": sys.path,
                    "agents": [plan.to_wire(self.agents[plan.key]) for plan in plans],
                }
            )

    def _look(self) -> None:
        """Blame the first process that died, with what the system says of its death."""
        if self._ending:
            return
        for name, host in self.hosts.items():
            if death := host.death():
                self._dead[name] = self._dead.get(name, 0) + 1
                # At the first look its own last words may still be on their way.
                if self._dead[name] == 2:
                    raise AgentError(name, death)

    def _say(self, source: str, line: str) -> None:
        with self._lock:
            self.show.say(source, line)
