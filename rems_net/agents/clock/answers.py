"""What a clock answers when asked: who is there, what time it is, to be let in."""

from __future__ import annotations

import json
import time
from typing import Any

from rems_net.agents.clock.membership import Membership
from rems_net.agents.clock.pacing import Pacing
from rems_net.agents.verbs import perform, verbs_of
from rems_net.errors import RemsError
from rems_net.router.mail import Mailbox, Question
from rems_net.router.message import pack, read
from rems_net.router.session import Session


class Answers:
    """Answers for the clock of these members. Its verbs are those of the pacing."""

    def __init__(
        self, session: Session, box: Mailbox, members: Membership, pacing: Pacing
    ):
        self.session, self.members, self.pacing = session, members, pacing
        self._box = box
        #: when the first tick was made
        self.started = 0.0
        #: what `rems/stop` has said last; told to who joins
        self.stopped = False

    def declare(self) -> None:
        """Be asked."""
        key = self.session.key
        self.session.answer(key("clock", "@call", "*"), self._box)
        self.session.answer(key("clock", "*"), self._box)

    def answer(self, question: Question) -> None:
        """Answer whatever is asked for."""
        if question.key == self.session.key("clock", "@join"):
            self._join(question)
        elif "/@call/" in question.key:
            name = question.key.rpartition("/")[2]
            answered = perform(verbs_of(self.pacing), name, question.payload)
            question.answer(question.key, answered)
        else:
            self._tell(question)

    def status(self) -> list[dict[str, Any]]:
        """Who is here: agent, kind, host, rate [Hz], seen [s ago], tick."""
        now = time.monotonic()
        return self.members.status(now - self.started if self.started else 0.0, now)

    def _tell(self, question: Question) -> None:
        key = self.session.key
        as_json = question.parameters.get("format") == "json"
        if question.covers(key("clock", "roster")):
            status = json.dumps(self.status()).encode() if as_json else b""
            epoch = question.parameters.get("epoch", "")
            payload = status or self.members.roster_of(epoch).to_wire()
            question.answer(key("clock", "roster"), payload)
        if question.covers(key("clock", "tick")):
            tick = self.pacing.tick.to_plain()
            payload = json.dumps(tick).encode() if as_json else pack(tick)
            question.answer(key("clock", "tick"), payload)

    def _join(self, question: Question) -> None:
        try:
            request, now = read(question.payload), time.monotonic()
            member = self.members.join(request, self.pacing.n + 1, now)
        except RemsError as error:
            question.refuse(str(error))
            return
        if member.closing:
            self.session.watch(member.closing, self._box)
        answered = pack({"stopped": self.stopped, "first": member.first})
        question.answer(self.session.key("clock", "@join"), answered)
