"""check_robot: examine every behaviour of a robot, and report what is wrong."""

from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from rems_net.agents import registry
from rems_net.agents.diagnosis import describe
from rems_net.errors import ConformanceError, ExperimentError, RemsError, nearest
from rems_net.testing import lines
from rems_net.testing.checks.agreeing import agrees
from rems_net.testing.checks.building import built, refuses
from rems_net.testing.checks.driving import drives, senses
from rems_net.testing.checks.lasting import again, closes, opens
from rems_net.testing.checks.processes import processes
from rems_net.testing.checks.resetting import resets, shares
from rems_net.testing.checks.stopping import stops
from rems_net.testing.report import Outcome, Report
from rems_net.testing.subject import Subject

Check = Callable[[Subject, Outcome], None]
#: In this order; the behaviour that is expected of each, if an exception came instead.
CHECKS: dict[Check, str] = {
    built: "a robot that can be built from its name and its settings",
    opens: "open() that returns",
    drives: "drive(command, dt) that obeys every command of its schema",
    senses: "sense() that brings state and sensors up to date",
    resets: "reset() that brings it back to where it began",
    stops: "a robot that obeys its safe command when no command comes",
    refuses: "a wrong command or setting to be refused, and nothing else to happen",
    closes: "close() that returns, also twice, and before open()",
    again: "another one that opens after the first was closed",
    shares: "two of them in one process",
    agrees: "the same motion as its own mathematics, in slow motion",
    processes: "a run in a process of its own, and in a process with another one",
}
#: If one of these fails, the rest are skipped.
FIRST = (built, opens)


def check_robot(
    definition: str | type,
    driver: str | type = "kinematic",
    *,
    parameters: Mapping[str, Any] | None = None,
    options: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    folder: Path | str = ".",
    moves: bool = False,
    alone: bool = False,
    only: Collection[str] = (),
) -> Report:
    """Check that a robot does what every robot must; raise if it does not.

    definition, driver: names, `file.py:Class`, or classes, as `Experiment.robot` takes
        them; also parameters, options and initial.
    folder: base of relative file names.
    moves: confirms that a driven robot may move.
    alone: skip the runs in separate processes, which take some seconds.
    only: the names of some checks, such as "stops"; all by default.

    Raises ConformanceError with every mistake: what was expected, what came, which
    line, and what to type. Raises ExperimentError if the classes are no robot.
    """
    subject = Subject.of(
        definition,
        driver,
        Path(folder),
        parameters=parameters or {},
        options=options or {},
        initial=initial or {},
    )
    if registry.runner() is registry.end_script:
        return Report(subject.title)  # only the classes of this script are wanted
    found = examine(subject, moves=moves, alone=alone, only=only)
    report = Report(subject.title, list(found))
    if not report.ok:
        raise ConformanceError(f"{report} (R0316)")
    return report


def examine(
    subject: Subject,
    *,
    moves: bool = False,
    alone: bool = False,
    only: Collection[str] = (),
) -> Iterator[Outcome]:
    """Do one check after the other, and yield the outcome of each.

    Raises ExperimentError for a driven robot, if `moves` does not allow it to move.
    """
    if subject.driven and not moves:
        raise ExperimentError(
            f"{subject.title} is really driven, and each of its commands is tried at a "
            "tenth of what it can do: put it on a stand, or where it has a metre of "
            "room. Then allow it: moves=True, or rems check ... --moves (R0912)"
        )
    why, known = "", dict[str, str]()
    for check in _chosen(only, alone):
        outcome = Outcome(check.__name__, skipped=why)
        if not why:
            ended = _look(check, subject, outcome)
            _pass_over(outcome, known)
            if check in FIRST and not ended:
                why = f"not looked at, because of what is wrong with {outcome.name!r}"
        yield outcome


def _chosen(only: Collection[str], alone: bool) -> list[Check]:
    """Return the first checks and those asked for. Raises ExperimentError if unknown.

    alone: without the one that takes some seconds, for real processes on a fabric
    """
    every = {check.__name__: check for check in CHECKS}
    for name in only:
        if name not in every:
            raise ExperimentError(
                f"There is no check {name!r}; there is {', '.join(every)}."
                f"{nearest(name, every)} (R0912)"
            )
    if alone:
        del every["processes"]
    wanted = only or every
    return [check for name, check in every.items() if check in FIRST or name in wanted]


def _pass_over(outcome: Outcome, known: dict[str, str]) -> None:
    """Report a problem only once if several checks find it."""
    new = [one for one in outcome.findings if not any(k in one.came for k in known)]
    if outcome.findings and not new:
        came = outcome.findings[0].came
        first = next(check for said, check in known.items() if said in came)
        outcome.findings, outcome.skipped = [], f"the same as in {first!r}"
    for one in new:
        known[one.came] = outcome.name


def _look(check: Check, subject: Subject, outcome: Outcome) -> bool:
    """Do one check, and return whether it reached its end.

    Every exception becomes a finding.
    """
    try:
        check(subject, outcome)
        return True
    except Exception as error:
        ours = isinstance(error, RemsError)
        outcome.wrong(
            expected=CHECKS[check],
            came=str(error) if ours else f"{type(error).__name__}: {error}",
            where=lines.raised(error) or ("" if ours else describe(error)),
            type="" if ours else "mend that line, and check again",
        )
        return False
