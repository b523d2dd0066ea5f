"""`rems lend ROBOT FABRIC`: lend a robot of an open fabric to another fabric."""

from __future__ import annotations

import argparse

from rems_net.cli.agent import pairs
from rems_net.cli.words import fabric_of
from rems_net.fabric import join
from rems_net.router.keys import FABRIC

EXAMPLES = """\
examples:
  rems lend robot/woodbot-7 team3
  rems lend robot/woodbot-7 team3 --to command=input/keys
  rems return robot/woodbot-7

A run asks for a robot by itself, where its driver = "lent".
"""


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems lend` can be told."""
    parser.add_argument("robot", metavar="ROBOT", help="such as robot/woodbot-7")
    parser.add_argument("borrower", metavar="FABRIC", help="which gets it")
    parser.add_argument(
        "--to",
        metavar="PORT=KEY",
        action="append",
        default=[],
        help="connect its In there, such as command=input/keys",
    )
    parser.add_argument("--fabric", default=FABRIC, help=f"whose it is ({FABRIC})")


def run(args: argparse.Namespace) -> int:
    """Lend it, and say how it comes back."""
    sources = pairs(args.to, "--to", "command=input/keys")
    with join(fabric=fabric_of(args)) as fabric:
        to = fabric.lend(args.robot, args.borrower, sources)
    print(f"{args.robot} is lent to {to!r}. It comes back when that ends, or by:")
    print(f"  rems return {args.robot}")
    return 0
