"""`rems export DIR [ROBOT ...]`: a recording as CSV or Parquet files."""

import argparse
from pathlib import Path

from rems_net.cli.options import add_like, add_run, recording_of
from rems_net.errors import shown
from rems_net.recordings.export.files import KINDS

EXAMPLES = """\
examples:
  rems export                              the newest run, as CSV, in its folder
  rems export runs/lab sim --to parquet
  rems export runs/lab/run.mcap input/keys --out tables
"""


def add(parser: argparse.ArgumentParser) -> None:
    add_run(parser)
    add_like(parser)
    parser.add_argument(
        "names",
        metavar="ROBOT",
        nargs="*",
        default=(),  # without a default argparse calls it required
        help="a robot, or the key of an input or a process (all robots and worlds)",
    )
    parser.add_argument("--to", choices=KINDS, default="csv", help="kind of the files")
    parser.add_argument(
        "--out", metavar="DIR", type=Path, help="folder of the files (DIR/export)"
    )


def run(args: argparse.Namespace) -> int:
    """Write the files, and print their paths."""
    recording = recording_of(args)
    folder = (args.out or recording.folder / "export").absolute()
    for path in recording.export(*args.names, to=args.to, folder=folder):
        print(shown(path))
    return 0
