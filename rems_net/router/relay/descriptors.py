"""Descriptors: how many connections the system lets this process have."""

from __future__ import annotations

import sys

#: sessions of one router: as many as Zenoh takes
SESSIONS = 2000
#: descriptors of each session: the client's connection, and both ends of the one to
#: Zenoh
EACH = 3
#: descriptors of all else: files, Zenoh's own, connections that are not let in yet
REST = 600
#: sockets that `select` of Windows can look after, of which each session has two
WINDOWS = 512
#: sockets of Windows kept for connections that are not let in yet
SPARE = 112


def room() -> int:
    """Raise the soft limit if the system allows it; return how many sessions fit."""
    if sys.platform == "win32":
        return (WINDOWS - SPARE) // 2
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = SESSIONS * EACH + REST
    if hard != resource.RLIM_INFINITY:
        wanted = min(wanted, hard)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        try:
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
            soft = wanted
        except (OSError, ValueError):  # macOS has a lower limit of its own
            pass
    if soft == resource.RLIM_INFINITY:
        return SESSIONS
    return max(1, min(SESSIONS, (soft - REST) // EACH))
