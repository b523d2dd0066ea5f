"""Reasons why values did not fit, counted by kind."""

import re
from typing import Any

#: Number of kinds of reasons, or of keys; all others are counted together.
KINDS = 30
#: Parts in which two sentences of one kind differ: numbers, and received text.
_VARYING = re.compile(r"'[^']*'|\"[^\"]*\"|[-+]?\d[\d.e+-]*")


class Reasons:
    """Reasons why values did not fit, by kind.

    count: of values.  rows: by kind, how often it came, and its first sentence.
    """

    def __init__(self) -> None:
        self.count = 0
        self.rows: dict[str, tuple[int, str]] = {}

    def add(self, sentence: str) -> bool:
        """Count a value; return whether the kind of its reason is new."""
        self.count += 1
        kind = _VARYING.sub("_", sentence)
        if kind not in self.rows and len(self.rows) >= KINDS:
            kind, sentence = "", "for other reasons"
        count, first = self.rows.get(kind, (0, sentence))
        self.rows[kind] = count + 1, first
        return not count

    def plain(self) -> dict[str, Any]:
        """Return the counts as they travel. For any thread."""
        rows = [[*row] for row in list(self.rows.values())]
        return {"dropped": self.count, "reasons": rows}

    def total(self) -> str:
        """Return how many values there were, and why; "" if there were none."""
        values = "1 value" if self.count == 1 else f"{self.count} values"
        why = " ".join(f"{n} x: {first}" for n, first in self.rows.values())
        return f"{values} in all. {why}" if self.count else ""
