"""`rems serve`: an open fabric: a router, and a clock that waits for nobody."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rems_net.agents.experiment.checking.settings import check_pace, seconds
from rems_net.agents.experiment.serving import serve
from rems_net.cli.words import warn
from rems_net.errors import ExperimentError
from rems_net.router import notes
from rems_net.router.find import VARIABLE, chosen, open_session
from rems_net.router.finding.address import PORT, is_here, to_code
from rems_net.router.finding.interfaces import reachable
from rems_net.router.gate.classlist import load_class, slips_of
from rems_net.router.gate.standing import check_member
from rems_net.router.gate.users import Users, load
from rems_net.router.keeper import class_router
from rems_net.router.keys import FABRIC, check_name
from rems_net.router.session import Session

EXAMPLES = f"""\
examples:
  rems serve
  rems serve --class names.csv                  teams, kept apart
  rems serve --dt "50 ms" --users users.toml    members and guests
  rems serve --listen tcp/127.0.0.1:{PORT}      this machine only
  {VARIABLE}=tcp/192.168.1.20 rems serve     the clock alone

names.csv is a table with the columns name and team (and password, if you
choose them). Passwords are made, and written as slips to be printed.

Then, on any laptop:
  rems agent robot woodbot mujoco --name alice
  rems list
"""


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems serve` can be told."""
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


def run(args: argparse.Namespace) -> int:
    """Serve until Ctrl+C, and say who comes and goes."""
    dt, pace = seconds(args.dt, "--dt"), check_pace(args.pace)
    fabric = check_name(args.fabric, "--fabric")
    with suppress(KeyboardInterrupt), _session(args, fabric) as session:
        serve(session, dt, pace, tell=lambda line: print(line, flush=True))
    return 0


@contextmanager
def _session(args: argparse.Namespace, fabric: str) -> Iterator[Session]:
    """A session at the router that was told, or that is one."""
    if chosen():
        if args.names or args.users:
            raise ExperimentError(
                f"who is let in is for the router to say, and that is at {chosen()}; "
                "use --class there, or leave that one first: rems leave"
            )
        with open_session(fabric) as session:
            check_member(session)
            print(f"Open fabric {fabric!r} at {session.link.endpoint}", flush=True)
            yield session
        return
    users, user, password = _users(args, fabric)
    port = args.listen.rpartition(":")[2]
    with class_router(args.listen, users, fabric) as session:
        here = f"tcp/127.0.0.1:{port}"
        known = user, password
        note = notes.write(fabric, int(port), here, session.id, *known)
        try:
            _announce(fabric, args.listen)
            if users is None:
                warn(
                    "it is open to everybody: who reaches it can stop robots and end "
                    "runs. For a class with teams: --class names.csv"
                )
            yield session
        finally:
            note.unlink(missing_ok=True)


def _users(args: argparse.Namespace, fabric: str) -> tuple[Users | None, str, str]:
    """Who is let in; and a name and a password for who is at this machine."""
    if args.names:
        users = load_class(args.names, fabric)
        print(f"{args.names}: {users.count}; nobody else is let in.")
        print(f"  Slips to print, for your eyes only: {slips_of(args.names)}")
        print("  Each types what is on his slip: rems join ADDRESS --user NAME")
    elif args.users:
        users = load(args.users)
        print(f"{args.users}: {users.count}; nobody else is let in.")
    else:
        return None, "", ""
    return users.with_owner()


def _announce(fabric: str, listen: str) -> None:
    """Say what to type on other laptops."""
    address, _, port = listen.partition("/")[2].rpartition(":")
    everywhere = address in ("0.0.0.0", "[::]")
    addresses = reachable() if everywhere else [address]
    print(f"Open fabric {fabric!r}. On other laptops, type one of:")
    if is_here(listen) or not addresses:
        print("  nothing: only this machine reaches it")
    for one in addresses if not is_here(listen) else ():
        usual = int(port) == PORT
        line = f"  rems join tcp/{one}{'' if usual else f':{port}'}"
        code = f"      or its code: rems join {to_code(one)}" if usual else ""
        print(f"{line}{code}")
    print(end="", flush=True)
