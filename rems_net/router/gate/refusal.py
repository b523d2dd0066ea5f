"""Reasons why a session could not be opened: Zenoh's message is always the same."""

import errno
import re
import socket
import time

from rems_net.errors import FabricError, NoRouterError
from rems_net.router.finding.address import host_and_port
from rems_net.router.gate.probe import stranger
from rems_net.router.settings import Link

#: s. Time for a connection that loses its first packet or two.
FAR = 3.5
#: s. A slower connection crosses a network; a slow network.
NETWORK, SLOW = 0.005, 0.1


def cannot_open(link: Link, error: Exception) -> FabricError:
    """Return the error to raise, without any password."""
    system = "os error" in str(error)
    if isinstance(error, OSError):
        system = error.errno != errno.EADDRNOTAVAIL
    if link.serve and system and listens(link.endpoint):
        return FabricError(
            f"Cannot be the router at {link.endpoint}: another program has this port, "
            "such as a run of yours. End it, or listen at another port. (R0613)"
        )
    if link.serve:
        words = error.strerror if isinstance(error, OSError) else str(error)
        # Zenoh adds its source line, and Python the socket.
        reason = re.sub(r" at /\S+| \(while .*", "", words or "").rstrip(".")
        return FabricError(
            f"Cannot be the router at {link.endpoint}: {reason}. (R0613)"
        )
    trip = reach(link.endpoint, FAR)
    if trip is None:
        return NoRouterError(
            f"No router answers at {link.endpoint}. Start one there (`rems router "
            "serve` or `python -m rems_net.router`; that of a `rems run` takes its "
            "own machine only); `rems why` shows more. If that was the class's, and "
            "you are not there, type: rems router forget (R0601)"
        )
    if who := stranger(link.endpoint):
        return FabricError(f"{who}. (R0605)")
    if link.user:
        low, hint = link.user.lower(), ""
        if link.user != low:
            hint = f" The names of a class list have small letters: {low}."
        return FabricError(
            f"The router at {link.endpoint} does not let {link.user!r} in: the name or "
            "the password is wrong; type `rems router use` with --user once more, or "
            f"set REMS_USER and REMS_PASSWORD to yours.{hint} If it is open, "
            "forget them: rems router forget, or unset REMS_USER REMS_PASSWORD (R0606)"
        )
    slow = ""
    if trip > SLOW:
        slow = f" Or the network is too slow: a connection takes {trip:.1f} s."
    return FabricError(
        f"Something listens at {link.endpoint}, but does not let this program in. A "
        "router with a class list needs your name: type `rems router use` with "
        f"--user NAME, or set REMS_USER and REMS_PASSWORD to yours.{slow} (R0606)"
    )


def listens(endpoint: str) -> bool:
    """Return whether anything accepts connections there."""
    return reach(endpoint) is not None


def is_far(endpoint: str) -> bool:
    """Return whether a network lies between here and that endpoint."""
    trip = reach(endpoint, FAR)
    return trip is not None and trip > NETWORK


def reach(endpoint: str, timeout: float = 0.5) -> float | None:
    """Return the time to connect to an endpoint, s; None if nothing listens there."""
    begun = time.monotonic()
    try:
        host, port = host_and_port(endpoint)
        host = host.replace("0.0.0.0", "127.0.0.1")
        with socket.create_connection((host, port), timeout=timeout):
            return time.monotonic() - begun
    except (OSError, ValueError):
        return None
