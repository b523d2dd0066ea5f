"""`rems repair FILE`: give a recording its end after a power cut."""

import argparse
import os
from pathlib import Path

from rems_net.cli.info import recording_in
from rems_net.errors import ExperimentError
from rems_net.recordings.mcap.reader import McapFile
from rems_net.recordings.mcap.scan import finish, scan

EXAMPLES = """\
examples:
  rems repair runs/lab                of a run whose laptop lost its power
  rems repair runs/lab/run.mcap

If only a process of the run was killed, the run itself has done this.
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "path", metavar="FILE", type=Path, help="a run.mcap, or the folder of a run"
    )


def run(args: argparse.Namespace) -> int:
    """Finish the file, and print how much of the run it has."""
    path = recording_in(args.path)
    try:
        done = finish(path) or _mended(path)
    except FileNotFoundError:
        raise ExperimentError(
            f"there is no file {path}; expected a recording, such as "
            "runs/lab/run.mcap. (R0803)"
        ) from None
    except OSError as error:
        raise ExperimentError(
            f"cannot repair {path}: {error.strerror or os.strerror(error.errno or 0)}; "
            "copy it to a disk with room for it, and repair the copy. (R0905)"
        ) from None
    file = McapFile(path)
    has = f"{sum(file.counts.values())} values, until {file.end:g} s"
    print(f"{path} {'has an end now' if done else 'is whole'}: it has {has}.")
    return 0


def _mended(path: Path) -> bool:
    """Write a damaged summary anew, and check the chunks of a recording of ours.

    Returns whether the file has changed. Raises OSError, and ExperimentError for a
    damaged chunk.
    """
    try:
        ours = McapFile(path).about()
    except ExperimentError:
        return finish(path, damaged=True)
    if ours:
        scan(path)
    return False
