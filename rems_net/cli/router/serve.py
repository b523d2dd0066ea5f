"""`rems router serve`: an open fabric: a router, and a clock that waits for nobody."""

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rems_net.agents.experiment.checking.settings import seconds
from rems_net.agents.experiment.serving import serve
from rems_net.agents.experiment.show import Reports
from rems_net.agents.protocol.limits import check_pace
from rems_net.cli import typed
from rems_net.cli.options import console, warn
from rems_net.cli.qr import show_code
from rems_net.cli.sheet import sheet_of
from rems_net.errors import ExperimentError
from rems_net.events import Event, listening
from rems_net.libraries import look_for
from rems_net.router import notes
from rems_net.router.find import VARIABLE, chosen, open_session
from rems_net.router.finding.address import (
    PORT,
    host_and_port,
    is_here,
    is_ipv4,
    to_code,
    to_endpoint,
)
from rems_net.router.finding.interfaces import addresses, reachable
from rems_net.router.gate.access import MEMBERS
from rems_net.router.gate.classlist import load_class, slips_of
from rems_net.router.gate.identity import check_member
from rems_net.router.gate.refusal import listens
from rems_net.router.gate.users import OWNER, Users, load
from rems_net.router.keys import FABRIC, check_name
from rems_net.router.relay.scouts import EVERYWHERE
from rems_net.router.session import Session
from rems_net.router.stop_store import class_router

EXAMPLES = f"""\
examples:
  rems router serve
  rems router serve --dashboard                        with a page
  rems router serve --class names.csv                  teams, kept apart
  rems router serve --class names.csv --pages          and a page for each phone
  rems router serve --dt "50 ms" --users users.toml    members and guests
  rems router serve --listen tcp/127.0.0.1:{PORT}      this machine only
  {VARIABLE}=tcp/192.168.1.20 rems router serve     the clock alone

names.csv is a table with the columns name and team (and password, if you
choose them). Passwords are made, and written as slips to be printed.

To stop all robots, type where it runs: s (and Enter); a script writes the line
stop to its standard input. To let them go on: r, or release.

Then, on any laptop:
  rems agent start robot woodbot mujoco --name alice
  rems list
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--dt", default="20 ms", help="the time of a tick (20 ms)")
    parser.add_argument("--pace", default="1", help="real-time factor (1)")
    parser.add_argument("--fabric", default=FABRIC, help=f"its name ({FABRIC})")
    parser.add_argument(
        "--listen",
        default=f"tcp/0.0.0.0:{PORT}",
        metavar="ENDPOINT",
        help="where to listen (%(default)s, every network of this machine)",
    )
    let_in = parser.add_mutually_exclusive_group()
    let_in.add_argument(
        "--class",
        dest="names",
        type=Path,
        metavar="NAMES.csv",
        help="who is in which team; nobody else is let in",
    )
    let_in.add_argument(
        "--users", type=Path, metavar="FILE", help="members and guests; nobody else"
    )
    parser.add_argument(
        "--dashboard", action="store_true", help="show it on a page in the browser"
    )
    parser.add_argument(
        "--pages",
        action="store_true",
        help="a page for the phone of each user, with the own rights; links to print",
    )
    parser.add_argument(
        "--no-qr", action="store_true", help="no QR code of the line to type"
    )


def run(args: argparse.Namespace) -> int:
    """Serve until Ctrl+C; report members that come and go, and obey typed lines."""
    dt = seconds(args.dt, "--dt")
    pace = check_pace(args.pace, dt)
    if args.dashboard or args.pages:
        look_for("websockets", "dashboard")
    if args.pages and not (args.names or args.users):
        raise ExperimentError(
            "--pages makes a page for each user, and without a list there are none; "
            "type: rems router serve --class names.csv --pages (R0904)"
        )
    fabric = check_name(args.fabric, "--fabric")
    with suppress(KeyboardInterrupt), _session(args, fabric) as session:
        typed.obey(session, log)
        reports = Reports(session)

        def show(event: Event) -> None:
            log(str(event))
            reports.put(event)

        with listening(show), _page(args, session):
            serve(session, dt, pace)
    return 0


def log(line: str) -> None:
    """Print a line, or lose it: a full disk must not end a class."""
    with suppress(OSError, ValueError):
        print(line, flush=True)


@contextmanager
def _page(args: argparse.Namespace, session: Session) -> Iterator[None]:
    """Serve the page beside the router, for this machine, if it is asked for.

    Where there are users, its browsers have the rights of the first teacher or member:
    the session of this process may do more than anybody else. With --pages each user
    has a page, too, where the router listens.
    """
    if not (args.dashboard or args.pages):
        yield
        return
    from rems_net.cli.beside import Beside, ClassPages

    host, port = host_and_port(session.link.endpoint)
    at = f"tcp/127.0.0.1:{port}" if host in EVERYWHERE else session.link.endpoint
    page = Beside(log)
    users = session.link.users
    name = next((n for n in users.names[MEMBERS] if n != OWNER), "") if users else ""
    class_ = None
    if args.pages and users:
        fabrics = {
            n: users.identities()[n][1] or session.fabric for n in users.passwords
        }
        class_ = ClassPages(
            host,
            sheet_of(args.names or args.users),
            {n: (f, users.passwords[n]) for n, f in fabrics.items() if n != OWNER},
        )
    password = users.passwords[name] if users else ""
    page.start(at, session.fabric, name, password, class_)
    try:
        yield
    finally:
        page.end()


@contextmanager
def _session(args: argparse.Namespace, fabric: str) -> Iterator[Session]:
    """Yield a session at the configured router, or one that is a router itself."""
    if there := chosen():
        if args.names or args.users:
            raise ExperimentError(
                f"the router is at {there}, and only it can have a class list; use "
                "--class there, or leave that one first: rems router forget (R0904)"
            )
        with open_session(fabric) as session:
            check_member(session)
            _announce(args, f"{fabric!r} at {there}", there, _ways(there))
            yield session
        return
    users, user, password = _users(args, fabric)
    listen = to_endpoint(args.listen)
    host, port = host_and_port(listen)
    if sys.platform == "win32" and not is_here(listen):
        log("Windows may ask whether others may reach Python: allow private networks.")
    with class_router(listen, users, fabric) as session:
        here = f"tcp/127.0.0.1:{port}" if host in EVERYWHERE else listen
        told = notes.Note(here, session.id, user, password, served=True)
        note = notes.write(fabric, port, told)
        try:
            ways = [] if is_here(listen) else _ways(listen)
            _announce(args, repr(fabric), listen, ways)
            if users is None:
                warn(
                    "it is open to everybody: who reaches it can stop robots and end "
                    "runs. For a class with teams: --class names.csv"
                )
            yield session
        finally:
            note.unlink(missing_ok=True)


def _users(args: argparse.Namespace, fabric: str) -> tuple[Users | None, str, str]:
    """Return who is let in, and a user and password for this machine."""
    if args.names:
        address = _address(to_endpoint(args.listen))
        users = load_class(args.names, fabric, address)
        print(f"{args.names}: {users.count}; nobody else is let in.")
        print(f"  Slips to print, for your eyes only: {slips_of(args.names)}")
        print(
            f"  Each types what is on his slip: rems router use {address} --user NAME"
        )
    elif args.users:
        users = load(args.users)
        print(f"{args.users}: {users.count}; nobody else is let in.")
    else:
        return None, "", ""
    return users.with_owner()


def _address(endpoint: str) -> str:
    """Return the address to type on other laptops, for the slips."""
    host, port = host_and_port(endpoint)
    if host in EVERYWHERE:
        host = next(iter(reachable()), "ADDRESS")
    return f"{host}:{port}" if port != PORT else host


def _ways(endpoint: str) -> list[tuple[str, str]]:
    """Return the addresses at which others may reach the router, with their kinds.

    Addresses of special kinds are returned only if there is no ordinary one.
    """
    host, port = host_and_port(endpoint)
    if host not in EVERYWHERE and not is_here(endpoint):
        return [(host, "")]
    found = [
        (one, kind)
        for one, kind in addresses()
        if listens(f"tcp/{f'[{one}]' if ':' in one else one}:{port}")
    ]
    return [way for way in found if not way[1]] or found


def _announce(
    args: argparse.Namespace,
    fabric: str,
    endpoint: str,
    ways: list[tuple[str, str]],
) -> None:
    """Print what to type on other laptops, and show the first line as a QR code."""
    protocol, (_, port) = endpoint.partition("/")[0], host_and_port(endpoint)
    usual = (protocol, port) == ("tcp", PORT)
    lines = []
    for host, _ in ways:
        address = f"[{host}]" if ":" in host else host
        lines.append(
            f"rems router use {protocol}/{address}{'' if usual else f':{port}'}"
        )
    ways_in = "On other laptops, type one of:"
    if not lines:
        ways_in = "Only this machine reaches it."
        if not is_here(endpoint):
            ways_in = "This machine has no network: connect it, and start this again."
    elif ways[0][1]:
        ways_in = "No usual network is here; a laptop may reach it by one of:"
    print(f"Open fabric {fabric}. {ways_in}")
    for (host, kind), line in zip(ways, lines, strict=True):
        code = to_code(host) if usual and is_ipv4(host) else ""
        print(
            f"  {line}"
            + (f"      or its code: rems router use {code}" if code else "")
            + (f"      ({kind})" if kind else "")
        )
    if lines and not args.no_qr:
        show_code(console(args), lines[0])
    print(end="", flush=True)
