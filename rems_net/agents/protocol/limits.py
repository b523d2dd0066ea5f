"""Limits that the clock and its hosts share; `docs/time.md` has them in a table."""

#: How many ticks a fast clock is ahead of its slowest host. Values carry their ticks,
#: so nobody reads anything else than in single file; and nobody waits for the clock.
AHEAD = 8
#: seconds it may take to let an agent in, of which a host may have thousands
JOIN_TIME_EACH = 0.02
#: seconds the hosts have to join, from the last one that did; and those that somebody
#: starts on another machine
JOIN_TIME, WAIT = 30.0, 300.0
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
#: characters that say what a host computes with, and who holds a lease
NUMERICS, HOLDER = 300, 100
#: files that a host may have made, and characters of their paths
FILES, PATH = 50_000, 4_096
#: bytes of a schema's description
SCHEMA = 1_000_000
#: processes that a machine starts for a run, files that it is sent, folders of a name
HOSTS, SENT, DEPTH = 100, 200, 8
#: bytes of all files that a machine is sent, and of one piece of a file
FILE_BYTES, PIECE = 64 * 2**20, 2**20
