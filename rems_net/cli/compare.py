"""`rems compare DIR`: the table and the picture of a run that is over, and why."""

import argparse
from pathlib import Path

from rems_net.cli.options import add_like, add_run, console, recording_of, show_files
from rems_net.cli.report import report
from rems_net.errors import ExperimentError
from rems_net.recordings.comparison import reference
from rems_net.recordings.parting.together import together

EXAMPLES = """\
examples:
  rems compare                              the newest run
  rems compare runs/demo
  rems compare runs/demo mujoco             where and why from kinematic
  rems compare runs/demo mujoco pybullet
  rems compare runs/monday runs/tuesday     each robot with itself in the other
  rems compare runs/monday runs/tuesday sim
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
        "the first of them; or another run",
    )


def _is_run(text: str) -> bool:
    """Return whether this means another run, not a robot or another agent."""
    kind, slash, _ = text.partition("/")
    return Path(text).exists() or bool(slash and kind not in ("input", "process"))


def run(args: argparse.Namespace) -> int:
    """Compare the robots of a recording."""
    recording = recording_of(args)
    robots: list[str] = list(args.robots)
    title = recording.folder.name
    names = [*recording]
    if robots and _is_run(robots[0]):
        args.folder = Path(robots.pop(0))
        recording = together(recording, recording_of(args))
        title, names = f"{title} and {args.folder.name}", []
    if len(robots) > 2:
        raise ExperimentError(
            f"expected one robot or two behind the folder, but got {', '.join(robots)}."
            " (R0904)"
        )
    if robots:
        if len(robots) == 1 and names:
            robots = [reference(names), *robots]
        console(args).print(repr(recording.why(*robots)), soft_wrap=True)
    else:
        show_files(recording.tables())
        report(console(args), title, recording)
    return 0
