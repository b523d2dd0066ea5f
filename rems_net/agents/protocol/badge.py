"""Badges: which run a message belongs to, and which member of it wrote it.

One integer: 40 random bits of the run, 24 of the member; the clock is member 0. A badge
is never used twice, so it fences out who slept through the end of a run and whatever is
left of an earlier one. It is no secret: who listens can copy it, and who must be kept
from that is for the router's user names (`python -m rems_net.router --users`).
"""

from secrets import randbelow

_MEMBER_BITS = 24
#: members a run may have had, over its whole life
MEMBERS = 2**_MEMBER_BITS
RUNS = 2**40


def new_run() -> int:
    """A number that no other run has."""
    return 1 + randbelow(RUNS - 1)


def badge_of(run: int, member: int) -> int:
    """The badge of this member of this run."""
    return run << _MEMBER_BITS | member


def run_of(badge: int) -> int:
    """The run that a badge belongs to."""
    return badge >> _MEMBER_BITS
