"""Standing: whether a robot stands still, as far as its device has reported."""

from typing import Any, Literal, NamedTuple, get_args

from rems_net.errors import WireError

#: confirmed: its device has reported, after the last other command, that it stands.
#: simulated: a model or a simulator obeys its safe command, or waits for a tick.
#: sent: its device has not confirmed it yet.
#: lost: its device is out of reach.
Kind = Literal["confirmed", "simulated", "sent", "lost"]

#: s. Nothing is out of reach for longer.
LONGEST = 1e9


class Standing(NamedTuple):
    """Report on a robot that has to stand still: one of four kinds.

    seconds: since its device has answered [s], if that is lost
    left: s until a watchdog in the device stops it; 0.0: it has; None: it has none
    """

    kind: Kind = "sent"
    seconds: float = 0.0
    left: float | None = None

    @property
    def is_sure(self) -> bool:
        """Whether the robot surely stands."""
        return self.kind in ("confirmed", "simulated") or self.left == 0.0

    def __str__(self) -> str:
        if self.kind == "sent":
            return "STOP is sent, not confirmed"
        if self.kind != "lost":
            return self.kind
        return f"is out of reach for {self.seconds:.1f} s: {alone(self.left)}"

    def wire(self) -> dict[str, Any]:
        """Return it as fields of an answer."""
        return {"standing": self.kind, "seconds": self.seconds, "left": self.left}


SENT = Standing()


def alone(left: float | None) -> str:
    """Return what a device does out of reach. left: see `Standing`."""
    if left is None:
        return "it may drive on; switch it off"
    return f"it stands by its own watchdog{f' within {left:.1f} s' * (left > 0)}"


def read_standing(plain: Any) -> Standing:
    """Return the standing in an answer; a board sends only its kind.

    Raises WireError for a malformed answer.
    """
    try:
        kind = plain["standing"]
        seconds, left = plain.get("seconds", 0.0), plain.get("left")
        fits = kind in get_args(Kind) and 0 <= seconds < LONGEST
        if fits and (left is None or 0 <= left < LONGEST):
            return Standing(kind, float(seconds), left)
    except (KeyError, TypeError, AttributeError):
        pass
    raise WireError("it is no standing of a robot (R0621)")
