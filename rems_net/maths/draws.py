"""Draws: random numbers that the seed of an experiment does not set, noticed."""

import random
import sys
from collections.abc import Iterator


class Draws:
    """Whether the global `random` or `numpy.random` has been used since it was made."""

    def __init__(self) -> None:
        self._random = random.getstate()
        self._numpy = _numpy()

    def told(self, who: str) -> Iterator[str]:
        """Say it in a sentence for each, and what to use."""
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
    """The state of its global generator, which is loaded when it is first used."""
    numpy = sys.modules.get("numpy.random")
    if numpy is None:
        return "unused"
    _, block, place, *rest = numpy.get_state()
    # Nothing has been drawn yet at the end of a block, where it is when it is seeded,
    # or just before, where it is when it seeds itself.
    if place in (623, 624):
        return "unused"
    return f"{block.tobytes().hex()} {place} {rest}"
