"""`rems run EXPERIMENT.toml`, or a script that runs one."""

import argparse
import sys
from contextlib import redirect_stdout
from importlib import import_module
from pathlib import Path
from typing import Any

from rems_net.agents.experiment.checking.settings import check_seed
from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.experiment.folder import Result
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.limits import check_pace
from rems_net.cli.options import (
    add_fabric,
    console,
    fabric_of,
    say_where,
    show_files,
    warn,
)
from rems_net.cli.script import run_experiment
from rems_net.errors import AgentError, ExperimentError, FabricError, RemsError
from rems_net.events import Event
from rems_net.libraries import look_for

EXAMPLES = """\
examples:
  rems run lab2.toml
  rems run lab2.toml --pace 1 --out results
  rems run lab2.toml --alone                  though it has machine = "b"
  rems run weave.py --pace 1
  rems run lab2.toml --pace 1 --dashboard     with a page in the browser
  rems run lab2.toml --direct                 in one process: short runs
  rems run lab2.toml --seed 7                 other random numbers
  rems run weave.py -- fast 3                 sys.argv[1:] of the script
  rems run lab2.toml --json                   events and report, for programs

A script runs as `python weave.py` would run it. Each run() in it shows its
progress, takes --pace, --out, --seed, --native and --alone from here, and
reports. With --json, what it prints itself goes to stderr.
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "experiment",
        metavar="EXPERIMENT.toml",
        type=Path,
        help="an experiment, or a script (EXPERIMENT.py) that runs one",
    )
    parser.add_argument(
        "--alone",
        action="store_true",
        help="start here also what is to be on other machines",
    )
    parser.add_argument(
        "--direct",
        action="store_true",
        help="step all agents in this process: sooner, and the same bytes",
    )
    parser.add_argument(
        "--seed",
        metavar="N",
        type=int,
        help="what random numbers come from (default: as in the experiment, or 0)",
    )
    parser.add_argument(
        "--native",
        action="store_true",
        help="compute with all that this processor has; other laptops then differ "
        "in the last digits",
    )
    parser.add_argument(
        "--dashboard",
        action="store_true",
        help="show it on a page in the browser, as long as it runs",
    )
    parser.add_argument(
        "--json",
        action="store_true",
        help="for programs: what happens, and the report, one JSON object a line",
    )
    add_common(parser)


def add_common(parser: argparse.ArgumentParser) -> None:
    """Add the options of every verb that runs an experiment."""
    parser.add_argument(
        "--out", metavar="DIR", type=Path, help="folder for the results (runs/<name>)"
    )
    add_fabric(parser)
    parser.add_argument(
        "--pace",
        metavar="P",
        help='real-time factor, such as 1, or "fast" (default: as in the experiment)',
    )


def run(args: argparse.Namespace) -> int:
    """Run the experiment or script, show its progress, and report."""
    if not args.json:
        _run(args)
        return 0
    from rems_net.cli.jsonlines import JsonLines

    args.json = lines = JsonLines()
    try:
        with redirect_stdout(sys.stderr):
            _run(args)
    except (RemsError, KeyboardInterrupt) as error:
        lines.failed(error)
        raise
    return 0


def _run(args: argparse.Namespace) -> None:
    if args.experiment.suffix == ".py" and not args.direct:
        # before a zenoh.py next to the script can hide another
        import_module("rems_net.agents.experiment.display")
        import_module("rems_net.agents.experiment.run")
    run_experiment(args.experiment, args.words, Runner(args))


class Runner:
    """Run of an experiment by the command line: shows its progress, and reports."""

    def __init__(self, args: argparse.Namespace):
        self.args = args
        self._before = ""
        if args.pace is not None:
            check_pace(args.pace)

    def __call__(
        self,
        experiment: Experiment,
        out: Path | str | None = None,
        *,
        pace: float | str | None = None,
        alone: bool = False,
        direct: bool = False,
        show: Show | None = None,
    ) -> Result:
        """Run it; the options of the command line win."""
        args = self.args
        if args.out and self._before:
            raise ExperimentError(
                f"this is the second run after {self._before}, and --out names one "
                "folder for both; leave it out, and give each experiment its name."
                " (R0904)"
            )
        experiment.fabric = fabric_of(args) or experiment.fabric
        if (seed := getattr(args, "seed", None)) is not None:
            experiment.seed = check_seed(seed)
        experiment.native = getattr(args, "native", False) or experiment.native
        direct = getattr(args, "direct", False) or direct or experiment.direct
        if not (direct or self._before):
            say_where("")
        self._before = experiment.name
        folder = Path(args.out or out or Path("runs") / experiment.name).resolve()
        lines: Any = getattr(args, "json", None) or None
        pace = pace if args.pace is None else args.pace
        alone = getattr(args, "alone", False) or alone
        show = lines or show or self._show(experiment, direct)
        if getattr(args, "dashboard", False):
            show = self._with_page(show, direct)
        try:
            result = experiment.run(
                folder, pace=pace, alone=alone, direct=direct, show=show
            )
        except FabricError as error:
            if show.clock is None:  # the run had not begun
                raise
            raise AgentError("clock", str(error)) from None
        except (AgentError, KeyboardInterrupt) as error:
            notes = getattr(error, "__notes__", ())
            if not notes and isinstance(error, KeyboardInterrupt):
                notes = ("Interrupted before the first tick.",)
            for note in notes:
                warn(note)
            raise
        if lines:
            lines.report(result)
            return result
        show_files([*result.files, *result.others])
        if len(result) > 1:
            # Imported here, as below: rich takes 100 ms to load.
            from rems_net.cli.report import report

            report(console(self.args), experiment.name, result)
        return result

    def _with_page(self, show: Show, direct: bool) -> Show:
        """Return the display with a page beside it."""
        from rems_net.cli.beside import WithPage

        look_for("websockets", "dashboard")
        if direct:
            raise ExperimentError(
                "--dashboard looks at a run on a fabric, and a direct run is on none; "
                "leave out one of --dashboard and --direct. (R1001)"
            )
        return WithPage(show)

    def _show(self, experiment: Experiment, direct: bool) -> Show:
        """Return the display of a run: its progress, or lines if it is direct."""
        if direct:
            return Lines()
        from rems_net.agents.experiment.display import Progress

        return Progress(experiment.name, console(self.args))


class Lines(Show):
    """Display of a direct run's warnings, on stdout."""

    def say(self, source: str, event: Event) -> None:
        """Print one line."""
        print(f"[{source}] {event}", flush=True)
