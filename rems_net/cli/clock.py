"""`rems clock VERB`: pause, step, resume, change the pace, end."""

import argparse

from rems_net.cli.options import add_at
from rems_net.client import join

EXAMPLES = """\
examples:
  rems clock pause
  rems clock step 10
  rems clock resume
  rems clock pace 0.5         half of real time; "fast" is as fast as it goes
  rems clock end              as if the duration were over
"""


def add(parser: argparse.ArgumentParser) -> None:
    verb = parser.prog.split()[-1]
    if verb == "step":
        parser.add_argument(
            "value",
            metavar="TICKS",
            nargs="?",
            type=int,
            help="how many ticks to step (1)",
        )
    if verb == "pace":
        parser.add_argument(
            "value", metavar="PACE", type=_pace, help='real-time factor, or "fast"'
        )
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """Command the clock, and print its pace or tick."""
    what, value = args.verb, getattr(args, "value", None)
    given = () if value is None else (value,)
    with join(fabric=args.fabric, at=args.at) as fabric:
        said = fabric.clock(what, *given)
    if what == "pace":
        print(f"pace {said:g}" if said else "as fast as it goes")
    else:
        print(f"tick {said}")
    return 0


def _pace(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
