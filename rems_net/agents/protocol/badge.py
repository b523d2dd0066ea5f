"""Badges: the run that a message belongs to, and its sender.

One integer: 40 random bits for the run, 24 for the member; the clock is member 0. A
badge is never used twice, so it shuts out members that missed the end of a run, and
messages of earlier runs. It is no secret: every listener can copy it. To keep others
out, use the router's user names (`python -m rems_net.router --users`).
"""

from secrets import randbelow

_MEMBER_BITS = 24
#: Number of members that a run may have had, over its whole life.
MEMBERS = 2**_MEMBER_BITS
RUNS = 2**40


def new_run() -> int:
    """Return a number that no other run has."""
    return 1 + randbelow(RUNS - 1)


def badge_of(run: int, member: int) -> int:
    """Return the badge of this member of this run."""
    return run << _MEMBER_BITS | member


def run_of(badge: int) -> int:
    """Return the run that a badge belongs to."""
    return badge >> _MEMBER_BITS
