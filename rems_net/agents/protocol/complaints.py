"""Complaints: messages that did not fit, reported once for each kind, and counted."""

from collections.abc import Callable

from rems_net.agents.about.reasons import KINDS, Reasons
from rems_net.events import warn

#: Number of messages at one key whose reasons are read; a flood is only counted.
LOOKED_AT = 1_000


class Complaints:
    """Reports the first message of each key and kind, and at the end the total.

    report: `info` or `warn`.
    """

    def __init__(self, report: Callable[[str, str], None] = warn):
        self._report = report
        self._keys: dict[str, Reasons] = {}

    def about(self, key: str, why: object) -> None:
        """Count a message at `key` that is ignored because of `why`."""
        if key not in self._keys and len(self._keys) >= KINDS:
            key = "other keys"
        reasons = self._keys.setdefault(key, Reasons())
        if reasons.count >= LOOKED_AT:
            reasons.count += 1
        elif reasons.add(str(why)):
            self._report("rejected", f"what came at {key} is passed over: {why}")

    def total(self) -> None:
        """Report each key at which more messages came than were reported."""
        for key, reasons in self._keys.items():
            if reasons.count > len(reasons.rows):
                text = f"{reasons.count} messages at {key} were passed over"
                self._report("rejected", text)
        self._keys.clear()
