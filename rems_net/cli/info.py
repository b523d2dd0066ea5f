"""`rems info [DIR]`: what is in a recording."""

import argparse

from rems_net.cli.words import add_run, run_of
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
    """What `rems info` can be told."""
    add_run(parser)


def run(args: argparse.Namespace) -> int:
    """Print what is in the file."""
    path = run_of(args)
    if path.is_dir():
        if not (path / FILE).is_file():
            raise ExperimentError(
                f"there is no {FILE} in {path}; an output of type mcap writes it. CSV "
                f"files are compared by: rems compare {path}"
            )
        path /= FILE
    for line in describe(McapFile(path)):
        print(line)
    return 0
