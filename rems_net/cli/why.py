"""`rems why KEY`: why a value is missing, old or dropped."""

import argparse

from rems_net.cli.words import add_at
from rems_net.fabric import join
from rems_net.router.keys import full_key

EXAMPLES = """\
examples:
  rems why robot/sim/command
  rems why robot/sim               every port of it
"""


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems why` can be told."""
    parser.add_argument("key", metavar="KEY", help="an agent, or a port of one")
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """Say all that is known of it."""
    full_key(args.key)  # a typo is told before anybody is looked for
    with join(fabric=args.fabric, at=args.at) as fabric:
        for sentence in fabric.why(args.key):
            print(sentence)
    return 0
