"""`rems plot DIR [FIELD ...]`: a picture of a run that is over."""

import argparse
from pathlib import Path

from rems_net.cli.options import add_like, add_run, recording_of, writing
from rems_net.errors import ExperimentError, shown

EXAMPLES = """\
examples:
  rems plot                               the newest run
  rems plot runs/lab                      paths, distances, headings
  rems plot runs/lab sensors/lidar        fields against time
  rems plot runs/lab state/x state/y --out xy.png
"""


def add(parser: argparse.ArgumentParser) -> None:
    add_run(parser)
    add_like(parser)
    parser.add_argument(
        "fields",
        metavar="FIELD",
        nargs="*",
        default=(),  # without a default argparse calls it required
        help='a column, or what it begins with ("state")',
    )
    parser.add_argument(
        "--out", metavar="FILE", type=Path, help=".png, .svg or .pdf (DIR/plot.png)"
    )


def run(args: argparse.Namespace) -> int:
    """Draw the picture, and print its path."""
    recording = recording_of(args)
    path = (args.out or recording.folder / "plot.png").absolute()
    try:
        with writing(path):
            recording.plot(*args.fields, path=path)
    except ValueError as error:
        if isinstance(error, ExperimentError):
            raise
        raise ExperimentError(f"cannot write {path}: {error}. (R0905)") from None
    print(f"picture  {shown(path)}")
    return 0
