"""Latch: STOP, which anybody may say, and which holds until it is released."""

from __future__ import annotations


class Latch:
    """Counts how often STOP was said and released: odd means that it holds.

    A number, not a flag: a tick that was sent before a STOP was heard can never
    release it, for only a greater even number does.
    """

    def __init__(self) -> None:
        self.stops = 0

    @property
    def stopped(self) -> bool:
        """Whether every robot is to stand still."""
        return bool(self.stops % 2)

    def stop(self) -> bool:
        """Let it hold; True where it did not."""
        fresh = not self.stopped
        self.stops += fresh
        return fresh

    def release(self) -> bool:
        """Let the robots obey commands again. Returns whether they were stopped."""
        held = self.stopped
        self.stops += held
        return held
