"""Inbox: what the clock is told and asked, each letter to whom it concerns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rems_net.agents.clock.answers import Answers
from rems_net.agents.clock.detector import Detector
from rems_net.agents.clock.membership import Membership
from rems_net.agents.clock.progress import Progress
from rems_net.errors import WireError
from rems_net.router.mail import Mail, Mailbox, Presence, Question
from rems_net.router.message import read
from rems_net.router.session import Session


class Inbox:
    """The clock's mail, sorted.

    report: called with a host's last words.  tell: with what makes no sense.
    """

    def __init__(
        self,
        session: Session,
        box: Mailbox,
        members: Membership,
        progress: Progress,
        detector: Detector,
        answers: Answers,
        *,
        report: Callable[[Mapping[str, Any]], None],
        tell: Callable[[str], None],
    ):
        self._session, self._box = session, box
        self._members, self._progress = members, progress
        self._detector, self._answers = detector, answers
        self._report, self._tell = report, tell
        self._done_key = session.key("clock", "done")
        self._report_key = session.key("clock", "report")
        self._stop_key = session.key("stop")

    def watch(self) -> None:
        """Hear the hosts, and who wants to join."""
        session, key = self._session, self._session.key
        for watched in (self._done_key, self._report_key, self._stop_key):
            session.watch(watched, self._box)
        session.watch_presence(key("*", "*", "@alive"), self._box)
        session.answer(key("clock", "@join"), self._box)

    def read(self, timeout: float) -> bool:
        """Take one letter; False when none came in time."""
        letter = self._box.get(timeout)
        if isinstance(letter, Mail):
            try:
                self._sort(letter)
            except (WireError, TypeError, ValueError, KeyError) as error:
                # Anybody can put anything at a key; it ends no run.
                self._tell(f"what came at {letter.key} is passed over: {error}")
        elif isinstance(letter, Question):
            with letter:
                self._answers.answer(letter)
        elif isinstance(letter, Presence):
            self._detector.notice(letter)
        return letter is not None

    def _sort(self, mail: Mail) -> None:
        closing = self._members.closing.get(mail.key)
        if closing is not None:
            self._progress.hear(closing, mail.stamp()[0])
        elif mail.key == self._done_key:
            self._progress.hear(*read(mail.payload))
        elif mail.key == self._report_key:
            self._report(read(mail.payload))
        elif mail.key == self._stop_key:
            self._answers.stopped = bool(read(mail.payload))
        elif mail.key.endswith("/@where"):
            member = self._members.owner("/".join(mail.key.split("/")[1:3]))
            if member is not None:
                member.stands = mail.payload.decode()
