"""`rems bring`: start agents of a run that is on another machine."""

from __future__ import annotations

import argparse
from pathlib import Path

from rems_net.agents.experiment.file import load, located
from rems_net.agents.experiment.placement.bring import serve_run
from rems_net.agents.experiment.placement.receiving import Wanted
from rems_net.agents.experiment.show import Show
from rems_net.cli.words import add_fabric, fabric_of, warn
from rems_net.errors import ExperimentError, RemsError
from rems_net.router import find
from rems_net.router.finding import remembered
from rems_net.router.gate.standing import check_member
from rems_net.router.keys import FABRIC, check_name

EXAMPLES = """\
examples:
  lab.toml says machine = "b" at some agents; on the laptop that runs it:
    rems run lab.toml
  on the other one, which needs no file for built-in parts:
    rems join tcp/192.168.1.20
    rems bring --as b
  with the same lab.toml on both, and nothing said in it:
    rems run lab.toml --elsewhere robot/b
    rems bring lab.toml --only robot/b

Plans and data files come from the run; Python files never do: a class of
your own must be below the folder in which you type this.
"""


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems bring` can be told."""
    parser.add_argument(
        "experiment",
        metavar="EXPERIMENT.toml",
        type=Path,
        nargs="?",
        help="with --only",
    )
    parser.add_argument(
        "--as",
        dest="machine",
        metavar="MACHINE",
        help="be this machine of a run: bring what it wants of it, till its end",
    )
    parser.add_argument(
        "--stay", action="store_true", help="with --as: then wait for the next run"
    )
    parser.add_argument(
        "--only",
        metavar="AGENT",
        nargs="+",
        help="the agents to bring, such as robot/b",
    )
    add_fabric(parser)
    parser.add_argument(
        "--out", metavar="DIR", type=Path, help="folder for the results (runs/<name>)"
    )


def run(args: argparse.Namespace) -> int:
    """Bring them, and stay until the run ends."""
    if bool(args.machine) == bool(args.experiment):
        raise ExperimentError(
            "expected either `rems bring --as MACHINE`, for what a run wants of this "
            "machine, or `rems bring FILE.toml --only AGENT`."
        )
    if args.machine:
        _be(check_name(args.machine, "--as"), fabric_of(args), stay=args.stay)
        return 0
    if not args.only:
        raise ExperimentError("--only is missing: which agents? Such as --only robot/b")
    experiment = load(args.experiment)
    experiment.fabric = fabric_of(args) or experiment.fabric
    try:
        experiment.join(args.only, args.out)
    except ExperimentError as error:
        with located(args.experiment):
            raise error
    return 0


def _be(machine: str, fabric: str, *, stay: bool) -> None:
    """Be a machine of a run, or of one after the other."""
    here = Path.cwd()
    own = find.own_fabric()
    if not fabric and own not in (FABRIC, remembered.usual_fabric()):
        fabric = own  # a team's: what others run is none of ours
    with find.open_session(fabric) as session:
        check_member(session)
        wanted = Wanted(session, machine, fabric)
        while True:
            theirs = wanted.next(warn)
            try:
                serve_run(theirs, machine, here, Show(), _print)
                _print("The run has ended.")
            except RemsError as error:
                if not stay:
                    raise
                warn(error)
            if not stay:
                return
            wanted.wait_for_end(theirs.fabric)  # what failed is not tried again


def _print(sentence: str) -> None:
    print(sentence, flush=True)
