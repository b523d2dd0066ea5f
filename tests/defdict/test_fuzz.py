"""The fuzzer, for a moment: long runs are made by hand (see fuzz.py)."""

import os

from tests.defdict import fuzz


def test_a_short_run() -> None:
    accepted = fuzz.run(20_000, seed=int.from_bytes(os.urandom(4)))
    # Some mutations stay acceptable; a fuzzer that never passes tests nothing.
    assert accepted["pose"] > 0


def test_memory_stays_bounded() -> None:
    fuzz.run(1_500, seed=1, memory=True)
