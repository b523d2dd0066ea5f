"""Doctor: faults between this laptop and a fabric, and what to do about them."""

import platform
import sys
from collections.abc import Iterator
from importlib.metadata import version

import rems_net
from rems_net.client.checkup import Finding, check_up
from rems_net.errors import FabricError
from rems_net.router import notes
from rems_net.router.find import credentials, fabrics
from rems_net.router.finding.address import is_here
from rems_net.router.finding.interfaces import tunnels
from rems_net.router.finding.scouting import scout
from rems_net.router.finding.way import CONNECT_TIMEOUT, trouble, tunnel_to
from rems_net.router.gate.refusal import listens
from rems_net.router.session import Session
from rems_net.router.settings import Link


def examine(endpoint: str) -> Iterator[Finding]:
    """Examine this laptop and, if there is an endpoint, the router there.

    Stop at the first fault that makes all further tests fail.
    """
    yield _versions()
    try:
        notes.folder()
    except FabricError as error:
        yield Finding(False, str(error))
        return
    if not endpoint:
        yield from _here()
        return
    yield from _there(endpoint)


def examine_joined(session: Session) -> Iterator[Finding]:
    """Examine the fabric of an open session, with the rights of its user."""
    yield _versions()
    endpoint = session.link.endpoint
    if not session.connected:
        yield Finding(False, trouble(endpoint) or f"{endpoint} does not answer")
        return
    yield Finding(True, f"{endpoint} is a router, {session.routers()[0]}")
    yield from check_up(session)


def _versions() -> Finding:
    return Finding(
        True,
        f"Python {platform.python_version()}, rems_net {rems_net.__version__}, zenoh "
        f"{version('eclipse-zenoh')} on {sys.platform}",
    )


def _here() -> Iterator[Finding]:
    """Examine the routers of this laptop's runs, if no router is configured."""
    endpoints = []
    for note in notes.all_of_them():
        told = notes.read(note)
        if told and listens(told.endpoint):
            endpoints.append(told.endpoint)
    if not endpoints:
        yield Finding(
            True,
            "nothing runs on this laptop, and no router was joined. `rems run` and "
            "`rems demo` bring one; for a class: rems router use ADDRESS",
        )
    for endpoint in endpoints:
        yield from _there(endpoint)


def _there(endpoint: str) -> Iterator[Finding]:
    away = not is_here(endpoint)
    through = tunnel_to(endpoint) if away else None
    why = trouble(endpoint)
    if why and through:
        yield Finding(
            False,
            f"the way there leads into a VPN ({through.adapter}), and ends in it: turn "
            "it off, and try again",
        )
        return
    if why:
        yield Finding(False, why)
        if up := tunnels() if away else []:
            yield Finding(
                False,
                f"a VPN is on ({', '.join(up)}), which may hide the network of this "
                "room; turn it off and try again",
            )
        return
    yield Finding(True, f"{endpoint} takes connections")
    if through:
        yield Finding(
            True,
            f"the way there leads through a VPN ({through.adapter}); without it, it "
            "may be shorter",
        )
    user, password = credentials(endpoint)
    session = Session(
        Link(endpoint, timeout=CONNECT_TIMEOUT, user=user, password=password)
    )
    try:
        session.open()
    except FabricError as error:
        yield Finding(False, str(error))
        return
    with session:
        yield Finding(True, f"it is a router, {session.routers()[0]}")
        names = fabrics(session)
        for name in names:
            yield from check_up(session.on(name))
        if not names:
            yield Finding(True, "no fabric has a clock there yet (`rems router serve`)")
    if away:
        yield _multicast(endpoint)


def _multicast(endpoint: str) -> Finding:
    found = scout()
    if endpoint in found:
        return Finding(True, "multicast passes: `rems router use` alone finds it")
    return Finding(
        True,
        "multicast does not pass, so `rems router use` alone does not find it; "
        "nothing else needs it",
    )
