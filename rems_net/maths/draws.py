"""Draws: detects random numbers that the seed of an experiment does not set."""

import random
import sys
from collections.abc import Iterator


class Draws:
    """Use of the global `random` or `numpy.random` since this object was made."""

    def __init__(self) -> None:
        self._random = random.getstate()
        self._numpy = _numpy()

    def told(self, who: str) -> Iterator[str]:
        """Yield a warning for each generator that was used: what to use instead."""
        told = (
            f"{who} draws from the global {{}}, which the experiment's seed does not "
            "set; use {} (docs/agents.md)"
        )
        if random.getstate() != self._random:
            yield told.format("random", "self.random")
        now = _numpy()
        if now != self._numpy and now != "unused":
            mine = "numpy.random.default_rng(self.random.getrandbits(64))"
            yield told.format("numpy.random", mine)


def _numpy() -> str:
    """Return the state of numpy's global generator; "unused" if nothing was drawn."""
    numpy = sys.modules.get("numpy.random")
    if numpy is None:
        return "unused"
    _, block, place, *rest = numpy.get_state()
    # Nothing was drawn yet if the place is the end of a block, as after a seed, or just
    # before the end, as when numpy has seeded itself.
    if place in (623, 624):
        return "unused"
    return f"{block.tobytes().hex()} {place} {rest}"
