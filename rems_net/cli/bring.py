"""`rems bring EXPERIMENT.toml --only AGENT`: bring agents to a run elsewhere."""

from __future__ import annotations

import argparse
from pathlib import Path

from rems_net.agents.experiment.file import load, located
from rems_net.cli.words import add_fabric, fabric_of
from rems_net.errors import ExperimentError

EXAMPLES = """\
examples:
  on the machine with the clock, which also runs `python -m rems_net.router`:
    rems run lab.toml --elsewhere robot/b
  on the other one, with the same lab.toml:
    rems join tcp/192.168.1.20
    rems bring lab.toml --only robot/b
"""


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems bring` can be told."""
    parser.add_argument("experiment", metavar="EXPERIMENT.toml", type=Path)
    parser.add_argument(
        "--only",
        metavar="AGENT",
        nargs="+",
        required=True,
        help="the agents to bring, such as robot/b",
    )
    add_fabric(parser)
    parser.add_argument(
        "--out", metavar="DIR", type=Path, help="folder for the results (runs/<name>)"
    )


def run(args: argparse.Namespace) -> int:
    """Bring them, and stay until the run ends."""
    experiment = load(args.experiment)
    experiment.fabric = fabric_of(args) or experiment.fabric
    try:
        experiment.join(args.only, args.out)
    except ExperimentError as error:
        with located(args.experiment):
            raise error
    return 0
