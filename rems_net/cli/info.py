"""`rems info [DIR]`: what is in a recording."""

import argparse
from pathlib import Path

from rems_net.cli.options import add_run, run_of
from rems_net.errors import ExperimentError
from rems_net.recordings.mcap.info import describe
from rems_net.recordings.mcap.reader import McapFile
from rems_net.recordings.mcap.writer import FILE

EXAMPLES = """\
examples:
  rems info runs/lab/run.mcap     what was run, its keys, rates and ranges
  rems info                       of the newest run
  rems info runs/lab              the same file, by its folder
"""


def add(parser: argparse.ArgumentParser) -> None:
    add_run(parser)


def run(args: argparse.Namespace) -> int:
    """Print what is in the file."""
    for line in describe(McapFile(recording_in(run_of(args)))):
        print(line)
    return 0


def recording_in(path: Path) -> Path:
    """Return the MCAP file that is meant by it, or by its folder."""
    if path.is_dir():
        if not (path / FILE).is_file():
            raise ExperimentError(
                f"there is no {FILE} in {path}; an output of type mcap writes it. CSV "
                f"files are compared by: rems compare {path} (R0436)"
            )
        path /= FILE
    return path
