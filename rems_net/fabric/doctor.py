"""Doctor: what is wrong between this laptop and a fabric, and what to do about it."""

from __future__ import annotations

import platform
import socket
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from statistics import median

from rems_net.errors import FabricError
from rems_net.router import notes
from rems_net.router.asking import printable
from rems_net.router.find import credentials, fabrics
from rems_net.router.finding.address import is_here
from rems_net.router.finding.interfaces import tunnels
from rems_net.router.finding.scouting import scout
from rems_net.router.gate.refusal import listens
from rems_net.router.session import Session
from rems_net.router.settings import Link

#: seconds to wait for a connection
PATIENCE = 3.0
#: questions whose round trips are measured
ASKED = 20
#: seconds of a round trip beyond which commands are felt to be late
SLOW = 0.1


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at: whether it is well, and what to do if not."""

    well: bool
    sentence: str

    def __str__(self) -> str:
        return f"{'ok  ' if self.well else 'BAD '} {self.sentence}"


def examine(endpoint: str) -> Iterator[Finding]:
    """Look at this laptop and, where there is an endpoint, at the router there.

    Stops at the first thing without which nothing that follows can work.
    """
    yield Finding(
        True,
        f"Python {platform.python_version()}, rems_net {version('rems-net')}, zenoh "
        f"{version('eclipse-zenoh')} on {sys.platform}",
    )
    try:
        notes.folder()
    except FabricError as error:
        yield Finding(False, str(error))
        return
    if not endpoint:
        yield from _here()
        return
    yield from _there(endpoint)


def _here() -> Iterator[Finding]:
    """No router was told: there is one where something runs on this laptop."""
    endpoints = []
    for note in notes.all_of_them():
        told = notes.read(note)
        if told and listens(told[0]):
            endpoints.append(told[0])
    if not endpoints:
        yield Finding(
            True,
            "nothing runs on this laptop, and no router was joined. `rems run` and "
            "`rems demo` bring one; for a class: rems join ADDRESS",
        )
    for endpoint in endpoints:
        yield from _there(endpoint)


def _there(endpoint: str) -> Iterator[Finding]:
    trouble = _tcp(endpoint)
    if trouble:
        yield Finding(False, trouble)
        if up := tunnels():
            yield Finding(
                False,
                f"a VPN is on ({', '.join(up)}), which may hide the network of this "
                "room; turn it off and try again",
            )
        return
    yield Finding(True, f"{endpoint} takes connections")
    user, password = credentials(endpoint)
    link = Link(endpoint, timeout=PATIENCE, user=user, password=password)
    session = Session(link)
    try:
        session.open()
    except FabricError as error:
        yield Finding(False, _stranger(endpoint) or str(error))
        return
    with session:
        yield Finding(True, f"it is a router, {session.routers()[0]}")
        names = fabrics(session)
        for name in names:
            yield from _clocks(session, name)
            yield _round_trip(session.on(name))
        if not names:
            yield Finding(True, "no fabric has a clock there yet (`rems serve`)")
    if not is_here(endpoint):
        yield _multicast()


def _tcp(endpoint: str) -> str:
    """Why no connection can be made; nothing where one can."""
    protocol, _, rest = endpoint.partition("#")[0].partition("/")
    host, _, port = rest.rpartition(":")
    host = host.strip("[]")
    if protocol not in ("tcp", "tls", "ws"):
        return ""  # others make no connection that could be tried
    try:
        with socket.create_connection((host, int(port)), PATIENCE):
            return ""
    except socket.gaierror:
        return (
            f"nobody knows the name {host!r} on this network: type the router's "
            "address, as `rems serve` prints it"
        )
    except ConnectionRefusedError:
        return (
            f"{host} is there, and nothing listens at port {port}: start `rems serve` "
            "or `python -m rems_net.router` on it, or mind the port"
        )
    except TimeoutError:
        return (
            f"{host} does not answer at port {port} for {PATIENCE:g} s: it is off or "
            "has another address now, its firewall blocks the port (allow Python "
            "there), or this Wi-Fi keeps laptops apart: use a hotspot or an access "
            "point of your own"
        )
    except OSError as error:
        return (
            f"{host} can't be reached from this network ({error.strerror}): are both "
            "laptops in the same Wi-Fi?"
        )


def _stranger(endpoint: str) -> str:
    """Who else has the port; nothing where that can't be told."""
    host, _, port = endpoint.partition("#")[0].partition("/")[2].rpartition(":")
    try:
        with socket.create_connection((host.strip("[]"), int(port)), 1.0) as line:
            line.settimeout(1.0)
            line.sendall(b"GET / HTTP/1.0\r\n\r\n")
            said = line.recv(200)
    except OSError:
        return ""
    if said.startswith(b"HTTP/"):
        return f"{endpoint} is a web server, and no router: mind the port (7447)"
    if said:
        first = printable(said.decode(errors="replace").splitlines()[0])[:40]
        return f"{endpoint} is another program, and no router: it says {first!r}"
    return ""


def _clocks(session: Session, fabric: str) -> Iterator[Finding]:
    runs = session.who(f"{fabric}/clock/@run/*")
    if len(runs) > 1:
        yield Finding(
            False,
            f"fabric {fabric!r} has {len(runs)} clocks, so agents hear two times: end "
            "one of them, or give it a --fabric of its own",
        )
    elif runs:
        yield Finding(True, f"fabric {fabric!r} has one clock")
    else:
        yield Finding(
            False,
            f"fabric {fabric!r} has robots and no clock: they stand still until "
            "`rems serve` or `rems run` starts one",
        )


def _round_trip(session: Session) -> Finding:
    """How long a question to the clock takes, which answers in Zenoh's own thread."""
    took = []
    for _ in range(ASKED):
        begun = time.monotonic()
        if session.ask(session.key("clock", "@age"), timeout=1.0, first=True):
            took.append(time.monotonic() - begun)
    if not took:
        return Finding(
            False,
            f"the clock of {session.fabric!r} does not answer: it is frozen, or cut "
            "off",
        )
    middle, worst, lost = median(took), max(took), ASKED - len(took)
    return Finding(
        middle < SLOW and not lost,
        f"a question to its clock takes {1000 * middle:.1f} ms, at worst "
        f"{1000 * worst:.1f} ms; {lost} of {ASKED} had no answer"
        + (": the network is slow; go nearer to it" if middle >= SLOW or lost else ""),
    )


def _multicast() -> Finding:
    found = scout()
    how = "passes" if found else "does not pass, so `rems join` alone finds nobody"
    return Finding(True, f"multicast {how}; nothing needs it")
