"""`rems dashboard`: a page that shows a fabric in the browser."""

import argparse
import json
import sys
from _thread import interrupt_main
from collections.abc import Iterator, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from rems_net.cli.options import add_at, console, warn
from rems_net.cli.qr import show_code
from rems_net.cli.sheet import write_sheet
from rems_net.client import join
from rems_net.errors import DeniedError, ExperimentError
from rems_net.libraries import look_for
from rems_net.router.gate.users import OWNER
from rems_net.router.settings import Link
from rems_net.system.standard_input import lines

if TYPE_CHECKING:
    from rems_net.dashboard.door import Door

#: bytes of the line with all users of a class
USERS = 2**24
EXAMPLES = """\
examples:
  rems dashboard
  rems dashboard --field robot/model/state/x       with a plot of it
  rems dashboard --layout layout.json              with what a page has saved
  rems dashboard --listen 0.0.0.0                  for all laptops of a network
  rems dashboard --port 8081 --rate 50
  rems dashboard --viewers                         for Lichtblick, too
  rems dashboard runs/monday                       a recording: play and scrub
  rems dashboard runs/monday runs/tuesday          the second one as ghosts

Only a browser with the link gets in. With --listen the page and what it shows
travel unencrypted: anybody who can read the network can read the link, too.
"""
#: recordings that one page shows
MOST = 2
#: the port of the first page on this machine, and how many are tried
PORT, TRIES = 8477, 32


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "recordings",
        metavar="RECORDING",
        type=Path,
        nargs="*",
        help="run.mcap, or the folder of a run; of two, the second as ghosts",
    )
    parser.add_argument(
        "--listen",
        metavar="ADDRESS",
        default="127.0.0.1",
        help="where to listen (%(default)s: this machine only)",
    )
    parser.add_argument(
        "--port", type=int, default=0, help=f"its port ({PORT}, or the next free one)"
    )
    parser.add_argument(
        "--rate", type=float, default=30.0, help="pictures per second (30)"
    )
    parser.add_argument(
        "--field", default="", metavar="KEY", help="plot it, such as robot/sim/state/x"
    )
    parser.add_argument(
        "--layout", type=Path, metavar="FILE", help="begin with the plots of this file"
    )
    parser.add_argument("--no-qr", action="store_true", help="no QR code of the link")
    parser.add_argument(
        "--viewers",
        action="store_true",
        help="an address for Lichtblick, Foxglove and PlotJuggler, too",
    )
    parser.add_argument("--beside", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--sheet", type=Path, help=argparse.SUPPRESS)
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """Serve the page until Ctrl+C."""
    check(args)
    parent = lines(USERS)
    users = json.loads(next(parent)) if args.sheet else {}
    layout = read_layout(args.layout) if args.layout else None
    if args.beside:  # a run or a router: end with it
        Thread(target=_await_end, args=(parent,), daemon=True).start()
    if args.recordings:
        return _show(args)
    from rems_net.dashboard.server import Server
    from rems_net.dashboard.serving import listening_at, rejoin, serve

    with join(fabric=args.fabric, at=args.at) as fabric:
        check_user(fabric.session.link.user)
        with listening_at(args.listen, _ports(args)) as (sock, door):
            announce(args, door)
            if args.viewers:
                print("For viewers that speak the Foxglove WebSocket protocol:")
                print(f"  {door.viewers()[-1]}", flush=True)
            accounts = invite(args, users, door.invite(users))
            again = partial(rejoin, args.fabric, args.at)
            server = Server(fabric, door, args.rate, again, accounts, layout)
            serve(server, sock)
    return 0


def invite(
    args: argparse.Namespace, users: dict[str, list[str]], links: dict[str, str]
) -> dict[str, Link]:
    """Write the links of a class; return how its users join.

    users: fabric and password by user, from the router's process.
    """
    if not users:
        return {}
    write_sheet(args.sheet, {n: (users[n][0], link) for n, link in links.items()})
    print(f"Links of {len(users)} users, for your eyes only: {args.sheet}", flush=True)
    return {
        name: Link(args.at, fabric=fabric, user=name, password=password)
        for name, (fabric, password) in users.items()
    }


def _show(args: argparse.Namespace) -> int:
    """Serve the page of a recording, or of two, until Ctrl+C."""
    from rems_net.cli.info import recording_in
    from rems_net.dashboard.recorded.page import RecordedServer
    from rems_net.dashboard.recorded.runs import RecordedRuns
    from rems_net.dashboard.serving import listening_at, serve

    if len(args.recordings) > MOST:
        raise ExperimentError(
            f"{len(args.recordings)} recordings are named; expected one, or two of "
            "one experiment: rems dashboard runs/monday runs/tuesday (R1001)"
        )
    if given := [o for o in ("viewers", "at", "fabric") if getattr(args, o)]:
        raise ExperimentError(
            f"--{given[0]} is for a run, and a recording is shown without a fabric: "
            f"leave out --{given[0]}; viewers open the file itself. (R1001)"
        )
    with (
        closing(RecordedRuns(*map(recording_in, args.recordings))) as show,
        listening_at(args.listen, _ports(args)) as (sock, door),
    ):
        for sentence in show.notes:
            warn(sentence)
        announce(args, door)
        serve(RecordedServer(show, door, args.rate), sock)
    return 0


def _ports(args: argparse.Namespace) -> Sequence[int]:
    return [args.port] if args.port else range(PORT, PORT + TRIES)


def check_user(user: str) -> None:
    """Raise DeniedError for the router's own program: a browser may do as its user.

    user: with whose rights the page acts; "" at a router without users.
    """
    if user == OWNER:
        raise DeniedError(
            "Here the router of a class runs, and its own programs may do more than "
            "any teacher, so a browser gets no page by them. Type in place of it: rems "
            "router serve --class names.csv --dashboard (R0609)"
        )


def _await_end(parent: Iterator[str]) -> None:
    """Interrupt this program when its standard input ends."""
    for _ in parent:
        pass
    interrupt_main()


def check(args: argparse.Namespace) -> None:
    """Raise a RemsError for impossible options, and without the library."""
    look_for("websockets", "dashboard")
    if not 1 <= args.rate <= 100:
        raise ExperimentError(
            f"--rate is {args.rate:g}; expected 1 to 100 pictures per second. (R1001)"
        )
    if not 0 <= args.port < 65_536:
        raise ExperimentError(f"--port is {args.port}; expected 1 to 65535. (R1001)")


def read_layout(path: Path) -> dict[str, Any]:
    """Return a layout that a page has saved. Raises ExperimentError."""
    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        why = getattr(error, "strerror", None) or "it is no JSON"
        raise ExperimentError(
            f"{path} cannot be read as a layout: {why}. Expected a "
            "file that `save` of a page has made. (R1001)"
        ) from None
    plots = found.get("plots") if isinstance(found, dict) else None
    known = isinstance(plots, list) and all(isinstance(one, dict) for one in plots)
    if not known or found.get("layout") != 1:
        raise ExperimentError(
            f"{path} is no layout; expected a file that `save` of a "
            'page has made, which begins with {"layout": 1} (R1001)'
        )
    return found


def announce(args: argparse.Namespace, door: "Door") -> None:
    """Print the links, and show the last one, which other machines reach, as a code."""
    links = door.links(f"?field={quote(args.field)}" if args.field else "")
    print("The page, for browsers with this link:")
    for link in links:
        print(f"  {link}", flush=True)
    if args.listen not in ("127.0.0.1", "::1", "localhost"):
        warn(
            "the page is not encrypted: everybody who can read this network can read "
            "the link and what the page shows; among strangers, leave out --listen"
        )
    if not args.no_qr:
        show_code(console(args), links[-1])
    sys.stdout.flush()
