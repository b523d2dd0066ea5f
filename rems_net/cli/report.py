"""What is told after a run: where its files are, and how far its robots are apart."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from pathlib import Path

from rich.console import Console
from rich.table import Table

from rems_net.cli.words import plain_table, show_path, warn
from rems_net.errors import MissingPartError
from rems_net.recordings.comparison import Pair, Trajectory, compare, trajectories
from rems_net.recordings.csv_file import heading
from rems_net.recordings.differences import Difference
from rems_net.recordings.picture import draw
from rems_net.recordings.recording import Recording, natural

PICTURE = "comparison.png"


def report(console: Console, title: str, folder: Path, files: Sequence[Path]) -> None:
    """Say where the files are, and how far apart robots were, if there are two."""
    files = sorted(files, key=natural)
    robots = trajectories(files)
    pairs = compare(robots)
    others = Recording(folder, files).differences({robot.name for robot in robots})
    for i, path in enumerate(files):
        console.print(f"{'files    ' if i == 0 else '         '}{show_path(path)}")
    if not files:
        console.print("The outputs wrote no files.")
    if pairs:
        _picture(console, title, folder, robots, pairs)
        console.print()
        console.print(pairs_table(pairs))
    if others:
        console.print()
        console.print(differences_table(others))


def _picture(
    console: Console,
    title: str,
    folder: Path,
    robots: Sequence[Trajectory],
    pairs: Sequence[Pair],
) -> None:
    try:
        draw(folder / PICTURE, title, robots, pairs)
        console.print(f"picture  {show_path(folder / PICTURE)}")
    except MissingPartError as error:
        warn(error)
    except OSError as error:
        warn(f"cannot write {folder / PICTURE}: {error.strerror}.")


def pairs_table(pairs: Sequence[Pair]) -> Table:
    """One line per pair: position error, heading error, when they parted."""
    columns = (
        "position\nrms [mm]",
        "position\nfinal [mm]",
        "heading\nrms [deg]",
        "heading\nfinal [deg]",
        "first apart\n> 10 mm",
    )
    table = plain_table("\npair", *columns, right=columns)
    for pair in pairs:
        table.add_row(
            f"{pair.a} - {pair.b}",
            f"{1e3 * pair.rms:.2f}",
            f"{1e3 * pair.final:.2f}",
            f"{degrees(pair.rms_turn):.2f}",
            f"{degrees(pair.final_turn):+.2f}",
            "never" if pair.parted is None else f"{pair.parted:.2f} s",
        )
    return table


def differences_table(found: Sequence[Difference]) -> Table:
    """One line per pair and field, in the unit of the first."""
    columns = ("rms", "final", "most")
    table = plain_table("pair", "field", *columns, right=columns)
    for one in found:
        numbers = f"{one.rms:.4g}", f"{one.final:+.4g}", f"{one.most:.4g}"
        field = heading(one.field.removeprefix("state/"), one.unit)
        table.add_row(f"{one.a} - {one.b}", field, *numbers)
    return table
