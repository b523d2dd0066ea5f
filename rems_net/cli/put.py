"""`rems put KEY FIELD=VALUE ...`: command a robot."""

import argparse
import time

from rems_net.agents.experiment.checking.settings import seconds
from rems_net.cli.options import add_at, json_or_text, pairs
from rems_net.client import join
from rems_net.errors import ExperimentError
from rems_net.router.keys import full_key

EXAMPLES = """\
examples:
  rems put robot/sim/command wheel/left=3 wheel/right=3
  rems put robot/sim/command wheel/left="50 %" --for "2 s"
  rems put robot/sim/command speed="20 cm/s" turn="10 deg/s"

Fields that are not named keep their value. A robot obeys a command for as long
as its definition has it (0.5 s), then it stands: --for repeats the command.
"""
#: s. Time between two commands with --for; a robot obeys each for 0.5 s.
PERIOD = 0.1


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("key", metavar="KEY", help="such as robot/sim/command")
    parser.add_argument(
        "fields", metavar="FIELD=VALUE", nargs="+", help="a field of the command"
    )
    parser.add_argument(
        "--for", dest="during", metavar="TIME", help="repeat it, such as 2 s"
    )
    add_at(parser)


def run(args: argparse.Namespace) -> int:
    """Command the robot once, or for some time."""
    _, kind, name, *rest = full_key(args.key).split("/")
    if kind != "robot" or rest not in ([], ["command"]):
        raise ExperimentError(
            f"{args.key} can't be put: only a robot takes commands. Type, for example: "
            "rems put robot/sim/command wheel/left=3 (R0904)"
        )
    values = {f: json_or_text(text) for f, text in pairs(args.fields, "wheel/left=3")}
    end = time.monotonic() + (seconds(args.during, "--for") if args.during else 0.0)
    with join(fabric=args.fabric, at=args.at) as fabric:
        robot = fabric.robot(name)
        robot.command.update(values)
        while (left := end - time.monotonic()) > 0:
            time.sleep(min(PERIOD, left))
            robot.command.update(values)
    return 0
