"""Finding the router without being told: notes in the user's runtime folder."""

from __future__ import annotations

import os
import socket
from pathlib import Path

from rems_net.errors import FabricError
from rems_net.router import notes
from rems_net.router.keys import FABRIC
from rems_net.router.session import Session
from rems_net.router.settings import Link

PORT = 7447
#: how many ports after PORT are tried before giving up
TRIES = 64
VARIABLE = "REMS_ROUTER"


def open_session(fabric: str = FABRIC) -> Session:
    """Join the fabric at REMS_ROUTER, or the running one on this machine.

    The caller closes the session. Raises FabricError if there is none.
    """
    told = os.environ.get(VARIABLE)
    if told:
        session = Session(Link(check_endpoint(told), fabric=fabric))
        session.open()
        return session
    foreign: FabricError | None = None
    for note in notes.find(fabric):
        try:
            joined = _join(note, fabric)
        except FabricError as error:
            foreign = foreign or error
            continue
        if joined is not None:
            return joined
        note.unlink(missing_ok=True)  # left by a process that was killed
    if foreign is not None:
        raise foreign
    raise FabricError(
        f"No fabric {fabric!r} is running on this machine. Start one with `rems run` "
        f"or `rems demo --pace 1`, or set {VARIABLE} to the endpoint of a router, "
        "such as tcp/192.168.1.20:7447."
    )


def _join(note: Path, fabric: str) -> Session | None:
    """The session that a note leads to; None when its router is no more.

    Another program may have its port by now, so the router must be the very one.
    Raises FabricError for a note that is not ours.
    """
    told = notes.read(note)
    if told is None or not _listens(told[0]):
        return None
    endpoint, router = told
    session = Session(Link(endpoint, fabric=fabric))
    try:
        session.open()
    except FabricError:
        return None
    if router in session.routers():
        return session
    session.close()
    return None


def check_endpoint(text: str) -> str:
    """Return `text` if it looks like a Zenoh endpoint, else say how one looks.

    Raises FabricError.
    """
    protocol, slash, address = text.partition("/")
    host, colon, port = address.partition("#")[0].rpartition(":")
    if slash and colon and host and port.isdigit() and protocol.isalnum():
        return text
    raise FabricError(
        f"{VARIABLE} is {text!r}, which is not an endpoint; expected "
        "<protocol>/<address>:<port>, such as tcp/192.168.1.20:7447."
    )


def serve(fabric: str = FABRIC) -> tuple[Session, Path]:
    """Open a session that is the router of its own fabric, on the loopback.

    Takes port 7447 or the next free one, and leaves a note for `open_session`; the
    caller closes the session and unlinks the note. Raises FabricError if no port is
    free, or no note can be left.
    """
    notes.folder()  # what is wrong with it is told before anything is open
    for port in range(PORT, PORT + TRIES):
        session = Session(Link(f"tcp/127.0.0.1:{port}", serve=True, fabric=fabric))
        try:
            session.open()
        except FabricError:
            continue
        try:
            note = notes.write(fabric, port, session.link.endpoint, session.id)
        except FabricError:
            session.close()
            raise
        return session, note
    raise FabricError(
        f"None of the ports {PORT} to {PORT + TRIES - 1} on this machine is free for "
        f"a router. End some of the runs, or set {VARIABLE} to a running router."
    )


def _listens(endpoint: str) -> bool:
    host, _, port = endpoint.partition("/")[2].rpartition(":")
    try:
        with socket.create_connection((host, int(port)), timeout=0.5):
            return True
    except (OSError, ValueError):
        return False
