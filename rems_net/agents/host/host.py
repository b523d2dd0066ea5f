"""Host: one process that runs agents, in step with the clock.

Order inside a tick: inputs, robots, processes, outputs. A port written in an earlier
phase of tick n is read at n, anything else as of n - 1. So what a host computes does
not depend on how agents are spread over hosts.
"""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Mapping, Sequence
from threading import Event
from typing import Any

from rems_net.agents.agent import PHASES, Agent, Output
from rems_net.agents.diagnosis import failure, where
from rems_net.agents.host.answers import Answers, topics
from rems_net.agents.host.crew import Crew
from rems_net.agents.host.inbox import Inbox, Orphaned, Released
from rems_net.agents.host.inlet import Inlet
from rems_net.agents.host.outlet import Outlet
from rems_net.agents.protocol.limits import JOIN_TIME_EACH
from rems_net.agents.protocol.plan import Plan
from rems_net.agents.protocol.roster import Entry, Roster
from rems_net.agents.robot import Robot
from rems_net.agents.tick import Tick
from rems_net.defdict import Schema
from rems_net.errors import FabricError
from rems_net.router.find import machine
from rems_net.router.message import pack, read
from rems_net.router.session import Session

#: how often a clock that does not answer is asked to be let in
TRIES = 20


class Host:
    """Runs agents until the roster no longer names this host."""

    def __init__(self, session: Session, name: str):
        self.session, self.name = session, name
        self.agents: dict[str, Agent] = {}
        #: for each agent key, what its Ins are connected to
        self.sources: dict[str, Mapping[str, str]] = {}
        self._answers = Answers(self.agents, session.key)
        self.inbox = Inbox(session, name, self._answers.answer, self._stop, self.warn)
        self.inlets: list[Inlet] = []
        self.outlets: list[Outlet] = []
        #: the outlet whose value ends every tick of this host
        self.closing: Outlet | None = None
        self._since: dict[str, int] = {}
        self._epoch = -1
        self._schemas: dict[str, Schema] = {}
        self._crew = Crew(name)
        self._orphan = False
        self._pause = Event()

    # -- joining -----------------------------------------------------------------

    def build(self, plans: Sequence[Mapping[str, Any]]) -> None:
        """Make the agents from plain data, here where they live."""
        for plain in plans:
            self._crew.acting = f"{plain['kind']}/{plain['name']}"
            agent, sources = Plan.from_wire(plain)
            agent.prepare()
            self.agents[agent.key] = agent
            self.sources[agent.key] = sources
            self._since[agent.key] = plain["since"]
        if not any(agent.lockstep for agent in self.agents.values()):
            self.inbox.rates = [agent.every for agent in self.agents.values()]

    def declare(self) -> None:
        """Publish, watch and answer; done before joining, so that nothing is missed."""
        session = self.session
        box = self.inbox.box
        for agent in self.agents.values():
            for port in agent.ins():
                source = self.sources.get(agent.key, {}).get(port)
                self.inlets.append(Inlet(agent, port, source, session.key, self.warn))
        # Before what is put: Zenoh compares each subscriber with every publisher that
        # is here already, and ten thousand robots have thirty thousand.
        for key in sorted({key for inlet in self.inlets for key in inlet.watched()}):
            session.watch(key, box, remote=True)
        for agent in self.agents.values():
            for port, schema in agent.published().items():
                key = session.key(agent.key, port)
                publisher = session.publisher(
                    key,
                    f"{schema.name}@{schema.digest}",
                    block=agent.lockstep,
                    remote=True,
                )
                self.outlets.append(Outlet(agent, port, key, publisher))
        for topic in topics(self.agents):
            session.answer(session.key(topic, "**"), box, topic)
            session.answer(session.key(topic, "@schema"), box, topic)
            session.answer(session.key(topic, "@call", "*"), box, topic)
        # One main thread, one answer: at its first agent's key.
        first = next(iter(self.agents))
        session.answer_at_once(session.key(first, "@where"), where)
        self._choose_closing()
        self._answers.outlets = self.outlets
        self.inbox.watch()

    def declare_reports(self) -> None:
        """What tells the clock that a tick is done, and how it all ended."""
        key = self.session.key
        self._done = self.session.publisher(key("clock", "done"))
        self._reports = self.session.publisher(key("clock", "report"))

    def _choose_closing(self) -> None:
        """Let the last value of every tick say `done` too: a message less per tick.

        It must come after all others, at every tick. A host without such a value
        says `done` in words.
        """
        last = PHASES[max(PHASES.index(a.kind) for a in self.agents.values())]
        for outlet in self.outlets:
            agent = outlet.agent
            steady = agent.every == 1 and agent.lockstep and len(self.agents) == 1
            if agent.kind == last and steady:
                self.closing = outlet
        if self.closing:
            self.outlets.remove(self.closing)
            self.outlets.append(self.closing)

    def join(self) -> None:
        """Ask the clock to be let in. Raises FabricError with the clock's reason."""
        for agent in self.agents.values():
            self.session.present(self.session.key(agent.key, "@alive"))
        published = {o.digest: o.value.schema for o in self.outlets}
        request = {
            "host": self.name,
            "machine": machine(),
            "pid": os.getpid(),
            "closing": self.closing.key if self.closing else "",
            "agents": [entry.to_plain() for entry in self._entries()],
            "schemas": {d: s.to_wire() for d, s in published.items()},
        }
        payload, key = pack(request), self.session.key("clock", "@join")
        # It waits behind all that was declared: a swarm keeps a router busy.
        patience = 2.0 + len(self.agents) * JOIN_TIME_EACH
        for _ in range(TRIES):  # right after a reconnect a question may find nobody
            for mail in self.session.ask(key, payload, patience):
                answered = read(mail.payload)
                self._stop(answered["stopped"])
                self.inbox.begin(answered["first"])
                # Who watches already shall miss no tick; the answer came after it.
                for outlet in self.outlets:
                    outlet.publisher.look()
                return
            self._pause.wait(0.05)
        raise FabricError("no clock answers: no experiment runs on this fabric")

    def _entries(self) -> list[Entry]:
        outs: dict[str, dict[str, str]] = {key: {} for key in self.agents}
        reads: dict[str, list[str]] = {key: [] for key in self.agents}
        for outlet in self.outlets:
            outs[outlet.agent.key][outlet.port] = outlet.digest
        for inlet in self.inlets:
            if inlet.source:
                reads[inlet.agent.key].append(inlet.source)
        return [
            Entry(k, self.name, outs[k], reads[k], a.every, a.lockstep, self._since[k])
            for k, a in self.agents.items()
        ]

    # -- running -----------------------------------------------------------------

    def run(self, plans: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """Build, open, join, step until released, close. Returns the last report."""
        report: dict[str, Any] = {"host": self.name, "left": True}
        try:
            self.declare_reports()
            self.build(plans)
            self.declare()
            for agent in self.agents.values():
                self._crew.acting = agent.key
                agent.open()
            self._crew.acting = self.name
            self.join()
            # What is here now stays: looking through it again costs a swarm a tenth.
            gc.freeze()
            n = 0
            while True:
                tick = self.inbox.next_tick()
                self._serve_calls()
                if tick is not None:
                    self.step(tick)
                    n = tick.n
                again = self.inbox.repeated
                if again or (tick is not None and not self.closing):
                    self.inbox.repeated = False
                    self._done.put(pack([self.name, n]))
        except Released:
            pass
        except Orphaned as gone:
            self._orphan = True
            if str(gone):
                report["failed"] = {"agent": self.name, "cause": str(gone)}
                self.warn(f"{gone}: this host ends")
        except (Exception, SystemExit) as error:
            report["failed"] = failure(self._crew.acting, error)
        report["made"] = self._close(report)
        return report

    def leave(self, report: Mapping[str, Any]) -> None:
        """Tell the clock how it ended, and see to it that it was heard."""
        for _ in range(TRIES):
            self._reports.put(pack(report))
            # What is asked after the report is answered after it has come.
            if self._orphan or self.session.ask(self.session.key("clock", "@here")):
                return
            self._pause.wait(0.1)

    def step(self, tick: Tick) -> None:
        """Do tick `tick` for every agent here that the roster names."""
        if tick.epoch != self._epoch:
            self._connect(self.inbox.roster_of(tick.epoch))
        self._crew.step(tick, self.inbox)

    def _connect(self, roster: Roster) -> None:
        self._epoch = roster.epoch
        for inlet in self.inlets:
            inlet.connect(roster, self.agents, self.schema)
        read_outside = roster.read_outside(self.name)
        for outlet in self.outlets:
            outlet.want(f"{outlet.agent.key}/{outlet.port}" in read_outside)
        if self.closing:
            self.closing.want(True)
        self._crew.muster(roster, self.agents, self.inlets, self.outlets)

    def schema(self, roster: Roster, digest: str) -> Schema:
        """The schema of this digest, resolved once."""
        if digest not in self._schemas:
            self._schemas[digest] = Schema.from_wire(roster.schemas[digest])
        return self._schemas[digest]

    # -- being asked -------------------------------------------------------------

    def _stop(self, stopped: bool) -> None:
        """`rems/stop`: every robot here obeys its safe command until released."""
        for agent in self.agents.values():
            if isinstance(agent, Robot):
                agent.stopped = stopped

    def _serve_calls(self) -> None:
        """Do what was called for since the last tick; an error is the caller's."""
        while self.inbox.calls:
            self._answers.call(self.inbox.calls.popleft())

    def warn(self, sentence: str) -> None:
        """Say something to whoever started this host."""
        print(f"warning: {sentence}", file=sys.stderr, flush=True)

    # -- ending ------------------------------------------------------------------

    def _close(self, report: dict[str, Any]) -> list[str]:
        made: list[str] = []
        for agent in self.agents.values():
            try:
                agent.jobs.close()
                agent.close()
            except (Exception, SystemExit) as error:
                report.setdefault("failed", failure(agent.key, error))
            if isinstance(agent, Output):
                made += [str(path) for path in agent.made()]
        return made
