"""Controls: the robots that one page drives, for as long as its picture is new.

A page gets a beat after its frames, and names the newest one in all that it sends. So
the server knows how old the picture was for which a person moved the stick, in its own
time: also while the fabric is paused, when the ticks of commands do not grow old.
"""

from collections import deque
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, NamedTuple

from rems_net.client import Fabric
from rems_net.client.driving import RENEWAL, Driving
from rems_net.errors import RemsError, WireError
from rems_net.router.keys import is_name
from rems_net.teleop.keys import KEYS, stick_of
from rems_net.teleop.stick import FULL, STICK

#: s. A page that drives gets a beat so often.
BEAT = 0.1
#: s. Motions for an older picture are ignored.
OLD = 0.5
#: s. A page that holds a stick and is silent for longer has let go.
SILENT = 0.25
#: s. Between two looks for silent pages: a robot stands 0.3 s after the last motion.
CHECK = 0.02
#: s. The same while no page drives: less than SILENT, so none is seen too late.
REST = 0.2
#: robots that one page drives at once
MOST = 100


class Beat(NamedTuple):
    """One beat, when it was sent [s], and the newest state of each robot then."""

    number: int
    at: float
    seen: dict[str, tuple[int, float]]


class Controls:
    """The robots that one page drives. All methods but `drive` return at once.

    workers: threads for what may wait.
    """

    def __init__(self, fabric: Fabric, workers: ThreadPoolExecutor):
        self._fabric, self._workers = fabric, workers
        self._hands: dict[str, Driving] = {}
        self._beats: deque[Beat] = deque(maxlen=int(2 * OLD / BEAT))
        self._number = 0
        #: s, of this machine: the last message of a stick that was moved; 0 at rest
        self._moved = 0.0
        self._renewed = 0.0

    def __bool__(self) -> bool:
        return bool(self._hands)

    def drive(self, request: dict[str, Any]) -> list[str]:
        """Drive the agents that a page names, and no others. Waits for their answers.

        Return the keys. Raises RemsError for one that cannot be driven; then it drives
        none.
        """
        wanted = _agents(request)
        self.let_go(self._hands.keys() - wanted)
        try:
            for key in sorted(wanted - self._hands.keys()):
                hand = Driving(self._fabric, key)
                hand.open()
                self._hands[key] = hand
                if key.startswith("robot/"):
                    self._fabric.warn_if_stopped(key)
        except RemsError:
            self.let_go()
            raise
        return sorted(self._hands)

    def let_go(self, keys: Iterable[str] | None = None) -> None:
        """Have these robots stand, and give them back; without keys, all."""
        for key in [*self._hands] if keys is None else [*keys]:
            hand = self._hands.pop(key)
            hand.rest()
            done: Future[None] = self._workers.submit(hand.close)
            done.add_done_callback(lambda ended: ended.exception())

    def beat(self, now: float) -> dict[str, Any] | None:
        """Return the next beat for the page, with who drives; None if none is due."""
        if not self._hands or (self._beats and now < self._beats[-1].at + BEAT):
            return None
        self._number += 1
        seen = {key: (one.seen.n, one.seen.t) for key, one in self._hands.items()}
        self._beats.append(Beat(self._number, now, seen))
        return {"number": self._number, "driving": self._driving()}

    def _driving(self) -> dict[str, Any]:
        """Return, by agent, whether the page drives it, and who else wants it."""
        told: dict[str, dict[str, Any]] = {}
        for key, hand in self._hands.items():
            other = hand.other
            name = hand.taken or (other.name if other is not None else "")
            told[key] = {"drives": hand.drives, "taken": bool(hand.taken)}
            if name:
                told[key]["other"] = name
        return told

    def take(self, message: dict[str, Any], now: float) -> None:
        """Drive by what a page's hand does; ignore an old one. Raises WireError."""
        number: Any = message.get("beat")
        stick, held = _stick(message["hand"])
        beat = next((one for one in self._beats if one.number == number), None)
        if beat is None or now > beat.at + OLD:
            if not any(stick.values()):
                self.rest()
            return
        self._moved = now if any(stick.values()) or held else 0.0
        for key, hand in self._hands.items():
            hand.send(stick, held, beat.seen.get(key))

    def rest(self) -> None:
        """Have all robots stand; published once."""
        self._moved = 0.0
        for hand in self._hands.values():
            hand.rest()

    def look(self, now: float) -> None:
        """Renew the leases, and let go for a page that is silent."""
        if self._moved and now > self._moved + SILENT:
            self.rest()
        if now > self._renewed + RENEWAL:
            self._renewed = now
            for hand in self._hands.values():
                hand.keep()


def _agents(request: dict[str, Any]) -> set[str]:
    """Return the agents that a page wants to drive. Raises WireError."""
    agents = request.get("agents")
    if not isinstance(agents, list) or len(agents) > MOST:
        raise WireError(f"A page drives a list of at most {MOST} robots. (R1003)")
    for agent in agents:
        kind, _, name = str(agent).partition("/")
        if kind not in ("robot", "input") or not is_name(name):
            raise WireError(f"{agent!r:.80} is no robot and no input. (R1003)")
    return set(agents)


def _stick(hand: Any) -> tuple[dict[str, float], set[str]]:
    """Return the stick and the held keys of a page's hand. Raises WireError."""
    held = hand.get("held", []) if isinstance(hand, dict) else None
    if not isinstance(held, list) or not {*map(str, held)} <= {*KEYS}:
        raise WireError("A hand holds keys of a known list. (R1003)")
    stick = stick_of({*held})
    given = hand.get("stick", {})
    if not isinstance(given, dict):
        raise WireError("A stick has percentages by axis. (R1003)")
    for axis, value in given.items():
        if axis not in STICK.paths or type(value) not in (int, float):
            raise WireError(f"{axis!r:.40} is no axis of a stick. (R1003)")
        if not -FULL <= value <= FULL:  # no number, too
            raise WireError(
                f"{axis} is {value!r:.40}; expected -100 to 100 percent. (R1003)"
            )
        stick[axis] = float(value)
    return stick, {*held}
