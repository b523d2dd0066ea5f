"""Lease: for how long a robot that is really driven may go on with what it was told."""

from __future__ import annotations

from typing import Protocol


class Lease(Protocol):
    """What a driven robot's device thread asks before it obeys; given by its host.

    Both may be asked from any thread, at any rate, and never wait.
    """

    @property
    def stopped(self) -> bool:
        """Whether STOP holds; true from the moment in which it was heard."""
        ...

    def age(self, n: int) -> float:
        """Return how old tick `n` is at most, in seconds of wall time.

        Never less than the true age, whichever machine made the tick and however it
        came here; infinite for a tick that the clock does not know.
        """
        ...
