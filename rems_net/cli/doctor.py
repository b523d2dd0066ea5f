"""`rems doctor`: what is wrong between this laptop and a fabric."""

import argparse

from rems_net.fabric.doctor import examine
from rems_net.router.find import chosen
from rems_net.router.finding.address import to_endpoint

EXAMPLES = """\
examples:
  rems doctor                     this laptop, and the router that was joined
  rems doctor tcp/192.168.1.20    another one, by address, name or code
"""


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems doctor` can be told."""
    parser.add_argument("address", metavar="ADDRESS", nargs="?", help="of a router")


def run(args: argparse.Namespace) -> int:
    """Look at one thing after the other; 1 where one is not well."""
    endpoint = to_endpoint(args.address) if args.address else chosen()
    well = True
    for finding in examine(endpoint):
        print(finding, flush=True)
        well = well and finding.well
    return 0 if well else 1
