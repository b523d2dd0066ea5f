"""Outside: one call from outside, as its event and a recording have it."""

import json
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from rems_net.agents.verbs import plain
from rems_net.errors import uncoded

#: what the event of such a call begins with
BEGIN = "called from outside after tick "
#: stands for a verb: a value is put at an In. Its arguments: the In's name, the values,
#: and their source tick
PUT = "@put"
#: stands for a verb: STOP, with True, or its release
HOLD = "@hold"


class Outside(NamedTuple):
    """A call from outside. n: the tick after which it was done.

    lost: why its arguments cannot be recorded; "" if they are here.
    """

    n: int
    verb: str
    args: Sequence[Any] = ()
    kwargs: Mapping[str, Any] = {}
    lost: str = ""

    @classmethod
    def of(
        cls, n: int, verb: str, args: Sequence[Any], kwargs: Mapping[str, Any]
    ) -> "Outside":
        """Return a call with arguments as they travel; without, if they cannot."""
        try:
            sent = [plain([*args]), plain(dict(kwargs))]
            same = json.loads(json.dumps(sent))
        except (TypeError, ValueError, RecursionError) as error:
            return cls(n, verb, lost=uncoded(error))
        if repr(same) != repr(sent):  # such as a dict whose keys are numbers
            return cls(n, verb, lost=f"{same} would be read from {sent}"[:200])
        return cls(n, verb, *sent)

    def text(self) -> str:
        """Return the sentence of its event."""
        sent: dict[str, Any] = {"verb": self.verb}
        if self.lost:
            sent |= {"lost": self.lost}
        else:
            sent |= {"args": self.args, "kwargs": self.kwargs}
        return f"{BEGIN}{self.n}: {json.dumps(sent)}"

    @classmethod
    def read(cls, text: str) -> "Outside | None":
        """Return the call of an event; None for any other event."""
        n, colon, sent = text.removeprefix(BEGIN).partition(": ")
        if not (text.startswith(BEGIN) and colon and n.isdecimal()):
            return None
        try:
            return cls(int(n), **json.loads(sent))
        except (ValueError, TypeError, RecursionError):
            return None
