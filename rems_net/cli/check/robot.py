"""`rems check DEFINITION [DRIVER]`: test a robot against the rules for robots."""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import redirect_stdout
from pathlib import Path

from rems_net.agents import registry
from rems_net.agents.robot import Driver
from rems_net.cli.agent.start import slots
from rems_net.cli.options import console, settings_of
from rems_net.errors import ExperimentError
from rems_net.testing import Outcome, Report, Subject, examine


def run(args: argparse.Namespace) -> int:
    """Check the robot, and print each result at once."""
    subject = _subject(args.what, next(iter(args.more), None), args.set)
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
    """Return the next outcome; prints of the robot meanwhile go to stderr."""
    with redirect_stdout(sys.stderr):
        return next(outcomes, None)


def _subject(definition: str, driver: str | None, told: Sequence[str]) -> Subject:
    """Return the robot to check. Raises ExperimentError."""
    if driver is None and ":" in definition:
        cls = registry.load(definition, Path())
        if issubclass(cls, Driver):
            raise ExperimentError(
                f"{cls.__name__} is a driver; write what it drives, too. Type: "
                f"rems check woodbot {definition} (R0904)"
            )
    settings = slots(settings_of(told, "options.substeps=4"))
    settings.pop("marker")  # no camera looks at it
    return Subject.of(definition, driver or "kinematic", Path(), **settings)
