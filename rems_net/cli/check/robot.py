"""`rems check DEFINITION [DRIVER]`: whether it does what a robot must."""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from contextlib import redirect_stdout
from pathlib import Path

from rems_net.agents import registry
from rems_net.agents.robot import Driver
from rems_net.cli.agent.start import slots, values
from rems_net.cli.words import console
from rems_net.errors import ExperimentError
from rems_net.testing import Outcome, Report, Subject, examine


def run(args: argparse.Namespace) -> int:
    """Check it, and say what was found as it is found."""
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
    """The next outcome; what the robot prints meanwhile is not of the report."""
    with redirect_stdout(sys.stderr):
        return next(outcomes, None)


def _subject(definition: str, driver: str | None, told: Sequence[str]) -> Subject:
    """What is to be checked. Raises ExperimentError."""
    if driver is None and ":" in definition:
        cls = registry.load(definition, Path())
        if issubclass(cls, Driver):
            raise ExperimentError(
                f"{cls.__name__} is a driver; say what it drives: rems check "
                f"woodbot {definition}"
            )
    settings = slots(values(told, "options.substeps=4"))
    return Subject.of(definition, driver or "kinematic", Path(), **settings)
