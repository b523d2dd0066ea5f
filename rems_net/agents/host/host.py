"""Host: one process that runs agents, in step with the clock.

Order inside a tick: inputs, robots, worlds, processes, outputs. A port written in an
earlier phase of tick n is read at n, any other port as of n - 1. So the results do not
depend on how agents are spread over hosts.
"""

import gc
from collections.abc import Mapping
from pathlib import Path
from threading import current_thread
from typing import Any, NoReturn

from rems_net.agents.about.mistakes import sum_up
from rems_net.agents.agent import Agent
from rems_net.agents.background.overdue import naming_overdue
from rems_net.agents.diagnosis import failure
from rems_net.agents.host.answers import Answers, topics
from rems_net.agents.host.guard import Guard
from rems_net.agents.host.handshake import (
    ask_in,
    introduction,
    say_farewell,
    wait_for_clock,
)
from rems_net.agents.host.inbox import Inbox
from rems_net.agents.host.leases import Leases
from rems_net.agents.host.membership import Orphaned, Released
from rems_net.agents.host.outlet import CROWD, Done, Outlets
from rems_net.agents.host.sources import Called, Others, is_open, open_outside, watched
from rems_net.agents.protocol.complaints import Complaints
from rems_net.agents.protocol.messages import Admission, Beat
from rems_net.agents.protocol.plan import read_plans
from rems_net.agents.protocol.values import adopt
from rems_net.agents.robot import Robot
from rems_net.agents.runtime import runtime
from rems_net.agents.world import gather
from rems_net.defdict import Schema
from rems_net.engine.engine import Engine
from rems_net.engine.inlet import Inlet
from rems_net.errors import uncoded
from rems_net.events import warn
from rems_net.router.gate.stops import ask_who_stopped
from rems_net.router.publisher import Watch
from rems_net.router.session import Session

#: The failure that a run learns of an agent on a machine that brought it.
ELSEWHERE = "failed on the machine that brought it, whose screen shows why"


class Host:
    """Runs agents until the roster no longer names this host.

    ticket: a number from the run that started it; 0 on another machine.
    free: it joins an open fabric, whose clock waits for no host, and joins again.
    brought: its plans came from another machine, which must learn nothing of this one.
    restarts: how often it was started again after a crash.
    """

    def __init__(
        self,
        session: Session,
        name: str,
        ticket: int = 0,
        *,
        free: bool = False,
        brought: bool = False,
        restarts: int = 0,
    ):
        self.session, self.name, self.ticket = session, name, ticket
        self.free, self.brought, self.restarts = free, brought, restarts
        #: whether it failed because its run is over, or because it was never admitted
        self.over = False
        #: the programs outside that may command the robots here
        self.leases = Leases()
        #: steps the agents; the host moves values in and out of it
        self.engine = Engine()
        self.engine.given = self.leases.given
        self.agents: dict[str, Agent] = self.engine.agents
        #: the newest tick that it has begun
        self.n = 0
        #: badge of this host, once the clock has admitted it
        self.badge = 0
        self._answers = Answers(self.engine, session.key, self.leases)
        self._complaints = Complaints()
        self.guard = Guard(session)
        self._done = Done(session)
        self.inbox = Inbox(
            session,
            name,
            self.guard,
            self._answers.answer,
            self._complaints,
            self.leases,
            self._done,
        )
        self.inbox.distant = not ticket
        self._stops = 0
        self._since: dict[str, int] = {}
        self._epoch = -1
        #: the liveliness token of a member
        self._seated: Watch | None = None

    def build(self, words: Mapping[str, Any]) -> None:
        """Make the agents where they live: from plans, or from plain data."""
        out, plans = Path(words["out"]), words.get("plans")
        if plans is None:
            folder = Path(words["folder"])
            plans = list(read_plans(words["agents"], folder, words["dt"]))
            adopt(words["values"])
        for plan in plans:
            self.engine.acting = plan.key
            plan.seed, plan.out = words["seed"], out
            agent = plan.build()
            for port, schema in words["taken"].get(plan.key, {}).items():
                agent.settle(port, Schema.from_wire(schema))
            agent.prepare()
            run = runtime(agent)
            run.in_step = agent.lockstep and not self.free
            run.restarts = self.restarts
            self.engine.add(agent, plan.sources, plan.again)
            self._since[agent.key] = plan.since
        gather(self.agents.values())
        runs = [runtime(agent) for agent in self.agents.values()]
        if not any(run.in_step for run in runs):
            self.inbox.rates = [run.every for run in runs]

    @property
    def inlets(self) -> list[Inlet]:
        """The Ins of its agents."""
        return self.engine.inlets

    @property
    def acting(self) -> str:
        """Key of the agent to blame for an exception now, or the host's own name."""
        return self.engine.acting or self.name

    def declare(self) -> None:
        """Publish, watch and answer; done before joining, so that nothing is missed."""
        session = self.session
        self.leases.declare(self.inlets)
        for inlet in self.inlets:
            open_outside(inlet, session.key, self.inbox, self.engine.visits)
        # Before publishers: Zenoh compares each subscriber with every publisher that is
        # here already, and ten thousand robots have thirty thousand.
        told = {session.key(inlet.key) for inlet in self.inlets if is_open(inlet)}
        keys = {k for inlet in self.inlets for k in watched(inlet, session.key)}
        self.inbox.hear(keys, told, crowd=len(self.agents) > CROWD)
        self._called = Called(self.engine, session, self.inbox)
        self._outlets = Outlets(self.agents, session)
        self._others = Others(self.agents, session.key, self.inbox)
        self._answers.declare(
            session, self.inbox, self.guard, self.inlets, self._outlets
        )
        self.inbox.watch()
        self.guard.watch()

    def join(self) -> None:
        """Ask the clock for admission. Raises FabricError with the clock's reason."""
        request = introduction(
            self.name,
            self.ticket,
            self.agents,
            self._since,
            self.inlets,
            self._outlets.all,
            stopped=self.guard.stopped,
            near=self.session.near,
        )
        if self.free:
            self._begin(wait_for_clock(self.session, request, self.inbox.look))
        else:
            self._begin(ask_in(self.session, request))

    def _begin(self, admission: Admission) -> None:
        """Begin a membership: the clock has admitted this host."""
        self.inbox.begin(admission)
        badge = self.badge = self._done.badge = admission.badge
        if self._seated is not None:
            self._seated.close()
        key = self.session.key("clock", "@member", str(badge))
        self._seated = self.session.present(key)
        self._outlets.begin(badge)
        self._called.badge = badge
        driven = [a for a in self.agents.values() if isinstance(a, Robot)]
        if any(not robot.lockstep for robot in driven):
            self.guard.start()

    def run(self, words: Mapping[str, Any]) -> str | None:
        """Build, open, join, step until released, close, and send a farewell.

        words: from `Hosts`: the agents, and their settings. Returns why it failed, if
        it did.
        """
        self.inbox.thread = current_thread()
        with naming_overdue(self.engine.stepped):
            return self._run(words)

    def _run(self, words: Mapping[str, Any]) -> str | None:
        failed: tuple[str, str] | None = None
        alone = False
        try:
            self._done.open()
            self.build(words)
            self.declare()
            for agent in self.agents.values():
                if isinstance(agent, Robot) and not agent.lockstep:
                    runtime(agent).guard = self.guard
            self.engine.open()
            for topic in topics(self.agents):
                self.session.present(self.session.key(topic, "@alive"))
            self.over = not self.restarts  # a refusal at the first start is no crash
            self.join()
            self.over = False
            # Freeze existing objects: to search them again costs a swarm a tenth.
            if not self.session.near:  # else the run does, for its whole process
                gc.freeze()
            self._go_on()
        except Released:
            pass
        except Orphaned as gone:
            alone = self.over = True
            if str(gone):
                failed = self.name, f"{uncoded(gone)} (R0522)"
                warn("failed", f"{uncoded(gone)}: this host ends")
        except (Exception, SystemExit) as error:
            self._done.settle()
            n = self.n if self.engine.acting else 0
            failed = failure(self.acting, error, n, self.agents)
        made, trouble = self.engine.close()
        self.guard.end()
        failed = failed or trouble
        engine, failing = self.engine, failed is not None
        agents = engine.agents.values()
        sum_up(agents, engine.inlets, engine.draws, self.name, failed=failing)
        self._complaints.total()
        # A clock of another machine may live although the parent of this host is gone.
        if not alone or not (self.ticket or self.guard.lost):
            badge = self.badge or self.ticket
            # no other program of this laptop would report it
            if failed and (self.brought or self.free or not badge):
                warn("failed", f"{failed[0]}: {failed[1]}", failed[0])
            told = failed
            if self.brought:  # an error may quote a file, and a file has a path
                made, told = [], failed and (failed[0], ELSEWHERE)
            say_farewell(self.session, badge, made, told)
        return failed and ": ".join(failed)

    def _go_on(self) -> None:
        """Do tick after tick; on an open fabric, of one clock after the other."""
        while True:
            try:
                self.step_on()
            except (Released, Orphaned) as gone:
                if not self.free or self.inbox.alone:
                    raise
                why = str(gone) or "the clock let this host go"
                warn("clock", f"{why}: joining again")
            self.start_anew()
            self.join()

    def start_anew(self) -> None:
        """Forget the clock that is gone, and so the commands that it brought."""
        self._epoch, self._stops, self.badge = -1, 0, 0
        self.engine.forget()
        self._outlets.forget()

    def step_on(self) -> NoReturn:
        """Do tick after tick. Raises Released or Orphaned at the last."""
        inbox, self.n = self.inbox, 0
        while True:
            beat = inbox.next_beat()
            self._serve_calls()
            if beat is not None:
                if inbox.membership.lateness:
                    warn("missed", f"{self.name} {inbox.membership.lateness}")
                self.step(beat)
            if inbox.membership.repeated:
                inbox.membership.repeated = False
                self._done.say(self.n)
            elif beat is not None and not self._outlets.closing:
                self._done.note(self.n)

    def step(self, beat: Beat) -> None:
        """Do a tick for every agent here that the roster names."""
        tick = beat.tick
        self.n = tick.n
        if tick.epoch != self._epoch:
            self._connect(tick.epoch)
        self.guard.take(beat.stops)
        # by the tick's number: at the same tick in all hosts
        if beat.stops != self._stops:
            self._stops = beat.stops
            self.engine.hold(bool(beat.stops % 2))
            if beat.stops % 2 and self.inbox.distant:
                ask_who_stopped(self.session, self.inbox.box.put)
        self.leases.look()
        self.engine.step(tick, self._outlets.publish)

    def _connect(self, epoch: int) -> None:
        roster = self.inbox.roster_of(epoch)
        self._epoch = roster.epoch
        self._others.packed = roster.schemas
        self.engine.connect(roster.agents, self._others)
        read = self._outlets.connect(roster, self.name)
        self.engine.visits.read = {port.rpartition("/")[0] for port in read}

    def _serve_calls(self) -> None:
        """Do the calls that came since the last tick; an error goes to the caller."""
        while self.inbox.calls:
            self._answers.call(self.inbox.calls.popleft())
