"""Find the router of a fabric by the notes in the user's runtime folder."""

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from rems_net.errors import FabricError, NoRouterError
from rems_net.router import notes
from rems_net.router.files import SESSION, check_files
from rems_net.router.finding import remembered
from rems_net.router.finding.address import (
    PORT,
    host_and_port,
    is_here,
    is_ipv4,
    to_endpoint,
)
from rems_net.router.finding.interfaces import source
from rems_net.router.gate.access import is_of_team
from rems_net.router.gate.identity import check_sees, identity, team_of
from rems_net.router.gate.refusal import listens
from rems_net.router.keys import FABRIC, check_name
from rems_net.router.session import Session
from rems_net.router.settings import Link

T = TypeVar("T")

#: number of ports after PORT that are tried before giving up
TRIES = 64
#: fabrics. A command asks at most so many fabrics of a router in parallel.
AT_ONCE = 32
VARIABLE, USER, PASSWORD = "REMS_ROUTER", "REMS_USER", "REMS_PASSWORD"


def open_session(fabric: str = "", at: str = "", *, own: bool = False) -> Session:
    """Join the fabric at `at`, else at the configured router, else the newest here.

    fabric: its name; "" for that of this user's team, where the router knows teams.
    Without a team it is the user's own, if anything runs on it or if `own`, and else
    the shared one.
    at: an endpoint, or a port of this machine, such as "7448". The session logs in as
    REMS_USER with REMS_PASSWORD if they are set; the router of a run has no users. The
    caller closes the session. Raises FabricError if there is none.
    """
    if fabric:
        check_name(fabric, "the fabric's name")
    if endpoint := chosen(at):
        user, password = credentials(endpoint)
        name = fabric or own_fabric(at)
        session = Session(Link(endpoint, fabric=name, user=user, password=password))
        session.open()
        try:
            if not fabric:
                return _of_user(session, own)
            check_sees(session)
        except FabricError:
            session.close()
            raise
        return session
    fabric = fabric or FABRIC
    foreign: FabricError | None = None
    for note in notes.find(fabric):
        try:
            joined = _join(note, fabric)
        except FabricError as error:
            foreign = foreign or error
            continue
        if joined is not None:
            return joined
        note.unlink(missing_ok=True)  # its process was killed
    if foreign is not None:
        raise foreign
    # A team's fabric is at the class's router, also while its laptops are away.
    for note in notes.find(FABRIC) if fabric != FABRIC else ():
        told = notes.read(note)
        if told is not None and told.served and (joined := _join(note, FABRIC)):
            return joined.on(fabric)
    raise NoRouterError(
        f"No fabric {fabric!r} is running on this machine. Start one with `rems run` "
        "or `rems demo --pace 1`, or go to that of a class with: rems router use "
        "ADDRESS (R0601)"
    )


def _of_user(session: Session, own: bool) -> Session:
    """Return the session on the fabric that its user is on: see `open_session`."""
    name = session.fabric
    if team := team_of(session):
        # Never the class's: a STOP of a team whose run is out of sight is no STOP of
        # everybody's robots.
        return session if is_of_team(team, name) else session.on(team)
    if own or name == FABRIC or session.who(f"{name}/clock/@alive"):
        return session
    return session.on(FABRIC)


def own_fabric(at: str = "") -> str:
    """Return the fabric of this user's runs: their own at a router that they joined."""
    joined = not at and not os.environ.get(VARIABLE) and remembered.router()
    return remembered.fabric() if joined else FABRIC


def fabrics(session: Session) -> list[str]:
    """Return the visible fabrics at this router that have a clock or a robot."""
    found = session.who("*/clock/@alive") + session.who("*/robot/*/@alive")
    names = {key.partition("/")[0] for key in found if key.isprintable()}
    known = identity(session)
    return sorted(name for name in names if known is None or known.may_see(name))


def on_each(
    session: Session, fabrics: Iterable[str], do: Callable[[Session], T]
) -> dict[str, T | FabricError]:
    """Return what `do` returns for each of these fabrics, or its error, by name.

    The fabrics are asked in parallel, so a frozen one delays no other.
    """

    def one(name: str) -> T | FabricError:
        try:
            return do(session.on(name))
        except FabricError as error:
            return error

    from concurrent.futures import ThreadPoolExecutor

    names = list(fabrics)
    with ThreadPoolExecutor(AT_ONCE) as pool:
        return dict(zip(names, pool.map(one, names), strict=True))


def others(session: Session) -> list[str]:
    """Return the endpoints of this user's other runs on this machine, newest first."""
    found = []
    for note in notes.find(session.fabric):
        with suppress(FabricError):  # another user's note: not our run
            told = notes.read(note)
            if told and told.endpoint != session.link.endpoint:
                found += [told.endpoint] if listens(told.endpoint) else []
    return found


def everywhere(do: Callable[[Session], T], fabric: str) -> dict[str, T | FabricError]:
    """Return what `do` returns for each run of this user here, or its error.

    The keys are endpoints, the newest first. All runs are asked in parallel, so a
    frozen one delays no other. Raises FabricError if there is none.
    """

    def one(note: Path) -> tuple[str, T | FabricError] | None:
        try:
            session = _join(note, fabric)
            if session is None:
                note.unlink(missing_ok=True)
                return None
            with session:
                return session.link.endpoint, do(session)
        except FabricError as error:
            return str(note), error

    from concurrent.futures import ThreadPoolExecutor

    found = notes.find(fabric)
    with ThreadPoolExecutor(max(1, len(found))) as pool:
        done = dict(told for told in pool.map(one, found) if told is not None)
    if done:
        return done
    with open_session(fabric) as session:
        return {session.link.endpoint: do(session)}


def over_loopback(endpoint: str, fabric: str = "", at: str = "") -> Session | None:
    """Open a session over the loopback with this user's router on this machine.

    endpoint: an address at which other machines reach that router. A flood from the
        network does not reach the loopback. fabric,
    at: as of `open_session`. Returns None if the router belongs to another user or runs
        on another machine.
    """
    host, port = host_and_port(endpoint)
    if not is_ipv4(host) or is_here(endpoint):
        return None
    for note, told in _notes_of(endpoint):
        if told.endpoint == f"tcp/127.0.0.1:{port}":
            with suppress(FabricError):  # frozen
                session = _join(note, fabric or own_fabric(at))
                if session is not None:
                    return session if fabric else _of_user(session, own=False)
    return None


def _notes_of(endpoint: str) -> Iterator[tuple[Path, notes.Note]]:
    """Yield the notes of this user's routers on this machine that listen at `endpoint`.

    endpoint: an address of this machine, its name, or the loopback.
    """
    host, port = host_and_port(endpoint)
    if is_here(endpoint) or (is_ipv4(host) and source(host) == host):
        for note in notes.all_of_them():
            with suppress(FabricError):  # another user's note
                told = notes.read(note)
                if told and told.endpoint in (endpoint, f"tcp/127.0.0.1:{port}"):
                    yield note, told


def chosen(at: str = "") -> str:
    """Return the endpoint of the router to use; "" for one on this machine.

    `at` wins over REMS_ROUTER, and REMS_ROUTER over `rems router use`. Raises
    FabricError if the value is not an address.
    """
    if at.isdecimal():
        return f"tcp/127.0.0.1:{at}"
    variable = os.environ.get(VARIABLE)
    if not (at or variable):
        return remembered.router()
    try:
        return to_endpoint(at or variable or "")
    except FabricError as error:
        raise FabricError(f"{'--at' if at else VARIABLE}: {error}") from None


def _join(note: Path, fabric: str) -> Session | None:
    """Open the session that a note describes; None if its router has gone.

    Another program may have the port by now, so the router's id is compared, too.
    Raises FabricError for another user's note, and for a router that does not answer.
    """
    told = notes.read(note)
    if told is None or not listens(told.endpoint):
        return None
    endpoint, router, user, password, _ = told
    session = Session(Link(endpoint, fabric=fabric, user=user, password=password))
    try:
        session.open()
    except FabricError:
        # The router may be frozen. That stops no robot, so the note stays.
        raise FabricError(
            f"Something listens at {endpoint}, where a run of yours has its router, "
            "and does not answer: is it frozen, by a debugger or by sleep? Go on with "
            f"it, or end it; if that port is another program's by now, remove {note}"
            " (R0601)"
        ) from None
    if router in session.routers():
        return session
    session.close()
    return None


def credentials(endpoint: str = "") -> tuple[str, str]:
    """Return the user name and password; two empty strings if there are none.

    They come from the environment, else from `rems router use` of this endpoint, else
    from the note of a router on this machine. Raises FabricError if only one of the two
    is set; no message contains a password.
    """
    user, password = os.environ.get(USER, ""), os.environ.get(PASSWORD, "")
    if bool(user) != bool(password):
        there, missing = (USER, PASSWORD) if user else (PASSWORD, USER)
        raise FabricError(
            f"{there} is set, and {missing} is not. Set both, for a router that was "
            "started with --users, or neither. (R0606)"
        )
    if user or not endpoint:
        return user, password
    known = remembered.credentials() if endpoint == remembered.router() else ("", "")
    owner = ((note.user, note.password) for _, note in _notes_of(endpoint))
    return known if known[0] else next(owner, known)


def serve(fabric: str = FABRIC) -> tuple[Session, Path]:
    """Open a session that is the router of its own fabric, on the loopback.

    Take port 7447 or the next free one, and leave a note for `open_session`. The caller
    closes the session and unlinks the note. Raises FabricError if no port is free, or
    if the note cannot be written.
    """
    # If these fail, they fail at every port.
    notes.folder()
    check_files(SESSION)
    for port in range(PORT, PORT + TRIES):
        session = Session(Link(f"tcp/127.0.0.1:{port}", serve=True, fabric=fabric))
        try:
            session.open()
        except FabricError:
            continue
        try:
            here = notes.Note(session.link.endpoint, session.id)
            note = notes.write(fabric, port, here)
        except FabricError:
            session.close()
            raise
        return session, note
    raise FabricError(
        f"None of the ports {PORT} to {PORT + TRIES - 1} on this machine is free for "
        f"a router. End some of the runs, or set {VARIABLE} to a running router."
        " (R0613)"
    )
