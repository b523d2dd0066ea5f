"""`rems return ROBOT`: take a robot back that is lent."""
# ruff: noqa: N999 - a module is called what its verb is

from __future__ import annotations

import argparse

from rems_net.cli.words import add_at
from rems_net.fabric import join

EXAMPLES = """\
examples:
  rems return robot/woodbot-7
"""


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems return` can be told."""
    parser.add_argument("robot", metavar="ROBOT", help="such as robot/woodbot-7")
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """Take it back, on its own fabric or on that of its borrower."""
    with join(fabric=args.fabric, at=args.at) as fabric:
        home = fabric.take_back(args.robot)
    print(f"{args.robot} is back on {home!r}.")
    return 0
