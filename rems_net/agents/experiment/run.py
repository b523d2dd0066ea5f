"""One run of an experiment: its router, its clock and its host processes."""

from __future__ import annotations

import gc
import os
import sys
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from secrets import randbits
from typing import Any

from rems_net.agents.agent import Agent
from rems_net.agents.clock.clock import Clock
from rems_net.agents.experiment.placement.borrowing import Borrowed, Borrowing
from rems_net.agents.experiment.placement.giving import Giving
from rems_net.agents.experiment.placement.offers import Offers
from rems_net.agents.experiment.process import HostProcess
from rems_net.agents.experiment.source.values import values
from rems_net.agents.protocol.limits import OVER, backoff
from rems_net.agents.protocol.plan import Plan
from rems_net.agents.protocol.terms import Terms
from rems_net.errors import AgentError, FabricError
from rems_net.recordings.recording import Recording
from rems_net.router import find
from rems_net.router.files import PROCESS, SESSION, check_files
from rems_net.router.gate.standing import check_member
from rems_net.router.session import Session
from rems_net.router.settings import Link

#: seconds a run may take to end, whatever happened
END = 2.0
#: seconds between looks at processes that nobody else watches
LOOK = 0.05


class Result(Recording):
    """What a run left behind: its recording, and how many ticks were made."""

    def __init__(self, ticks: int, folder: Path, files: Sequence[Path]):
        super().__init__(folder, files)
        self.ticks = ticks


class Show:
    """What a run tells while it runs; this one says warnings and prints, no more."""

    def begin(self, clock: Clock, ticks: int, endpoint: str) -> None:
        """The agents are being started; `clock` may be looked at from now on."""

    def say(self, source: str, line: str) -> None:
        """An agent printed a line."""
        print(f"[{source}] {line}", file=sys.stderr)

    def end(self) -> None:
        """The run is over."""


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
        *,
        native: bool = False,
    ):
        self.plans, self.agents, self.show = plans, agents, show
        self._native = native
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
            "agents": [plan.to_wire(self.agents[plan.key]) for plan in plans],
            "values": values(plans),
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
                self.say(
                    name,
                    f"{name} crashed ({death.removeprefix('was ')}); started again, "
                    f"{count} of {allowed[name]}",
                )
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

    def say(self, source: str, line: str) -> None:
        """Pass on what a process printed: one line at a time."""
        with self._lock:
            self.show.say(source, line)


class Run:
    """One run of an experiment: its router, its clock, and its hosts' processes.

    Of the hosts in the terms, those that `hosts` does not start join from other
    machines. out: the folder of what its outputs make.  offers: what machines bring.
    lent: the robots of an open fabric that it asks for.
    """

    def __init__(
        self,
        fabric: str,
        terms: Terms,
        hosts: Hosts,
        out: Path,
        offers: Offers,
        lent: Sequence[Borrowed] = (),
    ):
        self.fabric, self.terms, self.hosts = fabric, terms, hosts
        self.out, self._offers, self._lent = out, offers, lent
        self._ending = False

    def go(self) -> Result:
        """Make all ticks. Raises AgentError, after ending everything."""
        terms, show = self.terms, self.hosts.show
        check_files(SESSION + PROCESS * len(self.hosts.plans))
        session, note = self._session()
        try:
            clock = Clock(
                session,
                terms,
                look=self._look,
                lives=self.hosts.lives,
                start=self.hosts.start_again,
                tell=self._tell,
            )
            clock.open()
            show.begin(clock, terms.ticks, session.link.endpoint)
            try:
                giving = Giving(session, self._offers, self._tell)
                return self._tick(clock, session.link, giving)
            finally:
                show.end()
        finally:
            if note is not None:
                note.unlink(missing_ok=True)
            session.close()

    def _tick(self, clock: Clock, link: Link, giving: Giving) -> Result:
        """Start the hosts, make the ticks, and end the hosts whatever happened."""
        borrowing = Borrowing(
            clock.session, self._lent, lambda: clock.members.all, self._tell
        )
        try:
            self.hosts.start(link)
            clock.gather()
            borrowing.wait()
            giving.close()
            gc.freeze()  # what is here now stays; no tick waits for a look at it
            clock.run(self.terms.ticks)
        except BaseException as error:
            self._release(clock, patience=0.3)
            if isinstance(error, KeyboardInterrupt):
                error.add_note(self._interrupted(clock))
            raise
        finally:
            borrowing.close()
            gc.unfreeze()
        failure = self._release(clock, patience=END)
        if failure is not None:
            raise failure
        return Result(clock.tick.n, self.out, [Path(p) for p in clock.made()])

    def _interrupted(self, clock: Clock) -> str:
        """How far it came, and where what it made is."""
        folders = {str(plan.out) for some in self.hosts.plans.values() for plan in some}
        if not clock.done:
            return "Interrupted before the first tick."
        return (
            f"Interrupted after tick {clock.done} ({clock.done * clock.dt:.2f} s); "
            f"what the outputs had written is in {' and '.join(folders)}."
        )

    def _release(self, clock: Clock, patience: float) -> AgentError | None:
        self._ending = True
        try:
            return clock.release(END)
        finally:
            self.hosts.end(patience)

    def _session(self) -> tuple[Session, Path | None]:
        fabric = self.fabric
        if find.chosen() or self._lent:
            session = find.open_session(self._lent[0].home if self._lent else fabric)
            session = session.on(fabric)
            try:
                check_member(session)
            except FabricError:
                session.close()
                raise
            return session, None
        if self.terms.machines:
            self._tell(
                "warning: this run brings a router of its own, which only this laptop "
                "can reach; for others, first: rems join ADDRESS"
            )
        return find.serve(fabric)

    def _tell(self, sentence: str) -> None:
        self.hosts.say("clock", sentence)

    def _look(self) -> None:
        if not self._ending:
            self.hosts.look()
