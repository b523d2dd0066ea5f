"""The one connection to Webots that a process can have, kept for whoever is next."""

import os
from typing import Any

from rems_net.drivers.webots.installation import URL, controller
from rems_net.errors import AgentError

#: Webots lets a process make one, and never another
_supervisor: Any = None
#: which robot that is, and which agent has it now
_where = _user = ""


def take(key: str, where: str) -> tuple[Any, bool]:
    """Return Webots' Supervisor of the robot at `where`, for the agent `key` alone,
    and whether nobody had it before.

    Raises AgentError, and MissingPartError where Webots is not installed.
    """
    global _supervisor, _where, _user
    if _user:
        raise AgentError(
            key,
            f"{_user} is in the same process, and that can hold one robot of Webots. "
            "Give each a process of its own: take `host` away from both.",
        )
    first = _supervisor is None
    if first:
        made = controller()
        if where:
            os.environ[URL] = where
        # It waits for Webots, and says so itself, in Webots' words.
        print(f"{key}: connects to Webots, {where or 'the only extern robot'}")
        _supervisor, _where = made.Supervisor(), where
    elif where != _where:
        raise AgentError(
            key,
            f"this process holds the robot {_where!r} of Webots, and can never hold "
            f"another, {where!r}. Start it anew.",
        )
    _user = key
    return _supervisor, first


def leave() -> None:
    """Let the next agent of this process have it."""
    global _user
    _user = ""
