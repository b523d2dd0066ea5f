"""Guard: the age of ticks in wall time, and STOP, as one host knows them.

Clocks of two machines are never compared. The guard notes its own time `a`, and asks
how old tick n is. The answer was computed after `a`, so at any later time the tick is
at most `answer + (now - a)` old. This bound stays true during a pause, a held tick, a
dead or frozen clock or router, and delays in buffers; arrival times do not.
"""

import threading
from collections import deque
from collections.abc import Callable

from rems_net.agents.protocol.badge import run_of
from rems_net.agents.protocol.messages import STOP, read_age
from rems_net.agents.wall import wall
from rems_net.errors import WireError
from rems_net.router.mail import Mail, Question
from rems_net.router.message import pack
from rems_net.router.session import Session

#: s. Time between two questions: a fifth of the shortest validity of a command.
PERIOD = 0.1
#: Number of answers kept. They reach back a few seconds; no older command is obeyed.
ANSWERS = 64
#: s. STOP is sent again after this time to a clock that has not received it.
AGAIN = 0.25


class Guard:
    """Age of ticks, STOP, and sight of the clock: robots check it before they obey.

    The latch: STOP holds from the moment it is received until the clock sends a greater
    even number. A tick that was sent before can never release it.
    """

    def __init__(self, session: Session):
        self._session = session
        self._stop_key = session.key("stop")
        self._holds_key = session.key("stop", "@holds")
        self._lock = threading.Lock()
        self._stopped = False
        #: the clock's newest number, and the even number that releases
        self._stops, self._release = 0, 0
        self._said_again = 0.0
        self._run = 0
        self._newest: Callable[[], int] = lambda: 0
        #: (tick, its age [s] at the answer, time of the question), in order of arrival
        self._answers: deque[tuple[int, float, float]] = deque(maxlen=ANSWERS)
        #: time since which the clock is out of sight
        self._lost: float | None = None
        self._ended = threading.Event()

    @property
    def stopped(self) -> bool:
        """Whether STOP holds."""
        return self._stopped

    def watch(self) -> None:
        """Receive STOP at any time, also during a step, and keep it."""
        self._session.watch_at_once(self._stop_key, self._hear)
        self._session.answer_at_once(self._holds_key, self._tell)

    def _tell(self, question: Question) -> None:
        question.answer(self._holds_key, pack(self._stopped))

    def _hear(self, mail: Mail) -> None:
        # Not `read_stop`, which also reads the sentence that the clock publishes once:
        # a flood of STOPs must cost next to nothing.
        if mail.size != len(STOP) or mail.payload != STOP:
            return
        with self._lock:
            if not self._stopped:
                self._release = self._stops + 2
            self._stopped = True

    def take(self, stops: int) -> None:
        """Take in the clock's number; odd means stopped."""
        if stops == self._stops and not self._stopped:
            return
        with self._lock:
            if stops % 2:
                self._stopped = True
                self._release = max(self._release, stops + 1)
            elif not self._stopped:
                pass
            elif stops >= self._release:
                self._stopped = False
            elif wall() - self._said_again > AGAIN:
                # The clock has not received the STOP that came here.
                self._said_again = wall()
                self._session.put(self._stop_key, STOP)
            self._stops = max(stops, self._stops)

    def begin(self, badge: int, stops: int, newest: Callable[[], int]) -> None:
        """Begin with a run that has admitted this host.

        newest: the newest tick received.
        """
        self._run, self._newest = run_of(badge), newest
        self._lost = None  # the clock has just answered
        self._answers.clear()
        with self._lock:  # another clock counts from its own beginning
            self._stops, self._release = stops, stops + 2 - stops % 2
        self.take(stops)

    def start(self) -> None:
        """Ask for ages from now on: real robots are driven here."""
        threading.Thread(target=self._ask_on, name="guard", daemon=True).start()

    def end(self) -> None:
        """Ask no more."""
        self._ended.set()

    def age(self, n: int) -> float:
        """Return the upper bound of the age [s] of tick `n`; infinite if unknown."""
        now = wall()
        # An answer for an earlier tick bounds a later one, too.
        known = [age + now - asked for m, age, asked in list(self._answers) if m <= n]
        return min(known, default=float("inf"))

    def _ask_on(self) -> None:
        while not self._ended.wait(PERIOD):
            if self._run:
                self._ask(self._newest())

    def _ask(self, n: int) -> None:
        asked = wall()

        def hear(mail: Mail) -> None:
            try:
                age = read_age(mail.payload)
            except WireError:
                return
            if age.run == self._run:
                self._answers.append((n, age.seconds, asked))
                self.take(age.stops)

        key = self._session.key("clock", "@age")
        self._session.ask_at_once(f"{key}?n={n}", hear)

    def see(self, alive: bool) -> None:
        """Note that the clock came into sight, or went out of it."""
        self._lost = None if alive else (self._lost or wall())

    @property
    def lost(self) -> float:
        """Seconds for which the clock has been out of sight; 0 while it is here."""
        return 0.0 if self._lost is None else wall() - self._lost
