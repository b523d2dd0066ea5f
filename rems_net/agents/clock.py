"""Clock: the only source of time on a fabric, and the keeper of its roster."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from rems_net.agents.roster import Entry, Roster
from rems_net.agents.tick import Tick
from rems_net.errors import AgentError, FabricError
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
#: seconds between looks at what is not mail: dead processes, a held tick
LOOK = 0.05
#: seconds a closing value may be late before it is asked for by its key
PATIENCE = 0.25
#: seconds that the last words of a host that is gone may take
LAST_WORDS = 0.25
#: seconds after which a held tick is told
HELD = 1.0


@dataclass
class Member:
    """One host, as the clock knows it."""

    name: str
    machine: str
    pid: int
    entries: list[Entry]
    n: int = 0
    seen: float = 0.0
    left: bool = False
    made: list[str] = field(default_factory=list)

    @property
    def lockstep(self) -> bool:
        return any(e.lockstep for e in self.entries)


class Clock:
    """Makes ticks of `dt` seconds, and says who is there.

    pace: real-time factor, or 0.0 for as fast as the slowest member.
    expect: names of the hosts that must have joined before the first tick.
    look: called every now and then while waiting; raises AgentError to end the run.
    """

    def __init__(
        self,
        session: Session,
        *,
        dt: float,
        pace: float = 0.0,
        expect: frozenset[str] = frozenset(),
        look: Callable[[], None] = lambda: None,
        held: Callable[[str], None] = lambda sentence: None,
    ):
        self.session, self.dt, self.pace = session, dt, pace
        self.expect, self.look, self.held = expect, look, held
        self.members: dict[str, Member] = {}
        self.roster = Roster(0, 1, {}, {})
        self.tick = Tick(0, 0.0, dt, pace)
        self.started = 0.0
        self._schemas: dict[str, bytes] = {}
        self._box = Mailbox()
        self._pending: set[str] = set()
        #: host -> (agent, when to give it up): gone without a word so far
        self._lost: dict[str, tuple[str, float]] = {}
        #: full key of the value that ends a host's tick -> host
        self._closing: dict[str, str] = {}

    # -- opening -----------------------------------------------------------------

    def open(self) -> None:
        """Become this fabric's clock. Raises FabricError if it has one already."""
        session, key = self.session, self.session.key
        if session.who(key("clock", "@alive")):
            raise FabricError(
                f"The fabric {session.fabric!r} has a clock already: another "
                f"experiment runs at {session.link.endpoint}. Wait for its end, or use "
                "a router of your own (unset REMS_ROUTER)."
            )
        session.present(key("clock", "@alive"))
        session.watch(key("clock", "done"), self._box)
        session.watch(key("clock", "report"), self._box)
        self._done_key, self._report_key = key("clock", "done"), key("clock", "report")
        session.watch_presence(key("*", "*", "@alive"), self._box)
        session.answer(key("clock", "@join"), self._box)
        session.answer(key("clock", "*"), self._box)
        self._ticks = session.publisher(key("clock", "tick"))
        self._rosters = session.publisher(key("clock", "roster"))

    def gather(self) -> None:
        """Wait until every expected host has joined, then publish the roster.

        Raises AgentError for one that fails or does not come.
        """
        deadline = time.monotonic() + JOIN_TIME
        while missing := self.expect - self.members.keys():
            joined = len(self.members)
            self._read(LOOK)
            if len(self.members) > joined:
                deadline = time.monotonic() + JOIN_TIME
            if time.monotonic() > deadline:
                raise AgentError(
                    min(missing), f"did not join within {JOIN_TIME:.0f} s of the last"
                )
        self._publish_roster()
        self.started = time.monotonic()

    def _publish_roster(self) -> None:
        present = [m for m in self.members.values() if not m.left]
        agents = {e.key: e for m in present for e in m.entries}
        agents = dict(sorted(agents.items()))
        used = {d for e in agents.values() for d in e.outs.values()}
        schemas = {d: s for d, s in sorted(self._schemas.items()) if d in used}
        self.roster = Roster(self.roster.epoch + 1, self.tick.n + 1, agents, schemas)
        self._rosters.put(self.roster.to_wire())

    # -- ticking -----------------------------------------------------------------

    def run(self, ticks: int) -> None:
        """Make this many ticks, each when every member has done the one before.

        At a pace, tick n is due at start + n dt / pace: absolute, so never drifting.
        Raises AgentError when a member fails or dies.
        """
        start = time.monotonic() - (self.tick.t / self.pace if self.pace else 0.0)
        for _ in range(ticks):
            n = self.tick.n + 1
            self.tick = Tick(n, n * self.dt, self.dt, self.pace, self.roster.epoch)
            if self.pace:
                self._sleep_until(start + self.tick.t / self.pace)
            self._pending = {m.name for m in self.members.values() if m.lockstep}
            self._ticks.put_raw(
                pack(self.tick.to_plain()),
                attachment=pack_stamp(n, self.tick.t),
            )
            self._await_done()

    def _await_done(self) -> None:
        begun = told = time.monotonic()
        while self._pending:
            if self._read(LOOK):
                continue
            now = time.monotonic()
            self._ask_late(now - begun)
            if now - told > HELD:
                told = now
                self.held(self._holding(now - begun))

    def _ask_late(self, seconds: float) -> None:
        """A closing value that was lost on its way is asked for by its key."""
        if seconds > PATIENCE:
            for key, host in self._closing.items():
                if host in self._pending:
                    self.session.ask_into(key, self._box)

    def _holding(self, seconds: float) -> str:
        late = {e.key: h for h in self._pending for e in self.members[h].entries}
        # Who waits for another that is late is not to blame.
        blamed = {
            h
            for h in self._pending
            if not any(
                late.get(key, h) != h
                for e in self.members[h].entries
                for key in self.roster.writers(e)
            )
        }
        who = " and ".join(
            f"{', '.join(e.key for e in self.members[h].entries)} "
            f"on {self.members[h].machine}"
            for h in sorted(blamed or self._pending)
        )
        return f"tick {self.tick.n} is held by {who} for {seconds:.1f} s"

    def _sleep_until(self, due: float) -> None:
        while (left := due - time.monotonic()) > 0:
            self._read(min(left, LOOK))

    # -- ending ------------------------------------------------------------------

    def release(self, seconds: float) -> AgentError | None:
        """Let every member go and wait for their last words.

        Returns the first failure of one while it closed.
        """
        for member in self.members.values():
            member.entries = []
        self._publish_roster()
        failure: AgentError | None = None
        deadline = time.monotonic() + seconds
        while any(not m.left for m in self.members.values()):
            if time.monotonic() > deadline:
                break
            try:
                self._read(LOOK)
            except AgentError as error:
                failure = failure or error
        return failure

    def made(self) -> list[str]:
        """The files that the outputs have made; known after `release`."""
        return [path for m in self.members.values() for path in m.made]

    # -- mail --------------------------------------------------------------------

    def _read(self, timeout: float) -> bool:
        """Take one letter; False when none came in time."""
        letter = self._box.get(timeout)
        if self._lost:
            self._mourn()
        if isinstance(letter, Mail):
            closing = self._closing.get(letter.key)
            if closing is not None:
                self._hear_done(closing, letter.stamp()[0])
            elif letter.key == self._done_key:
                self._hear_done(*read(letter.payload))
            elif letter.key == self._report_key:
                self._hear_report(read(letter.payload))
        elif isinstance(letter, Question):
            with letter:
                self._answer(letter)
        elif isinstance(letter, Presence):
            self._notice(letter)
        elif letter is None:
            self.look()
        return letter is not None

    def _hear_done(self, host: str, n: int) -> None:
        member = self.members.get(host)
        if member is not None and n > member.n:
            member.n, member.seen = n, time.monotonic()
            if n == self.tick.n:
                self._pending.discard(host)

    def _hear_report(self, report: Mapping[str, Any]) -> None:
        """A host's last words."""
        member = self.members.get(report["host"])
        if member is not None:
            member.left = True
            member.made = list(report.get("made", ()))
            self._lost.pop(member.name, None)
        failed = report.get("failed")
        if failed:
            raise AgentError(failed["agent"], failed["cause"])

    def _notice(self, presence: Presence) -> None:
        if presence.alive:
            return
        key = "/".join(presence.key.split("/")[1:3])
        for member in self.members.values():
            if not member.left and any(e.key == key for e in member.entries):
                # Its last words travel apart from its presence, and say more.
                self._lost.setdefault(member.name, (key, time.monotonic() + LAST_WORDS))

    def _mourn(self) -> None:
        for name, (key, until) in list(self._lost.items()):
            if time.monotonic() > until:
                del self._lost[name]
                self.members[name].left = True
                self._pending.discard(name)
                self.look()  # whoever started the process knows why it died
                machine = self.members[name].machine
                raise AgentError(key, f"died at tick {self.tick.n} ({machine})")

    def _answer(self, question: Question) -> None:
        key = self.session.key
        if question.key == key("clock", "@join"):
            self._join(question)
        elif question.covers(key("clock", "roster")):
            if question.parameters.get("format") == "json":
                status = json.dumps(self.status()).encode()
                question.answer(key("clock", "roster"), status)
            else:
                question.answer(key("clock", "roster"), self.roster.to_wire())
        if question.covers(key("clock", "tick")):
            tick = self.tick.to_plain()
            as_json = question.parameters.get("format") == "json"
            packed = json.dumps(tick).encode() if as_json else pack(tick)
            question.answer(key("clock", "tick"), packed)

    def _join(self, question: Question) -> None:
        request = read(question.payload)
        entries = [Entry(**e) for e in request["agents"]]
        taken = {e.key: m for m in self.members.values() for e in m.entries}
        for entry in entries:
            if entry.key in taken and not taken[entry.key].left:
                question.refuse(
                    f"There is a {entry.key} already, on {taken[entry.key].machine}; "
                    "give this one another name."
                )
                return
        first = self.tick.n + 1
        entries = [replace(e, since=first) for e in entries]
        name = request["host"]
        self.members[name] = Member(
            name, request["machine"], request["pid"], entries, seen=time.monotonic()
        )
        self._schemas.update(request["schemas"])
        if request["closing"]:
            self._closing[request["closing"]] = name
            self.session.watch(request["closing"], self._box)
        question.answer(self.session.key("clock", "@join"), b"")

    def status(self) -> list[dict[str, Any]]:
        """Who is here: agent, kind, host, machine, rate [Hz], seen [s ago], tick."""
        now = time.monotonic()
        elapsed = max(now - self.started, 1e-9) if self.started else 0.0
        return [
            {
                "agent": entry.key,
                "kind": entry.kind,
                "host": f"{member.machine}:{member.pid}",
                "rate": member.n / entry.every / elapsed if elapsed else 0.0,
                "seen": now - member.seen,
                "tick": member.n,
            }
            for member in self.members.values()
            for entry in member.entries
        ]
