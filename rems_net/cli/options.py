"""Options that several verbs have, and their output: results on stdout."""

import argparse
import os
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rems_net.errors import ExperimentError, shown
from rems_net.router.keys import check_name

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from rems_net.defdict import Schema
    from rems_net.recordings.recording import Recording

#: fields of a schema that are named if it is shown in one line
MANY = 12


class HelpFormatter(argparse.RawDescriptionHelpFormatter):
    """Help that keeps the line breaks of examples, in at most 80 columns."""

    def __init__(self, prog: str):
        super().__init__(prog, max_help_position=26, width=78)

    def _format_action(self, action: argparse.Action) -> str:
        """Leave out the line that argparse puts above verbs: it repeats the heading."""
        if isinstance(action, argparse._SubParsersAction):
            return "".join(map(super()._format_action, action._get_subactions()))
        return super()._format_action(action)


def console(args: argparse.Namespace) -> "Console":
    """Return the console for results. Only a terminal gets colours, if wanted."""
    # Imported here: rich takes 50 ms to load, and many verbs print plain lines.
    from rich.console import Console

    # rich reads NO_COLOR itself; None leaves the decision to rich.
    return Console(no_color=args.no_color or None, highlight=False, markup=False)


def warn(sentence: object) -> None:
    """Print one warning on stderr."""
    print(f"rems: {sentence}", file=sys.stderr, flush=True)


def say_where(at: str) -> None:
    """Print at which other machine the router is, if it is not on this one."""
    from rems_net.router.find import VARIABLE, chosen
    from rems_net.router.finding.address import is_here

    if (there := chosen(at)) and not is_here(there):
        why = (
            f"set by {VARIABLE}"
            if os.environ.get(VARIABLE)
            else "see `rems router forget`"
        )
        why = "set by --at" if at else why
        warn(f"at {there} ({why})")


def add_run(parser: argparse.ArgumentParser) -> None:
    """Add the folder of a run that is over: the newest one, if it is left out."""
    parser.add_argument(
        "folder", metavar="DIR", type=Path, nargs="?", help="a run (the newest in runs)"
    )


def add_like(parser: argparse.ArgumentParser) -> None:
    """Add the option for CSV files of another program."""
    parser.add_argument(
        "--like",
        metavar="MAPPING",
        default="",
        help="read CSV files of another program: woodbot-class, or mine.toml",
    )


def recording_of(args: argparse.Namespace) -> "Recording":
    """Return the recording that the arguments name. Raises ExperimentError."""
    from rems_net.recordings.recording import read

    recording = read(run_of(args), like=args.like)
    if not recording.files or [*recording]:
        return recording
    where = shown(recording.files[0])
    if passed := recording.passed():
        which = ", ".join(f"{topic} ({why})" for topic, why in passed.items())
        raise ExperimentError(
            f"nothing in {where} can be read here; passed over: {which}. "
            "Expected the run.mcap of a run. (R0843)"
        )
    raise ExperimentError(
        f"{where} has no values: the process that wrote it ended before its first "
        "second was over. (R0843)"
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
                " (R0908)"
            )
        folder = max(found)[1].parent
    return folder


def add_at(parser: argparse.ArgumentParser) -> None:
    """Add the options that choose one of several runs."""
    parser.add_argument(
        "--at", metavar="PORT", default="", help="which run, where there are several"
    )
    add_fabric(parser)


def add_fabric(parser: argparse.ArgumentParser) -> None:
    """Add the option that chooses a fabric at a router."""
    parser.add_argument(
        "--fabric", default="", metavar="NAME", help="which fabric of a class's router"
    )


def fabric_of(args: argparse.Namespace) -> str:
    """Return the value of `--fabric`, or "". Raises ExperimentError for no name."""
    return check_name(args.fabric, "--fabric") if args.fabric else ""


def plain_table(*columns: str, right: tuple[str, ...] = ()) -> "Table":
    """Return a table without lines that wraps long words instead of cutting them."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for name in columns:
        table.add_column(
            name, justify="right" if name in right else "left", overflow="fold"
        )
    return table


def short_key(key: str, fabric: str) -> str:
    """Return a key without the fabric, as people type it."""
    return key.removeprefix(f"{fabric}/")


def pairs(given: Iterable[str], example: str) -> Iterator[tuple[str, str]]:
    """Yield name and value of each `NAME=VALUE`. Raises ExperimentError."""
    for text in given:
        name, equals, value = text.partition("=")
        if not (name and equals):
            raise ExperimentError(
                f"expected NAME=VALUE, such as {example}; got {text!r}. (R0910)"
            )
        yield name, value


def settings_of(given: Iterable[str], example: str) -> dict[str, Any]:
    """Return the settings of `--set`, by name, each value as in a TOML file.

    A text, such as a number with its unit, needs no quotes.
    """
    from rems_net.toml import value_of

    return {name: value_of(text) for name, text in pairs(given, f"--set {example}")}


def json_or_text(text: str) -> Any:
    """Return a number, true, false, a list ... if the text is JSON; else the text."""
    import json

    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return text


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Raise ExperimentError if this block cannot write the file."""
    try:
        yield
    except OSError as error:
        raise ExperimentError(
            f"cannot write {path}: {error.strerror}. (R0905)"
        ) from None


def show_files(files: Sequence[Path]) -> None:
    """Print the paths of a run's files."""
    from rems_net.recordings.names import natural

    for i, path in enumerate(sorted(files, key=natural)):
        print(f"{'' if i else 'files':<9}{shown(path)}")
    if not files:
        print("The outputs wrote no files.")


def show_schema(schema: "Schema") -> str:
    """Return `x [m], y [m], heading [rad]`, and how many more after the first dozen."""
    pairs = zip(schema.paths, schema.fields, strict=True)
    each = [f"{path} [{f.unit}]" if f.unit else path for path, f in pairs]
    rest = [f"and {len(each) - MANY} more"] if len(each) > MANY else []
    return ", ".join([*each[:MANY], *rest])


def show_value(described: Mapping[str, Any]) -> str:
    """Return `0.125 m` for `{"value": 0.125, "unit": "m"}`; sum up a long array."""
    value, unit = described["value"], described["unit"]
    text = f"{value:.6g}" if isinstance(value, float) else sum_up(value)
    return f"{text} {'%' if unit == 'percent' else unit}" if unit else text


def sum_up(value: Any) -> str:
    """Return `39 x 52 x 3 numbers, 12 to 255` for a long array, else the value."""
    if not isinstance(value, list):
        return str(value)
    import numpy as np

    try:
        found = np.asarray(value)
    except ValueError:  # rows of different lengths
        return str(value)
    if found.size <= MANY or found.dtype.kind not in "iuf":
        return str(value)
    shape = " x ".join(map(str, found.shape))
    return f"{shape} numbers, {found.min():.6g} to {found.max():.6g}"
