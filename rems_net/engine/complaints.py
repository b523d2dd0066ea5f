"""Complaints: what did not fit, told once for each key and kind of reason, counted."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

from rems_net.events import warn

#: keys and reasons that are told apart; what comes beyond is counted together
KINDS = 30
#: messages at one key whose reason is looked at; the others are counted
LOOKED_AT = 1_000
#: What differs between two complaints of one kind: numbers, and what came.
_VARYING = re.compile(r"'[^']*'|\"[^\"]*\"|[-+]?\d[\d.e+-]*")


class _Kind(NamedTuple):
    key: str
    reason: str


def kind_of(sentence: str) -> str:
    """What two complaints of one kind have in common."""
    return _VARYING.sub("_", sentence)


class Complaints:
    """Reports the first of each kind, and at the end how many there were.

    report: `info` or `warn`.
    """

    def __init__(self, report: Callable[[str, str], None] = warn):
        self._report = report
        self._counts: dict[_Kind, int] = {}
        #: how many came at a key
        self._keys: dict[str, int] = {}

    def about(self, key: str, why: object) -> None:
        """What came at `key` is passed over, because of `why`."""
        many = self._keys.get(key, 0)
        if many >= LOOKED_AT:  # in a flood counting is all there is time for
            self._keys[key] = many + 1
            return
        if len(self._keys) < 10 * KINDS:
            self._keys[key] = many + 1
        sentence = str(why)
        kind = _Kind(key, kind_of(sentence))
        if kind not in self._counts and len(self._counts) >= KINDS:
            kind = _Kind("other keys", "")
        seen = self._counts.get(kind, 0)
        self._counts[kind] = seen + 1
        if not seen:
            text = f"what came at {kind.key} is passed over: {sentence}"
            self._report("rejected", text)

    def total(self) -> None:
        """Tell what came more than once."""
        for kind, count in self._counts.items():
            # Those that nobody looked at were most likely of the first kind.
            extra = self._keys.pop(kind.key, 0) - LOOKED_AT
            if (count := count + max(0, extra)) > 1:
                text = f"{count} messages at {kind.key} were passed over"
                self._report("rejected", text)
        self._counts.clear()
        self._keys.clear()
