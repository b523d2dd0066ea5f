"""`rems clock VERB`: pause, step, resume, change the pace, end."""

import argparse

from rems_net.cli.words import add_at
from rems_net.errors import ExperimentError, nearest
from rems_net.fabric import join

EXAMPLES = """\
examples:
  rems clock pause
  rems clock step 10
  rems clock resume
  rems clock pace 0.5         half of real time; "fast" is as fast as it goes
  rems clock end              as if the duration were over
"""
WHAT = ("pause", "step", "resume", "pace", "end")


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems clock` can be told."""
    parser.add_argument("what", metavar="WHAT", help=f"one of {', '.join(WHAT)}")
    parser.add_argument(
        "value", nargs="?", help="how many ticks to step (1), or which pace"
    )
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """Tell the clock, and say where it stands."""
    if args.what not in WHAT:
        raise ExperimentError(
            f"there is no `rems clock {args.what}`; expected one of {', '.join(WHAT)}."
            f"{nearest(args.what, WHAT)}"
        )
    given = () if args.value is None else (_value(args.what, args.value),)
    if args.what == "pace" and not given:
        raise ExperimentError('which pace? Such as 1, 0.5 or "fast".')
    with join(fabric=args.fabric, at=args.at) as fabric:
        said = fabric.clock(args.what, *given)
    if args.what == "pace":
        print(f"pace {said:g}" if said else "as fast as it goes")
    else:
        print(f"tick {said}")
    return 0


def _value(what: str, text: str) -> int | float | str:
    if what == "step":
        if not text.isdigit():
            raise ExperimentError(f"step by {text!r}; expected a whole number from 1.")
        return int(text)
    if what != "pace":
        raise ExperimentError(f"{what} takes no value; got {text!r}.")
    try:
        return float(text)
    except ValueError:
        return text
