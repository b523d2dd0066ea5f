"""Grip: a viewer's hand on one robot, and how old what comes from a viewer may be.

A viewer does not report what it saw. So the server pings it while it drives: an answer
shows that all that was sent before it has come. While an answer is missing for longer
than OLD, and until a newer ping is answered, nothing that comes is obeyed.
"""

from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor

from rems_net.client import Fabric
from rems_net.client.driving import RENEWAL, Driving
from rems_net.dashboard.controls import BEAT, OLD, SILENT
from rems_net.errors import RemsError

#: s. A robot that a viewer has not moved for so long is given back.
IDLE = 2.0
#: pings that may be unanswered; then no more are sent
WAITING = 8


class Echo:
    """Whether what comes from a viewer is new."""

    def __init__(self) -> None:
        #: s, when each ping was sent that is not answered
        self._waiting: dict[int, float] = {}
        self._number = 0
        #: s, when the newest ping that counts was sent; those until `void` do not
        self._newest = self._void = float("-inf")
        self._due = 0.0

    def beat(self, now: float) -> int | None:
        """Return the number of a ping that is to be sent now, if one is due."""
        if now < self._due or len(self._waiting) >= WAITING:
            return None
        self._due = now + BEAT
        self._number += 1
        self._waiting[self._number] = now
        return self._number

    def came(self, number: int, now: float) -> None:
        """Note that a ping was answered."""
        sent = self._waiting.pop(number, float("-inf"))
        if now > sent + OLD:
            # Messages that come with this answer are as old, and those right after it.
            self._void = now + BEAT
        elif sent > self._void:
            self._newest = sent

    def is_new(self, now: float) -> bool:
        """Return whether what comes now was sent at most OLD ago."""
        oldest = min(self._waiting.values(), default=now)
        if now > oldest + OLD:
            self._void = now + BEAT
        return self._newest > self._void and now <= self._newest + OLD


class Grip:
    """A viewer's hand on one robot, from its first motion on. Returns at once.

    show: shows a sentence in the viewer.
    """

    def __init__(
        self,
        fabric: Fabric,
        key: str,
        workers: ThreadPoolExecutor,
        show: Callable[[str], None],
    ):
        self.key = key
        self._fabric, self._workers, self._show = fabric, workers, show
        self._hand: Driving | None = None
        self._asked: Future[Driving] | None = None
        #: s: its last message, its last motion (0 at rest), and renewal of the lease
        self._used = self._moved = self._renewed = 0.0
        #: whether it was refused, or taken away: until the viewer pauses
        self._lost = False

    def take(self, stick: Mapping[str, float], now: float) -> None:
        """Drive by a viewer's stick; the first motion asks for the robot."""
        self._used = now
        moves = any(stick.values())
        if self._hand is not None:
            self._moved = now if moves else 0.0
            self._hand.send(stick)
        elif moves and self._asked is None and not self._lost:
            self._asked = self._workers.submit(self._open)

    def _open(self) -> Driving:
        hand = Driving(self._fabric, self.key)
        hand.open()
        if self.key.startswith("robot/"):
            self._fabric.warn_if_stopped(self.key)
        return hand

    def rest(self) -> None:
        """Have the robot stand; published once."""
        self._moved = 0.0
        if self._hand is not None:
            self._hand.rest()

    def look(self, now: float) -> None:
        """Take the robot when it answers, renew the lease, and let go in silence."""
        if self._asked is not None and self._asked.done():
            self._opened(self._asked)
            self._asked = None
        if self._moved and now > self._moved + SILENT:
            self.rest()
        hand = self._hand
        if now > self._used + IDLE:
            self._lost = False
            if hand is not None:
                self.let_go()
        elif hand is not None and hand.taken:
            self._lose(f"{self.key} was taken by {hand.taken}; it is not driven here.")
        elif hand is not None and now > self._renewed + RENEWAL:
            self._renewed = now
            hand.keep()

    def hold(self, now: float) -> None:
        """Note that the viewer moves its hand, by what is too old to be obeyed."""
        self._used = now

    def is_over(self, now: float) -> bool:
        """Return whether the viewer has not moved it for long."""
        return now > self._used + IDLE and self._hand is None and self._asked is None

    def _opened(self, asked: Future[Driving]) -> None:
        try:
            self._hand = asked.result()
        except RemsError as error:
            self._lost = True
            self._show(str(error))
            return
        if (other := self._hand.other) is not None and other.drives:
            self._show(
                f"{other.name} drives {self.key}; it is yours in {other.left:.0f} s."
            )

    def _lose(self, sentence: str) -> None:
        self._lost = True
        self._show(sentence)
        self.let_go()

    def leave(self) -> None:
        """Let go of a robot that has left the fabric."""
        if self._hand is not None:
            self._lose(f"{self.key} has left; nothing drives it.")

    def let_go(self) -> None:
        """Have the robot stand, and give it back."""
        asked, self._asked = self._asked, None
        if asked is not None:
            asked.add_done_callback(_close)
        hand, self._hand = self._hand, None
        self._moved = 0.0
        if hand is not None:
            hand.rest()
            self._workers.submit(hand.close)


def _close(asked: Future[Driving]) -> None:
    if not asked.cancelled() and asked.exception() is None:
        asked.result().close()
