"""Receiving: a machine asks a run what to bring, and for the files, piece by piece."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from threading import Event

from rems_net.agents.protocol.alike import laptop
from rems_net.agents.protocol.limits import CAUSE, PIECE
from rems_net.agents.protocol.placement import Caller, File, Offer, read_offer
from rems_net.errors import ExperimentError, FabricError, WireError
from rems_net.router.mail import Mailbox
from rems_net.router.session import Session

#: seconds for an answer, of a busy network; and how often it is asked
PATIENCE, TRIES = 10.0, 3
#: seconds between two looks at who waits
LOOK = 1.0


def wait_for_run(
    session: Session, machine: str, fabric: str, tell: Callable[[str], None]
) -> Session:
    """The session on the fabric of the run that waits for `machine`.

    fabric: its name; "" for any, where one alone waits. Waits for ever.
    Raises ExperimentError where several wait.
    """
    box = Mailbox()
    scope = fabric or "*"
    watch = session.watch_presence(f"{scope}/machine/{machine}/@start", box)
    told = False
    try:
        while not (found := waiting(session, machine, scope)):
            if not told:
                told = True
                tell(
                    f"no run at {session.link.endpoint} waits for machine {machine} "
                    "yet; waiting, until one does (Ctrl+C ends it)"
                )
            box.get(LOOK)
    finally:
        watch.close()
    if len(found) > 1:
        raise ExperimentError(
            f"{len(found)} runs wait for a machine {machine}, on the fabrics "
            f"{', '.join(found)}; say which, by --fabric."
        )
    return session.on(found[0])


def waiting(session: Session, machine: str, scope: str = "*") -> list[str]:
    """The fabrics on which a run waits for `machine`."""
    tokens = session.who(f"{scope}/machine/{machine}/@start")
    return sorted({key.partition("/")[0] for key in tokens if key.isprintable()})


def wait_for_end(session: Session, machine: str) -> None:
    """Return when the run of this session's fabric no longer waits for `machine`."""
    while waiting(session, machine, session.fabric):
        Event().wait(LOOK)


def ask_offer(session: Session, machine: str) -> Offer:
    """What the run wants of `machine`. Raises FabricError, or WireError."""
    key = session.key("machine", machine, "@start")
    for _ in range(TRIES):
        payload = Caller(laptop(), "").to_wire()
        for mail in session.ask(key, payload, PATIENCE, first=True):
            return read_offer(mail.payload)
    raise FabricError(f"the run on {session.fabric!r} does not say what to bring.")


def say_trouble(session: Session, machine: str, sentence: str) -> None:
    """Tell the run why `machine` can't bring what it wants."""
    payload = Caller(laptop(), sentence[:CAUSE]).to_wire()
    session.ask(session.key("machine", machine, "@start"), payload, first=True)


def receive(session: Session, machine: str, offer: Offer, folder: Path) -> None:
    """Put all files of an offer below `folder`. Raises FabricError, or WireError."""
    for name, file in offer.files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(_bytes_of(session, machine, name, file))


def _bytes_of(session: Session, machine: str, name: str, file: File) -> bytes:
    data = b""
    while len(data) < file.size:
        key = session.key("machine", machine, "@file", file.digest)
        piece = _ask(session, f"{key}?part={len(data) // PIECE}")
        if len(piece) != min(PIECE, file.size - len(data)):
            raise WireError(f"{name} came in a piece of {len(piece)} bytes.")
        data += piece
    if hashlib.sha256(data).hexdigest() != file.digest:
        raise WireError(f"{name} is not what the run has: another SHA-256 came.")
    return data


def _ask(session: Session, key: str) -> bytes:
    for _ in range(TRIES):
        for mail in session.ask(key, timeout=PATIENCE, first=True):
            return mail.payload
    raise FabricError("the run does not send its files: is it over, or cut off?")
