"""`rems agent bring`: start agents of a run that is on another machine."""

import argparse
import sys
from functools import partial
from pathlib import Path

from rems_net.agents.experiment.placement.bring import Asked, serve_run
from rems_net.agents.experiment.placement.offered import check_allowed
from rems_net.agents.experiment.placement.receiving import Wanted
from rems_net.agents.experiment.show import Show
from rems_net.cli.options import add_fabric, fabric_of, warn
from rems_net.errors import ExperimentError, RemsError
from rems_net.router import find
from rems_net.router.gate.identity import check_member, team_of, vouches
from rems_net.router.keys import check_name
from rems_net.router.session import Session

EXAMPLES = """\
examples:
  lab.toml has machine = "b" at some agents; on the laptop that runs it:
    rems run lab.toml
  on the other one, which needs no file for built-in parts:
    rems router use tcp/192.168.1.20
    rems agent bring --as b                 it asks before it starts anything
  in a script, for runs of your own team, with a robot at a port:
    rems agent bring --as b --stay --yes --allow /dev/ttyUSB0

It shows what would be started, and asks; only y starts it. Plans and data files
come from the run; Python files never do: a class of your own must be below the
folder in which you type this. No other file of this laptop is opened.
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--as",
        dest="machine",
        metavar="MACHINE",
        required=True,
        help="be this machine of a run: bring what it wants of it, till its end",
    )
    parser.add_argument(
        "--stay", action="store_true", help="then wait for the next run"
    )
    parser.add_argument(
        "--yes",
        action="store_true",
        help="do not ask, if the router knows that it is your team's run",
    )
    parser.add_argument(
        "--allow",
        metavar="PORT",
        nargs="+",
        default=[],
        help="with --yes: ports and addresses that may be used, such as /dev/ttyUSB0",
    )
    add_fabric(parser)


def run(args: argparse.Namespace) -> int:
    """Act as a machine of one run, or of one run after another."""
    machine, fabric = check_name(args.machine, "--as"), fabric_of(args)
    if not (args.yes or (sys.stdin and sys.stdin.isatty())):
        raise ExperimentError(
            "`rems agent bring --as` asks before it starts what another laptop wants; "
            "type it in a terminal. In a script, with a class's router that knows its "
            "users: --yes (R0443)"
        )
    with find.open_session(fabric) as session:
        check_member(session)
        fabric = fabric or team_of(session)  # only runs of the own team
        wanted = Wanted(session, machine, fabric)
        while True:
            theirs = wanted.next()
            vouched = vouches(theirs)
            agree = partial(_agree, args, theirs, vouched)
            try:
                serve_run(theirs, machine, Path.cwd(), Show(), agree)
                print("The run has ended.", flush=True)
            except RemsError as error:
                if not args.stay:
                    raise
                warn(error)
            if not args.stay:
                return 0
            wanted.wait_for_end(theirs.fabric)  # a failed run is not tried again


def _agree(
    args: argparse.Namespace, session: Session, vouched: bool, asked: Asked
) -> None:
    """Show what would be started, and ask. Raises ExperimentError if it is not yes."""
    print(*asked.sentences, sep="\n", flush=True)
    if args.yes and not vouched:
        raise ExperimentError(
            f"--yes is for a run of your own team, or of its teacher, on a fabric of "
            f"your team at a router with users; at {session.link.endpoint} fabric "
            f"{session.fabric!r} is open to others, so nobody knows whose run this is. "
            "Type the line without --yes, in a terminal, and look. (R0443)"
        )
    if args.yes:
        check_allowed(asked.uses, args.allow)
        return
    if vouched:
        print("The router lets only your team, and teachers, start this.")
    else:
        print("Anybody at this router can send this under any name.")
    print("Start it? [y/N] ", end="", flush=True)
    try:
        answer = sys.stdin.readline()
    except KeyboardInterrupt:
        print()  # the shell's next output gets a line of its own
        raise
    if answer.strip().lower() not in ("y", "yes"):
        raise ExperimentError("nothing is started: the answer was not y. (R0443)")
