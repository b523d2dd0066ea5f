"""`rems why [KEY]`: find out why a value is missing, or a laptop not connected."""

import argparse

from rems_net.cli.options import add_at
from rems_net.cli.router.status import show_findings
from rems_net.client import join
from rems_net.router.find import chosen
from rems_net.router.keys import full_key

EXAMPLES = """\
examples:
  rems why                         this laptop, its network, and the fabric
  rems why robot/sim/command       a value that is missing, old or dropped
  rems why robot/sim               every port of a robot
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "key", metavar="KEY", nargs="?", help="an agent, or a port of one"
    )
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """Print the reasons; return 1 if the laptop or its network has a fault."""
    if args.key is None:
        return show_findings(chosen(args.at))
    full_key(args.key)  # a typo is reported before the network is asked
    with join(fabric=args.fabric, at=args.at) as fabric:
        for sentence in fabric.why(args.key):
            print(sentence)
    return 0
