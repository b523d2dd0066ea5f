"""The way to a router: whether its port can be reached, and if not, where packets end.

All findings come from attempts to connect and from the system's own routes: nothing
needs root, or a program that listens.
"""

import errno
import re
import socket
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from rems_net.router.finding.address import host_and_port
from rems_net.router.finding.interfaces import Place, place, source

#: s. Time to wait for a connection, and for any reaction of a neighbour.
CONNECT_TIMEOUT, GLANCE = 3.0, 1.0
#: s. A faster "unreachable" is a firewall's refusal: a missing host takes longer.
SOON = 0.5
#: ports at which a machine, or a network's gateway, accepts or refuses if it is on
_MACHINE, _GATEWAY = (9, 22, 80, 445), (53, 80, 443)
#: advice for a firewall
ALLOW = "allow Python on it"
#: advice if the Wi-Fi keeps laptops apart
APART = (
    "this Wi-Fi keeps laptops apart (client isolation): use a hotspot or an access "
    "point of your own"
)


def trouble(endpoint: str) -> str:
    """Return why no connection can be made; "" if one can, or if it cannot be tried."""
    if endpoint.partition("/")[0] not in ("tcp", "tls", "ws"):
        return ""
    host, port = host_and_port(endpoint)
    begun = time.monotonic()
    try:
        with socket.create_connection((host, port), CONNECT_TIMEOUT):
            return ""
    except (socket.gaierror, UnicodeError):
        return (
            f"nobody knows the name {host!r} on this network: type the router's "
            "address, as `rems router serve` prints it"
        )
    except ConnectionRefusedError:
        return (
            f"{host} is there, and nothing listens at port {port}: start `rems router "
            "serve` or `python -m rems_net.router` on it, or mind the port. If it "
            f"runs there, a firewall refuses what comes: {ALLOW}"
        )
    except TimeoutError:
        return _silent(host, port)
    except OSError as error:
        if error.errno == errno.EHOSTUNREACH and time.monotonic() - begun < SOON:
            return f"a firewall refuses what comes to port {port} of {host}: {ALLOW}"
        if error.errno == errno.EHOSTUNREACH:
            return _silent(host, port)
        return (
            f"{host} can't be reached from this network ({error.strerror}): are both "
            "laptops in the same Wi-Fi?"
        )


def _silent(host: str, port: int) -> str:
    """Return the likely reason if there is no reaction at all."""
    if answers(host, _MACHINE):
        return (
            f"{host} is there, and lets nobody in at port {port}: its firewall drops "
            f"what comes; {ALLOW}"
        )
    mine = place(source(host))
    if mine is None or host not in mine:
        where = f" ({mine.network})" if mine else ""
        return (
            f"{host} does not answer, and is not on the network of this laptop{where}: "
            "are both in the same Wi-Fi? If they are, it has another address by now: "
            "see what `rems router serve` prints"
        )
    gate = gateway()
    if gate and gate != host and gate in mine and answers(gate, _GATEWAY):
        return (
            f"{host} does not answer, and {gate}, the gateway of this network "
            f"({mine.network}), does: {host} is off or has another address now (see "
            f"`rems router serve`), its firewall drops what comes ({ALLOW}), or "
            f"{APART}"
        )
    return (
        f"{host} does not answer at port {port}: it is off or has another address now, "
        f"its firewall blocks the port ({ALLOW}), or {APART}"
    )


def answers(host: str, ports: tuple[int, ...]) -> bool:
    """Return whether a machine reacts, even by a refusal, at one of these TCP ports."""

    def one(port: int) -> bool:
        try:
            with socket.create_connection((host, port), GLANCE):
                return True
        except ConnectionRefusedError:
            return True
        except OSError:
            return False

    with ThreadPoolExecutor(len(ports)) as pool:
        return any(pool.map(one, ports))


def tunnel_to(endpoint: str) -> Place | None:
    """Return the VPN through which the way to a router leads, or None."""
    found = place(source(host_and_port(endpoint)[0]))
    return found if found and found.tunnel else None


def gateway() -> str:
    """Return the address of this machine's default gateway; "" if unknown."""
    try:
        return _of_linux(Path("/proc/net/route").read_text(encoding="ascii"))
    except OSError:
        pass
    try:  # Windows and macOS print the route in a form that a pattern can read.
        told = subprocess.run(
            ["netstat", "-rn"],
            capture_output=True,
            text=True,
            errors="replace",  # its words have letters of another encoding on Windows
            timeout=5,
            check=False,
        )
    except (OSError, subprocess.SubprocessError, ValueError):
        return ""
    return _of_netstat(told.stdout)


def _of_linux(table: str) -> str:
    """Read `eth0 00000000 0101A8C0 0003 ...`: destination, gateway, low byte first."""
    for line in table.splitlines()[1:]:
        words = line.split()
        if len(words) > 2 and words[1] == "00000000" and words[2] != "00000000":
            return socket.inet_ntoa(bytes.fromhex(words[2])[::-1])
    return ""


def _of_netstat(table: str) -> str:
    """Read `default 192.168.1.1 ...` of macOS, `0.0.0.0 0.0.0.0 192.168.1.1 ...`."""
    way = r"^\s*(?:default|0\.0\.0\.0\s+0\.0\.0\.0)\s+([0-9]+(?:\.[0-9]+){3})\b"
    found = re.search(way, table, re.MULTILINE)
    return found[1] if found else ""
