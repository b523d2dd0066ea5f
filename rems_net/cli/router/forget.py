"""`rems router forget`: forget the router of a class."""

import argparse

from rems_net.router.finding import remembered

EXAMPLES = """\
examples:
  rems router forget
"""


def add(parser: argparse.ArgumentParser) -> None:
    """Add no options."""


def run(args: argparse.Namespace) -> int:
    """Forget the router."""
    was = remembered.forget()
    print(f"Left {was}." if was else "There was nothing to leave.")
    return 0
