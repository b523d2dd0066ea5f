"""Clock: the only source of time on a fabric, and the keeper of its roster."""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from rems_net.agents.members import JOIN_TIME_EACH, Member, Members
from rems_net.agents.sight import Sight
from rems_net.agents.tick import AHEAD, Tick
from rems_net.agents.turns import Turns
from rems_net.agents.verbs import perform, verbs_of
from rems_net.errors import AgentError, FabricError, RemsError, WireError
from rems_net.router.message import pack, read
from rems_net.router.session import (
    Mail,
    Mailbox,
    Presence,
    Question,
    Session,
    pack_stamp,
)

#: seconds the hosts have to join, from the last one that did
JOIN_TIME = 30.0
#: seconds before a tick is due that are slept: a sleep ends nearer to its time than
#: a wait for mail does
NAP = 0.002
#: seconds between looks at what is not mail: dead processes, a held tick
LOOK = 0.05
#: seconds a tick may take before it is said again: it, or an answer, may be lost
PATIENCE = 0.25
#: seconds that nothing may be done in, when a run has failed
LAST = 2.0
#: seconds after which a held tick is told, and again
HELD = 1.0


class Clock:
    """Makes ticks of `dt` seconds, and says who is there.

    pace: real-time factor, or 0.0 for as fast as the slowest member.
    expect: names of the hosts that must have joined before the first tick.
    drop: whether a member that fails or dies is dropped, or ends the run.
    look: called every now and then while waiting; raises AgentError to end the run.
    lives: whether the process of this host is known to live, seen or not.
    tell: called with a sentence about a held tick, a member dropped.
    """

    def __init__(
        self,
        session: Session,
        *,
        dt: float,
        pace: float = 0.0,
        expect: frozenset[str] = frozenset(),
        drop: bool = False,
        look: Callable[[], None] = lambda: None,
        lives: Callable[[str], bool] = lambda host: False,
        tell: Callable[[str], None] = lambda sentence: None,
    ):
        self.session, self.dt = session, dt
        #: when ticks come; its verbs are the clock's
        self.turns = Turns(dt, pace)
        self.expect, self.drop = expect, drop
        self.look, self.tell = look, tell
        self.members = Members()
        self.tick = Tick(0, 0.0, dt, pace)
        self.started = 0.0
        self.stopped = False
        self._box = Mailbox()
        #: the newest tick that everybody has done, and who has not done the next
        self.done = 0
        self._pending: set[str] = set()
        #: those that may have to be said again
        self._said: deque[Tick] = deque(maxlen=AHEAD)
        self._sight = Sight(
            self.members, lambda host: lives(host) or not session.connected
        )

    # -- opening -----------------------------------------------------------------

    def open(self) -> None:
        """Become this fabric's clock. Raises FabricError if it has one already."""
        session, key = self.session, self.session.key
        if session.who(key("clock", "@alive")):
            raise self._taken()
        session.present(key("clock", "@alive"))
        self._done_key, self._report_key = key("clock", "done"), key("clock", "report")
        self._stop_key = key("stop")
        for watched in (self._done_key, self._report_key, self._stop_key):
            session.watch(watched, self._box)
        session.watch_presence(key("*", "*", "@alive"), self._box)
        session.answer(key("clock", "@join"), self._box)
        session.answer_at_once(key("clock", "@here"), str)
        # Of two that start in the same instant, one sees the other at least.
        if len(session.ask(key("clock", "@here"))) > 1:
            raise self._taken()
        session.answer(key("clock", "@call", "*"), self._box)
        session.answer(key("clock", "*"), self._box)
        self._ticks = session.publisher(key("clock", "tick"))
        self._rosters = session.publisher(key("clock", "roster"))

    def _taken(self) -> FabricError:
        fabric, endpoint = self.session.fabric, self.session.link.endpoint
        return FabricError(
            f"The fabric {fabric!r} has a clock already: another experiment runs at "
            f"{endpoint}. Wait for its end, or use a router of your own (unset "
            "REMS_ROUTER)."
        )

    def gather(self, agents: int = 1) -> None:
        """Wait until every expected host has joined, with so many agents in all.

        Raises AgentError for one that fails or does not come.
        """
        patience = JOIN_TIME + agents * JOIN_TIME_EACH
        deadline = time.monotonic() + patience
        while missing := self.expect - self.members.all.keys():
            joined = len(self.members.all)
            self._read(LOOK)
            if len(self.members.all) > joined:
                deadline = time.monotonic() + patience
            if time.monotonic() > deadline:
                raise AgentError(
                    min(missing), f"did not join within {patience:.0f} s of the last"
                )
        self.started = time.monotonic()

    # -- ticking -----------------------------------------------------------------

    def run(self, ticks: int) -> None:
        """Make this many ticks, and wait until every member has done the last.

        At a pace, tick n is due at start + n dt / pace: absolute, so never drifting;
        and when every member has done the one before. Fast, it is due when every member
        has done the one AHEAD ticks before. Where the run goes on without who dies,
        fast is one by one, too: a killed process takes with it what it has not sent
        yet, and nobody would know at which tick it was.
        Raises AgentError when a member fails or dies and is not to be dropped.
        """
        turns = self.turns
        turns.set(turns.factor)
        for _ in range(ticks):
            n = self.tick.n + 1
            self._await_done(n - (1 if turns.factor or self.drop else AHEAD))
            self._await_turn()
            if turns.ended:
                break
            if self.members.update(n):
                self._rosters.put(self.members.roster.to_wire())
                self._pending = self.members.late(self.done + 1)
            epoch = self.members.roster.epoch
            self.tick = Tick(n, n * self.dt, self.dt, turns.factor, epoch)
            self._said.append(self.tick)
            self._put_tick(self.tick)
            turns.take(n)
        self._await_done(self.tick.n)

    def _put_tick(self, tick: Tick) -> None:
        self._ticks.put(pack(tick.to_plain()), pack_stamp(tick.n, tick.t))

    def _await_turn(self) -> None:
        """Wait while paused, then until the next tick is due."""
        while self.turns.held or self.turns.left() > 0:
            if self.turns.held:
                self._await_done(self.tick.n)
                self._read(LOOK)
            elif (left := self.turns.left()) > NAP:
                self._read(min(left - NAP / 2, LOOK))
            elif left > 0:
                time.sleep(left)

    def _await_done(self, n: int) -> None:
        """Wait until every member has done tick n, and so all before."""
        begun = said = told = time.monotonic()
        while self._advance(n) < n:
            self._read(LOOK)
            now = time.monotonic()
            if now - said > PATIENCE:
                said = now
                self._ask_late()
            if now - told > HELD and self._advance(n) < n:
                told = now
                who = self.members.blamed(self._pending)
                held = f"tick {self.done + 1} is held by {who}"
                self.tell(f"{held} for {now - begun:.1f} s")

    def _advance(self, n: int) -> int:
        """The newest tick that everybody has done, up to `n`."""
        while not self._pending and self.done < n:
            self.done += 1
            self._pending = self.members.late(self.done + 1)
        return self.done

    def _ask_late(self) -> None:
        """Say what is not done again, and ask where the late ones stand.

        Who has done a tick says so again; who never heard it begins; and who waits
        for a value asks for it. So a lost message costs time, and nothing else.
        """
        for tick in self._said:
            if tick.n > self.done:
                self._put_tick(tick)
        for host in self._pending & self.members.all.keys():
            for entry in self.members.all[host].entries[:1]:
                where = self.session.key(entry.key, "@where")
                self.session.ask_into(where, self._box)

    # -- ending ------------------------------------------------------------------

    def release(self, seconds: float) -> AgentError | None:
        """Let every member go and wait for their last words.

        Returns the first failure of one while it closed.
        """
        self.members.release()
        self.members.update(self.tick.n + 1)
        self._rosters.put(self.members.roster.to_wire())
        failure: AgentError | None = None
        said = time.monotonic()
        deadline = said + seconds
        while self.members.present() and (now := time.monotonic()) < deadline:
            if now - said > PATIENCE:
                said = now
                self._rosters.put(self.members.roster.to_wire())
            try:
                self._read(LOOK)
            except AgentError as error:
                failure = failure or error
        return failure

    def made(self) -> list[str]:
        """The files that the outputs have made; known after `release`."""
        return [path for m in self.members.all.values() for path in m.made]

    def status(self) -> list[dict[str, Any]]:
        """Who is here: agent, kind, host, rate [Hz], seen [s ago], tick."""
        now = time.monotonic()
        return self.members.status(now - self.started if self.started else 0.0, now)

    # -- mail --------------------------------------------------------------------

    def _read(self, timeout: float) -> bool:
        """Take one letter; False when none came in time."""
        for member, error in self._sight.given_up():
            self._lose(member, error)
        letter = self._box.get(timeout)
        if isinstance(letter, Mail):
            self._hear(letter)
        elif isinstance(letter, Question):
            with letter:
                self._answer(letter)
        elif isinstance(letter, Presence):
            self._sight.notice(letter)
        elif letter is None:
            self._look()
        return letter is not None

    def _hear(self, mail: Mail) -> None:
        try:
            self._take(mail)
        except (WireError, TypeError, ValueError, KeyError) as error:
            # Anybody can put anything at a key; it ends no run.
            self.tell(f"what came at {mail.key} is passed over: {error}")

    def _take(self, mail: Mail) -> None:
        closing = self.members.closing.get(mail.key)
        if closing is not None:
            self._hear_done(closing, mail.stamp()[0])
        elif mail.key == self._done_key:
            self._hear_done(*read(mail.payload))
        elif mail.key == self._report_key:
            self._hear_report(read(mail.payload))
        elif mail.key == self._stop_key:
            self.stopped = bool(read(mail.payload))
        elif mail.key.endswith("/@where"):
            member = self.members.owner("/".join(mail.key.split("/")[1:3]))
            if member is not None:
                member.stands = mail.payload.decode()

    def _hear_done(self, host: str, n: int) -> None:
        member = self.members.all.get(host)
        if member is not None and n > member.n:
            member.n, member.seen = n, time.monotonic()
            if n > self.done:
                self._pending.discard(host)

    def _hear_report(self, report: Mapping[str, Any]) -> None:
        """A host's last words."""
        member = self.members.all.get(report["host"])
        if member is not None and member.left:
            return
        if member is not None:
            member.made = list(report.get("made", ()))
            self._sight.forget(member.name)
        failed = report.get("failed")
        error = AgentError(failed["agent"], failed["cause"]) if failed else None
        if member is not None:
            self._lose(member, error)
        elif error is not None:
            raise error

    def _look(self) -> None:
        try:
            self.look()
        except AgentError as error:
            member = self.members.all.get(error.agent)
            if member is None:  # it never joined
                raise
            if not member.left:  # else its last words have said it already
                self._lose(member, error)

    def _lose(self, member: Member, error: AgentError | None) -> None:
        """A member has left: by its release, or failing, which ends the run or not."""
        going = bool(member.entries)
        held = member.owes(self.tick.n)
        self.members.drop(member)
        if error is not None and not (self.drop and going):
            if going:
                self._finish(member.n if held else self.tick.n)
            raise error
        if going and error is not None:
            n = member.n + 1 if held else self.tick.n
            self.tell(f"{error}; dropped at tick {n}")
        if held:
            # Those who wait for its values are told at once, by a roster without it.
            self.members.update(self.tick.n)
            self._rosters.put(self.members.roster.to_wire())
        self._pending.discard(member.name)

    def _finish(self, n: int) -> None:
        """The run has failed: let the others do what was done up to the failure."""
        self._pending = self.members.late(self.done + 1)
        deadline = time.monotonic() + LAST
        while (done := self._advance(n)) < n and time.monotonic() < deadline:
            with suppress(AgentError):  # the first failure is the one to tell
                self._read(LOOK)
            if self.done > done:
                deadline = time.monotonic() + LAST

    def _answer(self, question: Question) -> None:
        key = self.session.key
        as_json = question.parameters.get("format") == "json"
        if question.key == key("clock", "@join"):
            self._join(question)
        elif "/@call/" in question.key:
            name = question.key.rpartition("/")[2]
            answered = perform(verbs_of(self.turns), name, question.payload)
            question.answer(question.key, answered)
        else:
            if question.covers(key("clock", "roster")):
                status = json.dumps(self.status()).encode() if as_json else b""
                epoch = question.parameters.get("epoch", "")
                payload = status or self.members.roster_of(epoch).to_wire()
                question.answer(key("clock", "roster"), payload)
            if question.covers(key("clock", "tick")):
                tick = self.tick.to_plain()
                payload = json.dumps(tick).encode() if as_json else pack(tick)
                question.answer(key("clock", "tick"), payload)

    def _join(self, question: Question) -> None:
        try:
            request, now = read(question.payload), time.monotonic()
            member = self.members.join(request, self.tick.n + 1, now)
        except RemsError as error:
            question.refuse(str(error))
            return
        if member.closing:
            self.session.watch(member.closing, self._box)
        answered = pack({"stopped": self.stopped, "first": member.first})
        question.answer(self.session.key("clock", "@join"), answered)
