"""`rems router status [ADDRESS]`: the router that is used, and the way to it."""

import argparse

from rems_net.client.doctor import examine
from rems_net.router.find import chosen
from rems_net.router.finding.address import to_endpoint

EXAMPLES = """\
examples:
  rems router status                     the router that this laptop uses
  rems router status tcp/192.168.1.20    another one, by address, name or code
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("address", metavar="ADDRESS", nargs="?", help="of a router")


def run(args: argparse.Namespace) -> int:
    """Test one step after the other; return 1 if one is bad."""
    return show_findings(to_endpoint(args.address) if args.address else chosen())


def show_findings(endpoint: str) -> int:
    """Print the findings about this laptop and a router; return 1 if one is bad.

    endpoint: "" for the routers of this laptop's own runs
    """
    well = True
    for finding in examine(endpoint):
        print(finding, flush=True)
        well = well and finding.well
    return 0 if well else 1
