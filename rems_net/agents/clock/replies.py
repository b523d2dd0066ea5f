"""Replies of a clock: its members, the time, and admission."""

import json
import math
import time
from typing import Any

import rems_net
from rems_net.agents.clock.admission import Admissions
from rems_net.agents.clock.broadcaster import Broadcaster
from rems_net.agents.protocol.complaints import Complaints
from rems_net.agents.protocol.messages import (
    Admission,
    answer_call,
    pack_age,
    read_badge,
    read_farewell,
    read_request,
)
from rems_net.agents.verbs import verb, verbs_of
from rems_net.agents.wall import wall
from rems_net.errors import RemsError, WireError
from rems_net.router.gate.stops import ask_who_stopped
from rems_net.router.mail import Mailbox, Question
from rems_net.router.message import pack

#: Number of ticks that are remembered: over half a second of the fastest clock.
REMEMBERED = 16_384


class Replies:
    """Answers for the clock of these members.

    The clock's verbs are those of the pacing, and `release`.
    """

    def __init__(
        self,
        admissions: Admissions,
        broadcaster: Broadcaster,
        box: Mailbox,
        complaints: Complaints,
    ):
        self.admissions, self.broadcaster = admissions, broadcaster
        self.session, self.members = admissions.session, admissions.members
        self.pacing, self.progress = admissions.pacing, admissions.progress
        self.box, self.complaints = box, complaints
        #: monotonic time [s] at which all hosts had joined; 0.0 before
        self.started = 0.0
        #: wall time at which each of the last ticks was made
        self._made: dict[int, float] = {}
        key = self.session.key
        self._asked = {
            key("clock", "@join"): self._join,
            key("clock", "@leave"): self._leave,
            key("clock", "@member"): self._tell_member,
            key("clock", "@why"): self._tell_why,
        }

    def declare(self) -> None:
        """Declare the keys that are answered."""
        key = self.session.key
        for asked in (*self._asked, key("clock", "@call", "*"), key("clock", "*")):
            self.session.answer(asked, self.box)

    def tell_age(self, question: Question) -> None:
        """Answer with the age of tick `?n=412`. Runs in Zenoh's thread."""
        given = question.parameters.get("n", "")
        n = int(given) if given.isdecimal() and len(given) < 17 else 0
        age = pack_age(self.members.run, self._age(n), self.broadcaster.stops)
        question.answer(self.session.key("clock", "@age"), age)

    def note(self, n: int) -> None:
        """Note that tick `n` is made now."""
        self._made[n] = wall()
        self._made.pop(n - REMEMBERED, None)

    def _age(self, n: int) -> float:
        """Return the seconds since tick `n` was made; infinite if it is not known."""
        return wall() - self._made.get(n, -math.inf)

    def answer(self, question: Question) -> None:
        """Answer a question. Raises AgentError if that ends the run."""
        if "/@call/" in question.key:
            verbs = verbs_of(self.pacing) | verbs_of(self)
            answer_call(question, question.key, verbs)
            return
        try:
            self._asked.get(question.key, self._tell)(question)
        except WireError as error:
            question.refuse(str(error))

    @verb
    def release(self) -> list[str]:
        """Let the robots obey commands again. Returns those that stood still."""
        if not self.broadcaster.hold(False):
            return []
        agents = [e.key for m in self.members.present() for e in m.entries]
        return sorted(key for key in agents if key.startswith("robot/"))

    def stop(self) -> None:
        """Let STOP hold, and ask for the name of its sender."""
        if self.broadcaster.hold(True) and self.broadcaster.reports:
            ask_who_stopped(self.session, self.box.put)

    def _tell_why(self, question: Question) -> None:
        """Answer why values may be old: the newest tick, its age, the late hosts."""
        n, age = self.pacing.n, self._age(self.pacing.n)
        late = self.progress.late(n)
        told = {
            "tick": n,
            "age": age if age < math.inf else 0.0,
            "paused": self.pacing.paused,
            "stopped": bool(self.broadcaster.stops % 2),
            "waits_for": self.progress.describe(late) if late else "",
            "version": rems_net.__version__,
            "now": time.time(),
        }
        question.answer(question.key, json.dumps(told).encode())

    def _tell(self, question: Question) -> None:
        key = self.session.key
        as_json = question.parameters.get("format") == "json"
        if question.covers(key("clock", "roster")):
            told: Any = self.members.status()
            if "begun" in question.parameters and not self.started:
                told = {"awaited": self.members.awaited()}
            status = json.dumps(told).encode() if as_json else b""
            epoch = question.parameters.get("epoch", "")
            payload = status or self.progress.roster_of(epoch).to_wire()
            question.answer(key("clock", "roster"), payload)
        if question.covers(key("clock", "tick")):
            tick = self.pacing.tick.to_plain() | {"stops": self.broadcaster.stops}
            payload = json.dumps(tick).encode() if as_json else pack(tick)
            question.answer(key("clock", "tick"), payload)

    def _join(self, question: Question) -> None:
        try:
            request, now = read_request(question.payload), time.monotonic()
            self.admissions.make_way(request)
            member = self.members.join(request, self.pacing.n + 1, now)
        except RemsError as error:
            question.refuse(str(error))
            self.complaints.about("clock/@join", error)
            return
        if request.stopped:
            self.stop()
        self.admissions.welcome(member)
        admission = Admission(
            member.badge,
            member.first,
            self.pacing.dt,
            self.broadcaster.stops,
            self.members.terms.wait.back,
        )
        question.answer(question.key, pack(admission._asdict()))

    def _leave(self, question: Question) -> None:
        farewell = read_farewell(question.payload)
        member = self.members.by_badge.get(farewell.badge)
        early = self.members.ticket_of(farewell.badge) is not None
        # The farewell of a member that has left came already; the answer was lost.
        known = any(m.badge == farewell.badge for m in self.members.all.values())
        if not (known or early):
            raise WireError("no member of this run has that badge. (R0621)")
        question.answer(question.key, b"")
        if member is not None or early:
            self.admissions.hear_farewell(member, farewell)

    def _tell_member(self, question: Question) -> None:
        """Answer if there is a member with this badge: a board reads no roster."""
        if read_badge(question.payload) not in self.members.by_badge:
            raise WireError("no member of this run has that badge. (R0621)")
        question.answer(question.key, b"")
