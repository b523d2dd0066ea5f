"""Limits that the clock and its hosts share; `docs/time.md` has them in a table."""

from rems_net.errors import ExperimentError, nearest

#: Times real time: slowest and fastest pace of a run, and of a recording that plays.
PACES = (0.001, 10_000.0)
#: s. Shortest `dt`; and longest real time of a tick, `dt` divided by the pace.
SHORTEST, LONGEST = 1e-9, 3600.0

#: Ticks that a fast clock may be ahead of its slowest host. Values carry their ticks,
#: so they are still read in order, and no host waits for the clock.
AHEAD = 16
#: s. Time to admit one agent, of which a host may have thousands.
JOIN_TIME_EACH = 0.02
#: s. Time for hosts to join, counted from the last one that did; and for those that
#: people start on another machine, by default.
JOIN_TIME, WAIT_START = 30.0, 300.0
#: s. A member may be out of sight this long, by default.
WAIT_BACK = 30.0


def check_pace(value: object, dt: float = 0.0) -> float:
    """Return a real-time factor; 0.0 for "fast".

    dt: s of a tick, if it is known: a tick may take LONGEST s of real time.
    Raises ExperimentError.
    """
    if value == "fast":
        return 0.0
    low, high = PACES
    try:
        number = float(value) if isinstance(value, int | float | str) else 0.0
    except (ValueError, OverflowError):
        number = 0.0
    if isinstance(value, bool) or not low <= number <= high:
        raise ExperimentError(
            f'pace is {value!r:.40}; expected "fast" or a factor of real time, {low:g} '
            f"to {high:g}, such as 1.0.{nearest(value, ['fast'])} (R0408)"
        )
    if dt / number > LONGEST:
        raise ExperimentError(
            f"pace is {value!r}: a tick of {dt:g} s would take {dt / number:g} s of "
            f"real time; expected {LONGEST:g} s at most, which is a pace of "
            f"{dt / LONGEST:g} (R0408)"
        )
    return number


#: Exit status of a host that was not admitted, was given up, or lost its clock. This is
#: no crash, so it is not started again.
OVER, OVER_SAID = 3, "has ended: its run is over, or its router was lost"


def backoff(count: int) -> float:
    """Return the seconds before a process is started for the `count`-th time again."""
    return min(0.5 * 2.0 ** (count - 1), 10.0)


#: Numbers of agents of one host; of ports and of sources of one agent.
AGENTS, PORTS, SOURCES = 20_000, 100, 1_000
#: Characters of a name on a machine, of a source, of a cause.
NAME, SOURCE, CAUSE = 255, 300, 4_000
#: Characters of a host's numerics, and of a lease holder's name.
NUMERICS, HOLDER = 300, 100
#: Number of files that a host may have made, and characters of their paths.
FILES, PATH = 50_000, 4_096
#: Bytes of a schema's description.
SCHEMA = 1_000_000
#: Numbers of processes that a machine starts for a run, of its files, of folders.
HOSTS, SENT, DEPTH = 100, 200, 8
#: Bytes of all files that a machine is sent, and of one piece of a file.
FILE_BYTES, PIECE = 64 * 2**20, 2**20
