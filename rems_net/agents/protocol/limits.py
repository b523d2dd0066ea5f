"""Limits that the clock and its hosts share; `docs/time.md` has them in a table."""

from __future__ import annotations

#: How many ticks a fast clock is ahead of its slowest host. Values carry their ticks,
#: so nobody reads anything else than in single file; and nobody waits for the clock.
AHEAD = 8
#: seconds it may take to let an agent in, of which a host may have thousands
JOIN_TIME_EACH = 0.02
#: seconds a member may be out of sight, where nobody says otherwise
PATIENCE = 30.0

#: the exit status of a host that was not let in, given up, or whose clock is gone: no
#: crash, so it is not started again
OVER, OVER_SAID = 3, "has ended; the line above says why"


def backoff(count: int) -> float:
    """Seconds before a process is started for the `count`-th time again."""
    return min(0.5 * 2.0 ** (count - 1), 10.0)


#: agents of one host; ports and sources of one agent
AGENTS, PORTS, SOURCES = 20_000, 100, 1_000
#: characters of a name on a machine, of a source, of a cause
NAME, SOURCE, CAUSE = 255, 300, 4_000
#: files that a host may have made, and characters of their paths
FILES, PATH = 50_000, 4_096
#: bytes of a schema's description
SCHEMA = 1_000_000
