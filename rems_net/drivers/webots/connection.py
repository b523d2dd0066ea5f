"""The one connection to Webots that a process can have, reused by its next agent."""

import os
from typing import Any

from rems_net.drivers.webots.installation import URL, controller
from rems_net.errors import AgentError

#: Webots' Supervisor: a process can make only one
_supervisor: Any = None
#: the robot of that connection, and the agent that uses it now
_where = _user = ""


def take(key: str, where: str) -> tuple[Any, bool]:
    """Return Webots' Supervisor of the robot at `where`, for the agent `key` alone,
    and whether this is the first use of the connection.

    Raises AgentError, and MissingPartError if Webots is not installed.
    """
    global _supervisor, _where, _user
    if _user:
        raise AgentError(
            key,
            f"{_user} is in the same process, and that can hold one robot of Webots. "
            "Give each a process of its own: take `host` away from both. (R0315)",
        )
    first = _supervisor is None
    if first:
        made = controller()
        if where:
            os.environ[URL] = where
        # It waits for Webots, and prints that itself, in Webots' words.
        print(f"{key}: connects to Webots, {where or 'the only extern robot'}")
        _supervisor, _where = made.Supervisor(), where
    elif where != _where:
        raise AgentError(
            key,
            f"this process holds the robot {_where!r} of Webots, and can never hold "
            f"another, {where!r}. Start it anew. (R0315)",
        )
    _user = key
    return _supervisor, first


def leave() -> None:
    """Free the connection for the next agent of this process."""
    global _user
    _user = ""
