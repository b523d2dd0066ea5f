"""Host: one process that runs agents, in step with the clock.

Order inside a tick: inputs, robots, processes, outputs. A port written in an earlier
phase of tick n is read at n, anything else as of n - 1. So what a host computes does
not depend on how agents are spread over hosts.
"""

from __future__ import annotations

import os
import platform
import sys
import traceback
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rems_net.agents.agent import PHASES, Agent, Output
from rems_net.agents.answers import answer
from rems_net.agents.mail import Inlet, Outlet
from rems_net.agents.plan import Plan
from rems_net.agents.roster import Entry, Roster
from rems_net.agents.tick import Tick
from rems_net.defdict import Schema
from rems_net.errors import AgentError, RemsError
from rems_net.router.message import pack, read
from rems_net.router.session import Mail, Mailbox, Question, Session, pack_stamp

#: seconds a value may be late before it is asked for by its key
PATIENCE = 0.25


class Released(Exception):  # noqa: N818 - not an error: the clock let this host go
    """The roster no longer names this host."""


class Orphaned(Exception):  # noqa: N818 - not an error of this host
    """Whoever started this host is gone."""


class Host:
    """Runs agents until the roster no longer names this host."""

    def __init__(self, session: Session, name: str):
        self.session, self.name = session, name
        self.agents: dict[str, Agent] = {}
        #: for each agent key, what its Ins are connected to
        self.sources: dict[str, Mapping[str, str]] = {}
        self.box = Mailbox()
        self.roster: Roster | None = None
        #: free-running values, by full key
        self.latest: dict[str, Mail] = {}
        self._stamped: dict[str, deque[tuple[int, bytes]]] = {}
        self._ticks: deque[Tick] = deque()
        self._rosters: dict[int, Roster] = {}
        self._schemas: dict[str, Schema] = {}
        self._tick_key = session.key("clock", "tick")
        self._roster_key = session.key("clock", "roster")
        self.inlets: list[Inlet] = []
        self.outlets: list[Outlet] = []
        self._phases: list[tuple[list[Inlet], list[Agent], list[Outlet]]] = []
        #: the outlet whose value ends every tick of this host
        self.closing: Outlet | None = None
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

    def declare(self) -> None:
        """Publish, watch and answer; done before joining, so that nothing is missed."""
        session = self.session
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
            for port in agent.ins():
                source = self.sources.get(agent.key, {}).get(port)
                self.inlets.append(Inlet(self, agent, port, source))
            session.answer(session.key(agent.key, "**"), self.box)
            session.answer(session.key(agent.key, "@schema"), self.box)
        for key in self._wanted_keys():
            session.watch(key, self.box, remote=True)
        self._choose_closing()
        session.watch(self._tick_key, self.box)
        session.watch(self._roster_key, self.box)

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
        last = max(PHASES.index(a.kind) for a in self.agents.values())
        for outlet in self.outlets:
            agent = outlet.agent
            if agent.kind == PHASES[last] and agent.every == 1 and agent.lockstep:
                self.closing = outlet
        if self.closing:
            self.outlets.remove(self.closing)
            self.outlets.append(self.closing)

    def _wanted_keys(self) -> set[str]:
        keys = set()
        for inlet in self.inlets:
            if inlet.source is None:
                keys.add(inlet.key)
            else:
                port = "" if inlet.source.count("/") == 2 else "/*"
                keys.add(self.session.key(inlet.source) + port)
                if inlet.agent.kind == "robot":
                    keys.add(inlet.key)  # to tell a program that commands in vain
        return keys

    def join(self) -> None:
        """Ask the clock to be let in. Raises FabricError with the clock's reason."""
        for agent in self.agents.values():
            self.session.present(self.session.key(agent.key, "@alive"))
        schemas = {o.digest: o.value.schema.to_wire() for o in self.outlets}
        request = {
            "host": self.name,
            "machine": platform.node(),
            "pid": os.getpid(),
            "closing": self.closing.key if self.closing else "",
            "agents": [self._entry(a).to_plain() for a in self.agents.values()],
            "schemas": schemas,
        }
        payload = pack(request)
        for _ in range(20):  # right after a reconnect a question may find nobody
            if self.session.ask(self.session.key("clock", "@join"), payload):
                return
        raise RemsError("The clock does not answer.")

    def _entry(self, agent: Agent) -> Entry:
        outs = {o.port: o.digest for o in self.outlets if o.agent is agent}
        reads = [i.source for i in self.inlets if i.agent is agent and i.source]
        return Entry(agent.key, self.name, outs, reads, agent.every, agent.lockstep)

    # -- running -----------------------------------------------------------------

    def run(self, plans: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """Build, open, join, step until released, close. Returns the last report."""
        report: dict[str, Any] = {"host": self.name, "n": 0, "left": True}
        try:
            self.declare_reports()
            self.build(plans)
            self.declare()
            for agent in self.agents.values():
                self._acting = agent.key
                agent.open()
            self._acting = self.name
            self.join()
            lockstep = any(a.lockstep for a in self.agents.values())
            while True:
                tick = self._next_tick()
                self.step(tick)
                report["n"] = tick.n
                if lockstep and not self.closing:
                    self._done.put(pack([self.name, tick.n]))
        except (Released, Orphaned):
            pass
        except Exception as error:
            report["failed"] = self._blame(error)
        report["made"] = self._close(report)
        return report

    def leave(self, report: Mapping[str, Any]) -> None:
        """Tell the clock how it ended."""
        self._reports.put(pack(report))

    def step(self, tick: Tick) -> None:
        """Do tick `tick` for every agent here."""
        if self.roster is None or tick.epoch != self.roster.epoch:
            self._connect(self._roster_of(tick.epoch))
        stamp = pack_stamp(tick.n, tick.t)
        for inlets, agents, outlets in self._phases:
            for inlet in inlets:
                if not tick.n % inlet.agent.every:
                    inlet.fill(tick)
            for agent in agents:
                if not tick.n % agent.every:
                    self._acting = agent.key
                    agent.tick = (
                        tick
                        if agent.every == 1
                        else replace(tick, dt=tick.dt * agent.every)
                    )
                    agent.step(agent.tick)
            self._acting = self.name
            for outlet in outlets:
                if not tick.n % outlet.agent.every:
                    outlet.publish(tick.n, stamp)

    def _connect(self, roster: Roster) -> None:
        self.roster = roster
        for inlet in self.inlets:
            inlet.connect(roster)
        read = roster.read_outside(self.name)
        for outlet in self.outlets:
            outlet.wanted = f"{outlet.agent.key}/{outlet.port}" in read
        if self.closing:
            self.closing.wanted = True
        self._phases = []
        for kind in PHASES:
            agents = sorted(
                (a for a in self.agents.values() if a.kind == kind),
                key=lambda a: a.key,
            )
            if agents:
                inlets = [i for i in self.inlets if i.agent in agents]
                outlets = [o for o in self.outlets if o.agent in agents]
                self._phases.append((inlets, agents, outlets))

    def schema(self, roster: Roster, digest: str) -> Schema:
        """The schema of this digest, resolved once."""
        if digest not in self._schemas:
            self._schemas[digest] = Schema.from_wire(roster.schemas[digest])
        return self._schemas[digest]

    # -- mail --------------------------------------------------------------------

    def value(self, key: str, n: int, writer: Entry) -> bytes | None:
        """The payload that `key` had at tick n; None once its writer has left."""
        while True:
            for tick, payload in self._stamped.get(key, ()):
                if tick == n:
                    return payload
            if self.roster is not None and self._gone(writer):
                return None
            if not self._read(PATIENCE):
                self.session.ask_into(key, self.box)

    def _gone(self, writer: Entry) -> bool:
        newest = max(self._rosters, default=0)
        return newest > 0 and writer.key not in self._rosters[newest].agents

    def _next_tick(self) -> Tick:
        while not self._ticks:
            self._read(None)
        return self._ticks.popleft()

    def _roster_of(self, epoch: int) -> Roster:
        while epoch not in self._rosters:
            if not self._read(PATIENCE):
                self.session.ask_into(self._roster_key, self.box)
        roster = self._rosters[epoch]
        for old in [e for e in self._rosters if e < epoch]:
            del self._rosters[old]
        return roster

    def _read(self, timeout: float | None) -> bool:
        """File one letter; False when none came in time."""
        letter = self.box.get(timeout)
        if letter is None:
            return False
        if isinstance(letter, Mail):
            if letter.key == self._tick_key:
                self._ticks.append(Tick(**read(letter.payload)))
            elif letter.key == self._roster_key:
                self._file_roster(Roster.from_wire(letter.payload))
            else:
                self.latest[letter.key] = letter
                tick, _ = letter.stamp()
                if tick >= 0:
                    kept = self._stamped.setdefault(letter.key, deque(maxlen=3))
                    kept.append((tick, letter.payload))
        elif isinstance(letter, Question):
            answer(letter, self)
        elif isinstance(letter, Orphaned):
            raise letter
        return True

    def _file_roster(self, roster: Roster) -> None:
        self._rosters[roster.epoch] = roster
        if self.name not in roster.hosts():
            raise Released

    # -- ending ------------------------------------------------------------------

    def warn(self, sentence: str) -> None:
        """Say something to whoever started this host."""
        print(f"warning: {sentence}", file=sys.stderr, flush=True)

    def _close(self, report: dict[str, Any]) -> list[str]:
        made: list[str] = []
        for agent in self.agents.values():
            self._acting = agent.key
            try:
                agent.close()
            except Exception as error:
                report.setdefault("failed", self._blame(error))
            if isinstance(agent, Output):
                made += [str(path) for path in agent.made()]
        return made

    def _blame(self, error: Exception) -> dict[str, str]:
        if isinstance(error, AgentError):
            return {"agent": error.agent, "cause": error.cause}
        cause = str(error) if isinstance(error, RemsError) else _describe(error)
        return {"agent": self._acting, "cause": cause}


def _describe(error: Exception) -> str:
    """`ZeroDivisionError: division by zero (cart.py, line 12, in step)`."""
    where = ""
    for frame in traceback.extract_tb(error.__traceback__):
        name = Path(frame.filename).name
        where = f" ({name}, line {frame.lineno}, in {frame.name})"
    return f"{type(error).__name__}: {error}{where}"
