"""Dispatcher: the clock's messages and questions, each passed to its handler."""

from rems_net.agents.clock.members import Member
from rems_net.agents.clock.replies import Replies
from rems_net.agents.protocol.limits import NAME
from rems_net.agents.protocol.messages import read_done, read_stop
from rems_net.agents.protocol.shapes import shown
from rems_net.errors import WireError
from rems_net.events import info
from rems_net.router.gate.stops import read_said
from rems_net.router.keys import STEP, agent_of
from rems_net.router.mail import Letter, Mail, Presence, Question
from rems_net.router.publisher import Watch

#: Number of letters that are taken before the clock returns to its other work.
TOGETHER = 64


class Dispatcher:
    """The clock's mail, sorted. A letter that makes no sense is a complaint."""

    def __init__(self, replies: Replies):
        self._replies, self._box = replies, replies.box
        self._session = session = replies.session
        self._members, self._progress = replies.members, replies.progress
        self._done_key = session.key("clock", STEP, "done")
        self._stop_key = session.key("stop")
        self._why_key = session.key("stop", "@why")
        self._members_key = session.key("clock", "@member", "")
        #: key at which a closing value comes -> its member, and the subscription
        self._closings: dict[str, tuple[Member, Watch]] = {}

    def watch(self) -> None:
        """Subscribe to the hosts."""
        for watched in (self._done_key, self._stop_key):
            self._session.watch(watched, self._box)
        self._session.watch_presence(f"{self._members_key}*", self._box)

    def watch_closings(self) -> None:
        """Subscribe to every closing value of the roster, in its one message.

        It comes at the members' key if members in lock-step read it; else at the plain
        key, with other programs.
        """
        wanted: dict[str, Member] = {}
        for port, member in self._members.closing.items():
            kind, name, last = port.split("/")
            outside = self._progress.roster.read_outside(member.name)
            step = [STEP] if port in outside else []
            wanted[self._session.key(kind, name, *step, last)] = member
        for key in self._closings.keys() - wanted.keys():
            self._closings.pop(key)[1].close()
        for key, member in wanted.items():
            heard = self._closings.get(key)
            watch = heard[1] if heard else self._session.watch(key, self._box)
            self._closings[key] = member, watch

    def read(self, timeout: float) -> bool:
        """Take some letters that came; return False if none came in time."""
        letter = self._box.get(timeout)
        if letter is None:
            return False
        self._take(letter)
        for letter in self._box.letters(TOGETHER):
            self._take(letter)
        return True

    def _take(self, letter: Letter | None) -> None:
        if isinstance(letter, Mail):
            try:
                self._sort(letter)
            except WireError as error:
                # Any program can put anything at a key; that ends no run.
                self._replies.complaints.about(letter.key, error)
        elif isinstance(letter, Question):
            with letter:
                self._replies.answer(letter)
        elif isinstance(letter, Presence):
            badge = letter.key.removeprefix(self._members_key)
            if badge.isdecimal() and len(badge) < 21:
                self._replies.admissions.notice(int(badge), letter.alive)

    def _sort(self, mail: Mail) -> None:
        closing = self._closings.get(mail.key)
        if closing is not None:
            stamp = mail.stamp()
            self._hear_done(closing[0], stamp.badge, stamp.n)
        elif mail.key == self._done_key:
            badge, n = read_done(mail.payload)
            self._hear_done(self._members.by_badge.get(badge), badge, n)
        elif mail.key == self._stop_key:
            read_stop(mail.payload)
            self._replies.stop()
        elif mail.key == self._why_key:
            info("stop", read_said(mail.payload).on(self._session.fabric))
        elif mail.key.endswith("/@where"):
            member = self._members.owner(agent_of(mail.key))
            if member is not None:
                said = mail.payload.decode(errors="replace")
                member.stands = shown(said, "where it stands", NAME)

    def _hear_done(self, member: Member | None, badge: int, n: int) -> None:
        if member is None or member.badge != badge or member.left:
            raise WireError(
                "it carries no badge of the member it would come from. (R0621)"
            )
        newest = self._replies.pacing.tick.n
        if n > newest:
            raise WireError(
                f"it reports tick {n} as done; the newest is {newest}. (R0621)"
            )
        self._progress.hear(member, n)
