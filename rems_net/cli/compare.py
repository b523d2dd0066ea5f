"""`rems compare DIR`: the table and the picture of a run that is over."""

from __future__ import annotations

import argparse
from pathlib import Path

from rems_net.cli.report import report
from rems_net.cli.words import console
from rems_net.errors import ExperimentError

EXAMPLES = """\
examples:
  rems compare runs/demo
"""


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems compare` can be told."""
    parser.add_argument("folder", metavar="DIR", type=Path)


def run(args: argparse.Namespace) -> int:
    """Compare every two-wheeled robot whose CSV file is in the folder."""
    files = sorted(args.folder.glob("*.csv"))
    if not files:
        raise ExperimentError(
            f"There is no CSV file in {args.folder}; expected the folder of a run, "
            "such as runs/demo."
        )
    report(console(args), args.folder.resolve().name, args.folder.resolve(), files)
    return 0
