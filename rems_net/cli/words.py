"""How the command line speaks: to people on a console, complaints on stderr."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rems_net.errors import ExperimentError
from rems_net.router.keys import check_name

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from rems_net.defdict import Schema

#: the fields of a schema that are named where it is shown in one line
MANY = 12


class HelpFormatter(argparse.RawDescriptionHelpFormatter):
    """Keeps the line breaks of examples, and to 80 columns."""

    def __init__(self, prog: str):
        super().__init__(prog, max_help_position=26, width=78)


def console(args: argparse.Namespace) -> Console:
    """Where results go. Colours only on a terminal, and only if they are wanted."""
    # Here: it takes a twentieth of a second to load, and many verbs print plain lines.
    from rich.console import Console

    # NO_COLOR is rich's own; None leaves the decision to it.
    return Console(no_color=args.no_color or None, highlight=False, markup=False)


def warn(sentence: object) -> None:
    """Say one thing on stderr."""
    print(f"rems: {sentence}", file=sys.stderr, flush=True)


def say_where(at: str) -> None:
    """Say at which other machine the router is, if it is at one."""
    from rems_net.router.find import VARIABLE, chosen
    from rems_net.router.finding.address import is_here

    if (there := chosen(at)) and not is_here(there):
        why = (
            f"{VARIABLE} says so"
            if os.environ.get(VARIABLE)
            else "see `rems router forget`"
        )
        why = "--at says so" if at else why
        warn(f"at {there} ({why})")


def add_experiment(parser: argparse.ArgumentParser) -> None:
    """What a verb runs, or looks at."""
    parser.add_argument(
        "experiment",
        metavar="EXPERIMENT.toml",
        type=Path,
        help="an experiment, or a script (EXPERIMENT.py) that runs one",
    )


def add_run(parser: argparse.ArgumentParser) -> None:
    """Add the folder of a run that is over: the newest one, if it is left out."""
    parser.add_argument(
        "folder", metavar="DIR", type=Path, nargs="?", help="a run (the newest in runs)"
    )


def run_of(args: argparse.Namespace) -> Path:
    """Return the folder of a run. Raises ExperimentError if there is none in `runs`."""
    folder: Path | None = args.folder
    if folder is None:
        found = [
            (path.stat().st_mtime, path) for path in Path("runs").glob("*/run.json")
        ]
        if not found:
            raise ExperimentError(
                "there is no run in the folder runs here. Name one, such as `rems plot "
                "results/lab`, or go to the folder in which you typed `rems run`."
            )
        folder = max(found)[1].parent
    return folder


def add_at(parser: argparse.ArgumentParser) -> None:
    """Which of several runs a verb is for."""
    parser.add_argument(
        "--at", metavar="PORT", default="", help="which run, where there are several"
    )
    add_fabric(parser)


def add_fabric(parser: argparse.ArgumentParser) -> None:
    """Which of the fabrics at a router a verb is for."""
    parser.add_argument(
        "--fabric", default="", metavar="NAME", help="which fabric of a class's router"
    )


def fabric_of(args: argparse.Namespace) -> str:
    """What `--fabric` says; nothing where it was not given. Raises ExperimentError."""
    return check_name(args.fabric, "--fabric") if args.fabric else ""


def plain_table(*columns: str, right: tuple[str, ...] = ()) -> Table:
    """A table without lines, whose last words are never cut off."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for name in columns:
        table.add_column(
            name, justify="right" if name in right else "left", overflow="fold"
        )
    return table


def short_key(key: str, fabric: str) -> str:
    """A key without the fabric, as people type it."""
    return key.removeprefix(f"{fabric}/")


def show_path(path: Path) -> str:
    """A path relative to here, if that is shorter."""
    try:
        return str(path.relative_to(Path.cwd()))
    except (ValueError, OSError):  # it is elsewhere; or here is nowhere any more
        return str(path)


def show_files(files: Sequence[Path]) -> None:
    """Print where the files of a run are."""
    from rems_net.recordings.recording import natural

    for i, path in enumerate(sorted(files, key=natural)):
        print(f"{'' if i else 'files':<9}{show_path(path)}")
    if not files:
        print("The outputs wrote no files.")


def show_schema(schema: Schema) -> str:
    """`x [m], y [m], heading [rad]`, and how many more beyond a dozen."""
    pairs = zip(schema.paths, schema.fields, strict=True)
    each = [f"{path} [{f.unit}]" if f.unit else path for path, f in pairs]
    rest = [f"and {len(each) - MANY} more"] if len(each) > MANY else []
    return ", ".join([*each[:MANY], *rest])


def show_value(described: Mapping[str, Any]) -> str:
    """`0.125 m` of `{"value": 0.125, "unit": "m"}`; of a long array, what it spans."""
    value, unit = described["value"], described["unit"]
    text = f"{value:.6g}" if isinstance(value, float) else _summary(value)
    return f"{text} {'%' if unit == 'percent' else unit}" if unit else text


def _summary(value: Any) -> str:
    """`39 x 52 x 3 numbers, 12 to 255` of more than fit into a line, else all of it."""
    if not isinstance(value, list):
        return str(value)
    import numpy as np

    try:
        found = np.asarray(value)
    except ValueError:  # no array, but a list of anything
        return str(value)
    if found.size <= MANY or found.dtype.kind not in "iuf":
        return str(value)
    shape = " x ".join(map(str, found.shape))
    return f"{shape} numbers, {found.min():.6g} to {found.max():.6g}"
