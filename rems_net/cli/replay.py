"""`rems replay FILE`: recorded values on a fabric again."""

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

from rems_net.agents.experiment.again.replayed import replayed
from rems_net.agents.experiment.display import usual
from rems_net.cli.info import recording_in
from rems_net.cli.options import add_fabric, fabric_of

EXAMPLES = """\
examples:
  rems replay runs/lab                     at the pace of real time
  rems replay runs/lab/run.mcap --pace 4   four times as fast
  rems watch 'robot/*/state'               meanwhile, in another terminal
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "path",
        metavar="FILE",
        type=Path,
        help="a file of an output of type mcap, or the folder of a run",
    )
    parser.add_argument(
        "--pace", metavar="X", default="1", help='real-time factor, or "fast" (1)'
    )
    add_fabric(parser)


def run(args: argparse.Namespace) -> int:
    """Play the recording to its end."""
    lab, left_out = replayed(recording_in(args.path))
    lab.fabric = fabric_of(args)
    for key in left_out:
        print(f"{key} is not played: what plays has no worlds.")
    with TemporaryDirectory() as folder:
        lab.run(Path(folder) / "replay", pace=args.pace, show=usual(lab.name))
    return 0
