"""Author and time of a STOP: a shared router answers at `stop/@why`."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

from rems_net.errors import FabricError, WireError
from rems_net.router.keys import is_name
from rems_net.router.mail import Mail
from rems_net.router.message import pack, read
from rems_net.router.session import Session

#: s. A router has this long to answer.
ANSWER_TIMEOUT = 0.5
#: characters of the user and the laptop
LONGEST = 200
#: lost robots that are named
MOST = 100


class Stop(NamedTuple):
    """A STOP that holds.

    by: the user and the laptop, for people.  at: the time of day at the router,
    `10:41:07`.  ago: the time since then [s].
    lost: robots that were lost without a farewell, `robot/sim`, and seconds since then
    """

    by: str
    at: str
    ago: float
    lost: Sequence[tuple[str, float]] = ()

    def on(self, fabric: str) -> str:
        """Return the sentence for the laptops of this fabric."""
        return (
            f"STOP on {fabric!r} at {self.at}, by {self.by}: robots must stand until "
            "`rems stop --release`"
        )

    def to_wire(self) -> bytes:
        """Return the router's answer."""
        return pack(tuple(self))


def read_said(payload: bytes) -> Stop:
    """Read the author of STOP. Raises WireError."""
    words = read(payload)
    if type(words) is list and len(words) == 4:
        by, at, ago, lost = words
        texts = [one for one in (by, at) if type(one) is str and one.isprintable()]
        fits = len(texts) == 2 and len(by) <= LONGEST and len(at) <= LONGEST
        if fits and type(ago) is float and ago >= 0:
            return Stop(by, at, ago, _read_lost(lost))
    raise WireError("it does not name the author of the STOP. (R0621)")


def _read_lost(lost: Any) -> list[tuple[str, float]]:
    if type(lost) is list and len(lost) <= MOST:
        with suppress(TypeError, ValueError):
            return [
                (robot, float(seconds))
                for robot, seconds in lost
                if is_name(robot.removeprefix("robot/")) and 0 <= seconds < 1e9
            ]
    raise WireError("it lists no lost robots. (R0621)")


def who_stopped(session: Session) -> Stop | None:
    """Return the STOP that holds on this fabric; None if no router knows it."""
    try:
        answers = session.ask(
            session.key("stop", "@why"), timeout=ANSWER_TIMEOUT, first=True
        )
        return read_said(answers[0].payload) if answers else None
    except (FabricError, WireError):
        return None


def ask_who_stopped(
    session: Session, take: Callable[[Mail], None], fabric: str = ""
) -> None:
    """Give the router's answer to `take`, in Zenoh's thread.

    For a session that has just received a STOP: the router may receive it later.
    """
    session.ask_at_once(f"{fabric or session.fabric}/stop/@why?new", take)
