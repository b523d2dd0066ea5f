"""What is told after a run: where its files are, and how far its robots are apart."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from pathlib import Path

from rich.console import Console
from rich.table import Table

from rems_net.cli.words import plain_table, show_path, warn
from rems_net.errors import MissingPartError
from rems_net.recordings.comparison import Pair, compare, trajectories
from rems_net.recordings.picture import draw
from rems_net.recordings.recording import natural

PICTURE = "comparison.png"


def report(console: Console, title: str, folder: Path, files: Sequence[Path]) -> None:
    """Say where the files are; compare the two-wheeled robots, if there are two."""
    files = sorted(files, key=natural)
    robots = trajectories(files)
    pairs = compare(robots)
    for i, path in enumerate(files):
        console.print(f"{'files    ' if i == 0 else '         '}{show_path(path)}")
    if not files:
        console.print("The outputs wrote no files.")
    if not pairs:
        return
    try:
        draw(folder / PICTURE, title, robots, pairs)
        console.print(f"picture  {show_path(folder / PICTURE)}")
    except MissingPartError as error:
        warn(error)
    except OSError as error:
        warn(f"cannot write {folder / PICTURE}: {error.strerror}.")
    console.print()
    console.print(pairs_table(pairs))


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
