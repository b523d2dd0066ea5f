"""Descriptors: the number of connections that the system allows this process."""

import sys
from typing import NamedTuple

from rems_net.router.relay.limits import OF_ALL, OF_OURS

#: sessions of one router: as many as Zenoh takes
SESSIONS = 2000
#: descriptors of a session: the client's connection, both ends of the one to Zenoh
EACH = 3
#: descriptors of everything else: files, pipes, Zenoh's own
REST = 200
#: Connections that are not let in yet have at most 1/24 (other machines) and 1/96 (this
#: one) of all descriptors.
OTHERS, OURS = 24, 96


class Room(NamedTuple):
    """Room for sessions, and for connections of others and ours not yet let in."""

    sessions: int
    others: int
    ours: int


#: `select` of Windows handles 512 sockets; a session has two
WINDOWS = Room(sessions=200, others=32, ours=16)


def room() -> Room:
    """Raise the soft limit of descriptors if the system allows it; return what fits."""
    if sys.platform == "win32":
        return WINDOWS
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = (SESSIONS + OF_ALL + OF_OURS) * EACH + REST
    if soft != resource.RLIM_INFINITY and soft < wanted:
        more = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
        try:
            resource.setrlimit(resource.RLIMIT_NOFILE, (more, hard))
            soft = more
        except (OSError, ValueError):  # macOS has another limit below the hard one
            pass
    return fitting(wanted if soft == resource.RLIM_INFINITY else soft)


def fitting(descriptors: int) -> Room:
    """Return what fits into so many descriptors."""
    others = min(OF_ALL, max(1, descriptors // OTHERS))
    ours = min(OF_OURS, max(1, descriptors // OURS))
    left = (descriptors - REST) // EACH - others - ours
    return Room(min(SESSIONS, max(1, left)), others, ours)
