"""Host: one process that runs agents, in step with the clock.

Order inside a tick: inputs, robots, processes, outputs. A port written in an earlier
phase of tick n is read at n, anything else as of n - 1. So what a host computes does
not depend on how agents are spread over hosts.
"""

from __future__ import annotations

import gc
import os
import platform
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from threading import Event
from typing import Any

from rems_net.agents.agent import PHASES, Agent, Output
from rems_net.agents.answers import answer, call, topics
from rems_net.agents.blame import blame, where
from rems_net.agents.letters import Letters, Orphaned, Released
from rems_net.agents.mail import Inlet, Outlet
from rems_net.agents.members import JOIN_TIME_EACH
from rems_net.agents.plan import Plan
from rems_net.agents.robot import Driver, Robot
from rems_net.agents.roster import Entry, Roster
from rems_net.agents.tick import Tick
from rems_net.defdict import Schema
from rems_net.errors import FabricError
from rems_net.router.message import pack, read
from rems_net.router.session import Session, pack_stamp

#: how often a clock that does not answer is asked to be let in
TRIES = 20


@dataclass(slots=True)
class Phase:
    """The agents of one kind, in the order of their keys, with their ports."""

    inlets: list[Inlet]
    steps: list[Callable[[Tick], None]]
    outlets: list[Outlet]


class Host:
    """Runs agents until the roster no longer names this host."""

    def __init__(self, session: Session, name: str):
        self.session, self.name = session, name
        self.agents: dict[str, Agent] = {}
        #: for each agent key, what its Ins are connected to
        self.sources: dict[str, Mapping[str, str]] = {}
        self.letters = Letters(
            session, name, partial(answer, host=self), self._stop, self.warn
        )
        self.inlets: list[Inlet] = []
        self.outlets: list[Outlet] = []
        #: the outlet whose value ends every tick of this host
        self.closing: Outlet | None = None
        self._since: dict[str, int] = {}
        self._epoch = -1
        self._schemas: dict[str, Schema] = {}
        self._phases: list[Phase] = []
        self._orphan = False
        self._pause = Event()
        #: what would be to blame for an exception now
        self._acting = name

    # -- joining -----------------------------------------------------------------

    def build(self, plans: Sequence[Mapping[str, Any]]) -> None:
        """Make the agents from plain data, here where they live."""
        for plain in plans:
            self._acting = f"{plain['kind']}/{plain['name']}"
            agent, sources = Plan.from_wire(plain)
            agent.prepare()
            self.agents[agent.key] = agent
            self.sources[agent.key] = sources
            self._since[agent.key] = plain["since"]
        if not any(agent.lockstep for agent in self.agents.values()):
            self.letters.rates = [agent.every for agent in self.agents.values()]

    def declare(self) -> None:
        """Publish, watch and answer; done before joining, so that nothing is missed."""
        session = self.session
        box = self.letters.box
        for agent in self.agents.values():
            for port in agent.ins():
                source = self.sources.get(agent.key, {}).get(port)
                self.inlets.append(Inlet(self, agent, port, source))
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
        self.letters.watch()

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
            "machine": platform.node(),
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
                self.letters.begin(answered["first"])
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
                self._acting = agent.key
                agent.open()
            self._acting = self.name
            self.join()
            # What is here now stays: looking through it again costs a swarm a tenth.
            gc.freeze()
            n = 0
            while True:
                tick = self.letters.next_tick()
                self._serve_calls()
                if tick is not None:
                    self.step(tick)
                    n = tick.n
                again = self.letters.repeated
                if again or (tick is not None and not self.closing):
                    self.letters.repeated = False
                    self._done.put(pack([self.name, n]))
        except Released:
            pass
        except Orphaned as gone:
            self._orphan = True
            if str(gone):
                report["failed"] = {"agent": self.name, "cause": str(gone)}
                self.warn(f"{gone}: this host ends")
        except (Exception, SystemExit) as error:
            report["failed"] = blame(self._acting, error)
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
            self._connect(self.letters.roster_of(tick.epoch))
        stamp = pack_stamp(tick.n, tick.t)
        for phase in self._phases:
            for inlet in phase.inlets:
                if not tick.n % inlet.agent.every:
                    inlet.fill(tick)
            for step in phase.steps:
                step(tick)
            for outlet in phase.outlets:
                if not tick.n % outlet.agent.every:
                    outlet.publish(tick.n, stamp)

    def _step_one(self, agent: Agent, tick: Tick) -> None:
        if tick.n % agent.every:
            return
        self._acting = agent.key
        agent.begin(tick)
        agent.step(agent.tick)
        self._acting = self.name

    def _step_many(
        self, robots: list[Driver], step: Callable[[Tick], None], tick: Tick
    ) -> None:
        if tick.n % robots[0].every:
            return
        self._acting = f"{robots[0].key} and {len(robots) - 1} more"
        for robot in robots:
            robot.begin(tick)
        step(robots[0].tick)
        self._acting = self.name

    def _steps(self, agents: list[Agent]) -> list[Callable[[Tick], None]]:
        """What steps these agents; robots that are a swarm to their driver at once."""
        steps: list[Callable[[Tick], None]] = []
        swarms: dict[object, list[Driver]] = {}
        for agent in agents:
            if isinstance(agent, Driver):
                swarms.setdefault(agent.likeness(), []).append(agent)
            else:
                steps.append(partial(self._step_one, agent))
        for robots in swarms.values():
            together = type(robots[0]).swarm(robots) if len(robots) > 1 else None
            if together is not None:
                steps.append(partial(self._step_many, robots, together))
            else:
                steps += [partial(self._step_one, robot) for robot in robots]
        return steps

    def _connect(self, roster: Roster) -> None:
        self._epoch = roster.epoch
        for inlet in self.inlets:
            inlet.connect(roster)
        read_outside = roster.read_outside(self.name)
        for outlet in self.outlets:
            outlet.want(f"{outlet.agent.key}/{outlet.port}" in read_outside)
        if self.closing:
            self.closing.want(True)
        self._phases = []
        here = sorted(k for k in self.agents if k in roster.agents)
        for kind in PHASES:
            agents = [self.agents[k] for k in here if self.agents[k].kind == kind]
            if agents:
                keys = {a.key for a in agents}
                inlets = [i for i in self.inlets if i.agent.key in keys]
                outlets = [o for o in self.outlets if o.agent.key in keys]
                self._phases.append(Phase(inlets, self._steps(agents), outlets))

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
        while self.letters.calls:
            call(self.letters.calls.popleft(), self)

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
                report.setdefault("failed", blame(agent.key, error))
            if isinstance(agent, Output):
                made += [str(path) for path in agent.made()]
        return made
