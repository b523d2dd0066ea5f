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
    """Stop, or release."""
    with join(tell=warn) as fabric:
        robots = [a["agent"] for a in fabric.agents() if a["kind"] == "robot"]
        fabric.stop(released=args.release)
    what = "released" if args.release else "stopped"
    print(f"{what}: {', '.join(robots) or 'there is no robot'}")
    if not args.release:
        print("Let them go on with: rems stop --release")
    return 0
