"""`rems serve`: an open fabric: a router, and a clock that waits for nobody."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rems_net.agents.experiment.checking.settings import check_pace, seconds
from rems_net.agents.experiment.serving import serve
from rems_net.cli import qr
from rems_net.cli.words import console, warn
from rems_net.router import notes
from rems_net.router.find import VARIABLE, check_member, chosen, open_session
from rems_net.router.finding.address import (
    PORT,
    host_and_port,
    is_here,
    is_ipv4,
    to_code,
    to_endpoint,
)
from rems_net.router.finding.interfaces import reachable
from rems_net.router.gate.refusal import listens
from rems_net.router.gate.users import load
from rems_net.router.keeper import class_router
from rems_net.router.keys import FABRIC, check_name
from rems_net.router.session import Session

#: addresses at which a router listens on every network of its machine
EVERYWHERE = ("0.0.0.0", "::")
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
    parser.add_argument(
        "--no-qr", action="store_true", help="no QR code of the line to type"
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
    if there := chosen():
        with open_session(fabric) as session:
            check_member(session)
            _announce(args, f"{fabric!r} at {there}", there, _ways(there))
            yield session
        return
    users = load(args.users) if args.users else None
    listen = to_endpoint(args.listen)
    host, port = host_and_port(listen)
    with class_router(listen, users, fabric) as session:
        here = f"tcp/127.0.0.1:{port}" if host in EVERYWHERE else listen
        note = notes.write(fabric, port, here, session.id)
        try:
            ways = [] if is_here(listen) else _ways(listen)
            _announce(args, repr(fabric), listen, ways)
            if users is None:
                warn("whoever reaches it can stop robots and end runs: see --users")
            yield session
        finally:
            note.unlink(missing_ok=True)


def _ways(endpoint: str) -> list[str]:
    """At which addresses other laptops reach the router that is at `endpoint`."""
    host, port = host_and_port(endpoint)
    if host not in EVERYWHERE and not is_here(endpoint):
        return [host]
    return [one for one in reachable() if listens(f"tcp/{one}:{port}")]


def _announce(
    args: argparse.Namespace, fabric: str, endpoint: str, hosts: list[str]
) -> None:
    """Say what to type on other laptops, and show the first line to cameras."""
    protocol, (_, port) = endpoint.partition("/")[0], host_and_port(endpoint)
    usual = (protocol, port) == ("tcp", PORT)
    lines = []
    for host in hosts:
        address = f"[{host}]" if ":" in host else host
        lines.append(f"rems join {protocol}/{address}{'' if usual else f':{port}'}")
    told = (
        "On other laptops, type one of:" if lines else "Only this machine reaches it."
    )
    print(f"Open fabric {fabric}. {told}")
    for host, line in zip(hosts, lines, strict=True):
        code = to_code(host) if usual and is_ipv4(host) else ""
        print(f"  {line}" + (f"      or its code: rems join {code}" if code else ""))
    if lines and not args.no_qr:
        qr.show(console(args), lines[0])
    print(end="", flush=True)
