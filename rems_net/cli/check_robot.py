"""`rems check-robot DEFINITION [DRIVER]`: whether it does what a robot must."""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import redirect_stdout
from pathlib import Path

from rems_net.agents import registry
from rems_net.agents.robot import Driver
from rems_net.cli.agent import slots, values
from rems_net.cli.words import console
from rems_net.errors import ExperimentError
from rems_net.testing import Outcome, Report, Subject, examine

EXAMPLES = """\
examples:
  rems check-robot my_file.py:MyRobot            by its own mathematics
  rems check-robot woodbot mujoco
  rems check-robot woodbot my_file.py:MyDriver
  rems check-robot my_file.py:MyRobot mujoco --set options.physics_step=2ms
  rems check-robot create2 create2 --set options.port=/dev/ttyUSB0 --moves
  rems check-robot woodbot kinematic --alone     without processes: faster

What is wrong is told with what was expected, what came, which line, and what
to type. The exit status is 0 where nothing is wrong, else 1. In a test of
your own: rems_net.testing.check_robot. See docs/robots_check.md.
"""


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems check-robot` can be told."""
    parser.add_argument("definition", metavar="DEFINITION", help="what it is")
    parser.add_argument(
        "driver", metavar="DRIVER", nargs="?", help="how it is done (kinematic)"
    )
    parser.add_argument(
        "--set",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="parameters.NAME, options.NAME or initial.NAME",
    )
    parser.add_argument(
        "--moves", action="store_true", help="a robot that is really driven may move"
    )
    parser.add_argument(
        "--alone", action="store_true", help="without runs in processes of their own"
    )
    parser.add_argument(
        "--only",
        metavar="CHECK",
        action="append",
        default=[],
        help="this one, such as stops; may be given again",
    )
    parser.add_argument("--json", action="store_true", help="for programs")


def run(args: argparse.Namespace) -> int:
    """Check it, and say what was found as it is found."""
    subject = _subject(args.definition, args.driver, args.set)
    outcomes = examine(subject, moves=args.moves, alone=args.alone, only=args.only)
    out = console(args)
    report = Report(subject.title)
    if not args.json:
        out.print(report.title, style="bold")
    while (outcome := _next(outcomes)) is not None:
        report.outcomes.append(outcome)
        if not args.json:
            style = "red" if not outcome.ok else "dim" if outcome.skipped else ""
            out.print("\n".join(outcome.lines()), style=style, soft_wrap=True)
    if args.json:
        print(json.dumps(report.to_plain(), indent=2))
    else:
        out.print(report.verdict(), style="bold")
    return 0 if report.ok else 1


def _next(outcomes: Iterator[Outcome]) -> Outcome | None:
    """The next outcome; what the robot prints meanwhile is not of the report."""
    with redirect_stdout(sys.stderr):
        return next(outcomes, None)


def _subject(definition: str, driver: str | None, told: Sequence[str]) -> Subject:
    """What is to be checked. Raises ExperimentError."""
    if driver is None and ":" in definition:
        cls = registry.load(definition, Path())
        if issubclass(cls, Driver):
            raise ExperimentError(
                f"{cls.__name__} is a driver; say what it drives: rems check-robot "
                f"woodbot {definition}"
            )
    settings = slots(values(told, "options.substeps=4"))
    return Subject.of(definition, driver or "kinematic", Path(), **settings)
