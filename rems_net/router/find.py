"""Finding the router without being told: notes in the user's runtime folder."""

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
from rems_net.router.gate.refusal import listens
from rems_net.router.gate.standing import check_sees, standing
from rems_net.router.keys import FABRIC, check_name
from rems_net.router.session import Session
from rems_net.router.settings import Link

T = TypeVar("T")

#: how many ports after PORT are tried before giving up
TRIES = 64
#: fabrics that are asked at once
AT_ONCE = 32
VARIABLE, USER, PASSWORD = "REMS_ROUTER", "REMS_USER", "REMS_PASSWORD"


def open_session(fabric: str = "", at: str = "") -> Session:
    """Join the fabric at `at`, else at the router that is told, else the newest here.

    fabric: its name; without one, that of this user where something runs on it, and
    else the one that is everybody's.
    at: an endpoint, or a port of this machine, such as "7448". At a router as REMS_USER
    with REMS_PASSWORD, if they are set; a router that a run brings has no users. The
    caller closes the session. Raises FabricError if there is none.
    """
    if fabric:
        check_name(fabric, "the fabric's name")
    if endpoint := chosen(at):
        user, password = credentials(endpoint)
        own = fabric or own_fabric(at)
        session = Session(Link(endpoint, fabric=own, user=user, password=password))
        session.open()
        try:
            check_sees(session)
        except FabricError:
            session.close()
            raise
        return session if fabric else _or_everybodys(session)
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
        note.unlink(missing_ok=True)  # left by a process that was killed
    if foreign is not None:
        raise foreign
    if fabric != FABRIC and notes.find(FABRIC):  # a team's, where the class's router is
        session, there = open_session(FABRIC), False
        try:
            there = fabric in fabrics(session)
        finally:
            if not there:
                session.close()
        if there:
            return session.on(fabric)
    raise NoRouterError(
        f"No fabric {fabric!r} is running on this machine. Start one with `rems run` "
        "or `rems demo --pace 1`, or go to that of a class with: rems router use "
        "ADDRESS"
    )


def _or_everybodys(session: Session) -> Session:
    """The session; on the fabric that is everybody's, if nothing runs on its own."""
    own = session.fabric
    if own == FABRIC or session.who(f"{own}/clock/@alive"):
        return session
    return session.on(FABRIC)


def own_fabric(at: str = "") -> str:
    """The fabric of this user's runs: at a router that he has joined, his own."""
    joined = not at and not os.environ.get(VARIABLE) and remembered.router()
    return remembered.fabric() if joined else FABRIC


def team_fabric() -> str:
    """Return the fabric of the team at the router that was joined; "" for no team."""
    own = own_fabric()
    return "" if own in (FABRIC, remembered.usual_fabric()) else own


def fabrics(session: Session) -> list[str]:
    """The fabrics at this router that have a clock, or a robot, and may be seen."""
    found = session.who("*/clock/@alive") + session.who("*/robot/*/@alive")
    names = {key.partition("/")[0] for key in found if key.isprintable()}
    known = standing(session)
    return sorted(name for name in names if known is None or known.may_see(name))


def on_each(
    session: Session, fabrics: Iterable[str], do: Callable[[Session], T]
) -> dict[str, T | FabricError]:
    """What `do` returns for each of these fabrics at a router, or its error, by name.

    Many at once: one that is frozen, or is none, keeps nobody from the others.
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
    """Where other runs of this user are on this machine, the newest first."""
    found = []
    for note in notes.find(session.fabric):
        with suppress(FabricError):  # of another user: it is none of ours
            told = notes.read(note)
            if told and told.endpoint != session.link.endpoint:
                found += [told.endpoint] if listens(told.endpoint) else []
    return found


def everywhere(do: Callable[[Session], T], fabric: str) -> dict[str, T | FabricError]:
    """What `do` returns for each run of this user on this machine, or its error.

    By endpoint, the newest first; at all of them at once, so that one which is frozen
    keeps nobody from the others. Raises FabricError where there is none.
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
    """A session over the loopback with a router of this machine and this user.

    endpoint: an address at which other machines reach that router. What floods it from
    a network leaves the loopback alone. fabric, at: as of `open_session`. None if the
    router is another user's, or of another machine.
    """
    host, port = host_and_port(endpoint)
    if not is_ipv4(host) or is_here(endpoint):
        return None
    for note, told in _notes_of(endpoint):
        if told.endpoint == f"tcp/127.0.0.1:{port}":
            with suppress(FabricError):  # frozen
                session = _join(note, fabric or own_fabric(at))
                if session is not None:
                    return session if fabric else _or_everybodys(session)
    return None


def _notes_of(endpoint: str) -> Iterator[tuple[Path, notes.Note]]:
    """Yield the notes of this user's routers on this machine that are reached there.

    endpoint: by an address of this machine, its name, or over the loopback.
    """
    host, port = host_and_port(endpoint)
    if is_here(endpoint) or (is_ipv4(host) and source(host) == host):
        for note in notes.all_of_them():
            with suppress(FabricError):  # of another user
                told = notes.read(note)
                if told and told.endpoint in (endpoint, f"tcp/127.0.0.1:{port}"):
                    yield note, told


def chosen(at: str = "") -> str:
    """The endpoint of the router that this user wants; nothing for one of his own.

    What `at` says wins over REMS_ROUTER, and that over `rems router use`. Raises
    FabricError for what is none.
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
    """The session that a note leads to; None when its router is no more.

    Another program may have its port by now, so the router must be the very one.
    Raises FabricError for a note that is not ours, and for a router that is there and
    does not answer.
    """
    told = notes.read(note)
    if told is None or not listens(told.endpoint):
        return None
    endpoint, router, user, password, _ = told
    session = Session(Link(endpoint, fabric=fabric, user=user, password=password))
    try:
        session.open()
    except FabricError:
        # It may be frozen, and stop no robot; so its note stays.
        raise FabricError(
            f"Something listens at {endpoint}, where a run of yours has its router, "
            "and does not answer: is it frozen, by a debugger or by sleep? Go on with "
            f"it, or end it; if that port is another program's by now, type: rm {note}"
        ) from None
    if router in session.routers():
        return session
    session.close()
    return None


def credentials(endpoint: str = "") -> tuple[str, str]:
    """The user and his password; or two empty texts.

    As the environment says, else as it was said to `rems router use` of this endpoint,
    else those of the user who runs the router, on its machine. Raises FabricError for
    one without the other, and never says a password.
    """
    user, password = os.environ.get(USER, ""), os.environ.get(PASSWORD, "")
    if bool(user) != bool(password):
        there, missing = (USER, PASSWORD) if user else (PASSWORD, USER)
        raise FabricError(
            f"{there} is set, and {missing} is not. Set both, for a router that was "
            "started with --users, or neither."
        )
    if user or not endpoint:
        return user, password
    known = remembered.credentials() if endpoint == remembered.router() else ("", "")
    owner = ((note.user, note.password) for _, note in _notes_of(endpoint))
    return known if known[0] else next(owner, known)


def serve(fabric: str = FABRIC) -> tuple[Session, Path]:
    """Open a session that is the router of its own fabric, on the loopback.

    Takes port 7447 or the next free one, and leaves a note for `open_session`; the
    caller closes the session and unlinks the note. Raises FabricError if no port is
    free, or no note can be left.
    """
    # What is wrong with these is wrong at every port.
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
    )
