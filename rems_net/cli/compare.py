"""`rems compare DIR`: the table and the picture of a run that is over."""

from __future__ import annotations

import argparse
from pathlib import Path

from rems_net.cli.report import report
from rems_net.cli.words import console
from rems_net.recordings.recording import read

EXAMPLES = """\
examples:
  rems compare runs/demo
"""


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems compare` can be told."""
    parser.add_argument("folder", metavar="DIR", type=Path)


def run(args: argparse.Namespace) -> int:
    """Compare the robots whose CSV files are in the folder."""
    recording = read(args.folder)
    folder = recording.folder
    report(console(args), folder.name, folder, recording.tables())
    return 0
