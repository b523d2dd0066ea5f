"""`rems compare DIR`: the table and the picture of a run that is over, and why."""

import argparse

from rems_net.cli.options import add_like, add_run, console, recording_of, show_files
from rems_net.cli.report import report
from rems_net.errors import ExperimentError
from rems_net.recordings.parting.why import reference

EXAMPLES = """\
examples:
  rems compare                              the newest run
  rems compare runs/demo
  rems compare runs/demo mujoco             where and why from kinematic
  rems compare runs/demo mujoco pybullet
"""


def add(parser: argparse.ArgumentParser) -> None:
    add_run(parser)
    add_like(parser)
    parser.add_argument(
        "robots",
        metavar="ROBOT",
        nargs="*",
        default=(),  # without a default argparse calls it required
        help="where and why this one parts from the first, or the second of two from "
        "the first of them",
    )


def run(args: argparse.Namespace) -> int:
    """Compare the robots of a recording."""
    recording = recording_of(args)
    folder = recording.folder
    robots: list[str] = args.robots
    if len(robots) > 2:
        raise ExperimentError(
            f"expected one robot or two behind the folder, but got {', '.join(robots)}."
            " (R0904)"
        )
    if robots:
        a, b = [reference([*recording]), *robots][-2:]
        console(args).print(repr(recording.why(a, b)), soft_wrap=True)
    else:
        show_files(recording.tables())
        report(console(args), folder.name, recording)
    return 0
