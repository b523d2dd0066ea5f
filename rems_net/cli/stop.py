"""`rems stop`: every robot stops, now, and stays so until released."""

from __future__ import annotations

import argparse

from rems_net.cli.words import warn
from rems_net.fabric import join

EXAMPLES = """\
examples:
  rems stop
  rems stop --release
"""


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems stop` can be told."""
    parser.add_argument(
        "--release", action="store_true", help="let the robots obey commands again"
    )


def run(args: argparse.Namespace) -> int:
    """Stop, and say who stands; or release. 1 where one does not stand."""
    with join(tell=warn) as fabric:
        if args.release:
            print(_released(fabric.release()))
            return 0
        receipts = fabric.stop()
    for receipt in receipts:
        print(receipt)
    print("Let them go on with: rems stop --release")
    return 0 if all(receipt.stands for receipt in receipts) else 1


def _released(who: list[str] | bool) -> str:
    if isinstance(who, list):
        return f"released: {', '.join(who) or 'no robot is there'}"
    if who:
        return "released: the router kept a STOP; the next run may drive"
    return "there was nothing to release: no experiment runs, and no STOP is kept"
