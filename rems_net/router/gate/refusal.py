"""Why a session could not be opened: Zenoh says the same words of all cases."""

from __future__ import annotations

import re
import socket

from rems_net.errors import FabricError
from rems_net.router.settings import Link


def cannot_open(link: Link, error: Exception) -> FabricError:
    """The error to raise. It never says a password."""
    if link.serve and "os error" in str(error) and listens(link.endpoint):
        return FabricError(
            f"Cannot be the router at {link.endpoint}: another program has this port, "
            "such as a run of yours. End it, or listen at another port."
        )
    if link.serve:
        reason = re.sub(r" at /\S+", "", str(error)).rstrip(".")
        return FabricError(f"Cannot be the router at {link.endpoint}: {reason}.")
    if not listens(link.endpoint):
        return FabricError(
            f"No router answers at {link.endpoint}. Start one (`rems run` and "
            "`rems demo` bring their own, `python -m rems_net.router` is one for a "
            "class), or set REMS_ROUTER to where it is. If that was the class's, and "
            "you are not there, type: rems leave"
        )
    if link.user:
        return FabricError(
            f"The router at {link.endpoint} does not let {link.user!r} in: the name or "
            "the password is wrong; type `rems join` with --user once more, or set "
            "REMS_USER and REMS_PASSWORD to yours. If it lets everybody in, forget "
            "them: rems leave, or unset REMS_USER REMS_PASSWORD"
        )
    return FabricError(
        f"Something listens at {link.endpoint}, but does not let this program in. A "
        "router with a class list wants to know who comes: type `rems join` with "
        "--user NAME, or set REMS_USER and REMS_PASSWORD to yours."
    )


def listens(endpoint: str) -> bool:
    """Whether anything takes connections there."""
    host, _, port = endpoint.partition("/")[2].partition("#")[0].rpartition(":")
    host = host.replace("0.0.0.0", "127.0.0.1")
    try:
        with socket.create_connection((host.strip("[]"), int(port)), timeout=0.5):
            return True
    except (OSError, ValueError):
        return False
