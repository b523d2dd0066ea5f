"""`rems serve`: an open fabric: a router, and a clock that waits for nobody."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rems_net.agents.experiment.checking.settings import check_pace, seconds
from rems_net.agents.experiment.serving import serve
from rems_net.cli.words import warn
from rems_net.router import notes
from rems_net.router.find import VARIABLE, check_member, chosen, open_session
from rems_net.router.finding.address import PORT, is_here, to_code
from rems_net.router.finding.interfaces import reachable
from rems_net.router.gate.users import load
from rems_net.router.keeper import class_router
from rems_net.router.keys import FABRIC, check_name
from rems_net.router.session import Session

EXAMPLES = f"""\
examples:
  rems serve
  rems serve --dt "50 ms" --users users.toml
  rems serve --listen tcp/127.0.0.1:{PORT}      this machine only
  {VARIABLE}=tcp/192.168.1.20 rems serve     the clock alone

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
    parser.add_argument(
        "--users", type=Path, metavar="FILE", help="nobody else is let in"
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
        with open_session(fabric) as session:
            check_member(session)
            print(f"Open fabric {fabric!r} at {session.link.endpoint}", flush=True)
            yield session
        return
    users = load(args.users) if args.users else None
    port = args.listen.rpartition(":")[2]
    with class_router(args.listen, users, fabric) as session:
        here = f"tcp/127.0.0.1:{port}"
        note = notes.write(fabric, int(port), here, session.id)
        try:
            _announce(fabric, args.listen)
            if users is None:
                warn("whoever reaches it can stop robots and end runs: see --users")
            yield session
        finally:
            note.unlink(missing_ok=True)


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
