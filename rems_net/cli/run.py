"""`rems run EXPERIMENT.toml`."""

from __future__ import annotations

import argparse
from pathlib import Path

from rems_net.agents.experiment.checks import check_pace
from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.experiment.file import load, located
from rems_net.cli.progress import Progress
from rems_net.cli.report import report
from rems_net.cli.words import console, show_path, warn
from rems_net.errors import AgentError, ExperimentError, FabricError

EXAMPLES = """\
examples:
  rems run lab2.toml
  rems run lab2.toml --pace 1 --out results
  rems run lab2.toml --elsewhere robot/b      it comes by `rems join`
"""


def add(parser: argparse.ArgumentParser) -> None:
    """What `rems run` can be told."""
    parser.add_argument("experiment", metavar="EXPERIMENT.toml", type=Path)
    parser.add_argument(
        "--elsewhere",
        metavar="AGENT",
        nargs="+",
        default=(),
        help="agents that other machines bring",
    )
    add_common(parser)


def add_common(parser: argparse.ArgumentParser) -> None:
    """What every verb that runs an experiment can be told."""
    parser.add_argument(
        "--out", metavar="DIR", type=Path, help="folder for the results (runs/<name>)"
    )
    parser.add_argument(
        "--pace",
        metavar="P",
        help='real-time factor, such as 1, or "fast" (as the experiment says)',
    )


def run(args: argparse.Namespace) -> int:
    """Run it, show its progress, and report."""
    experiment = load(args.experiment)
    go(experiment, args, args.experiment)
    return 0


def go(experiment: Experiment, args: argparse.Namespace, source: Path) -> None:
    """Run an experiment; raises AgentError for one that failed once it had begun."""
    out = console(args)
    if args.pace is not None:
        check_pace(args.pace)
    folder = (args.out or Path("runs") / experiment.name).resolve()
    show = Progress(experiment.name, out)
    try:
        result = experiment.run(
            folder,
            pace=args.pace,
            elsewhere=getattr(args, "elsewhere", ()),
            show=show,
        )
    except ExperimentError as error:
        with located(source):
            raise error
    except FabricError as error:
        if show.clock is None:  # nothing had begun
            raise
        raise AgentError("clock", str(error)) from None
    except (AgentError, KeyboardInterrupt) as error:
        how = "Interrupted" if isinstance(error, KeyboardInterrupt) else "Ended"
        clock = show.clock
        if clock and clock.tick.n:
            warn(
                f"{how} after tick {clock.done} ({clock.done * clock.dt:.2f} s); what "
                f"the outputs had written is in {show_path(folder)}."
            )
        raise
    report(out, experiment.name, folder, result.files)
