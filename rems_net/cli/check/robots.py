"""`rems check robots`: every robot with every driver, measured."""

import argparse
import json
import sys
from collections.abc import Iterable, Sequence
from contextlib import redirect_stdout

from rich.console import Console

from rems_net.cli.options import console, plain_table, warn
from rems_net.testing.cells import HARDWARE, cells
from rems_net.testing.matrix import Measured, measured


def run(args: argparse.Namespace) -> int:
    """Measure all cells, and print the table. Return 1 if a cell fails."""
    found = []
    for cell in cells(args.more):
        if cell.subject is not None:
            warn(f"measuring {cell.name}")
        with redirect_stdout(sys.stderr):  # drivers print, too
            found.append(measured(cell))
    if args.json:
        print(json.dumps([one.to_plain() for one in found], indent=2))
    else:
        show(console(args), found)
    return 0 if all(one.ok for one in found) else 1


def show(out: Console, found: Sequence[Measured]) -> None:
    """Print the table, and below it the text that does not fit into it."""
    columns = _columns(found)
    table = plain_table("", *columns)
    for robot in dict.fromkeys(one.cell.definition for one in found):
        row = [one for one in found if one.cell.definition == robot]
        table.add_row(robot, *(_text(row, column) for column in columns))
    out.print(table)
    for one in found:
        if one.problem:
            out.print(f"{one.cell.name}: {one.problem}")
    lacks = dict.fromkeys(one.cell.why for one in found if one.cell.missing)
    for why in lacks:
        out.print(why)


def _columns(found: Iterable[Measured]) -> list[str]:
    """Return the drivers, with all hardware in one column, at the end."""
    runs = [one.cell for one in found if one.cell.subject is not None]
    columns = dict.fromkeys(cell.driver for cell in runs if not cell.driven)
    return [*columns, *([HARDWARE] if any(cell.driven for cell in runs) else [])]


def _text(row: Sequence[Measured], column: str) -> str:
    """Return the text of one cell.

    For hardware it has a line for each driver, with its name if it is not the robot's.
    """
    texts = []
    for one in row:
        cell = one.cell
        if cell.subject is None or cell.driven != (column == HARDWARE):
            continue
        if cell.driven:
            name = "" if cell.driver == cell.definition else f"{cell.driver} "
            texts.append(f"{name}{_measured(one)}")
        elif cell.driver == column:
            texts.append(_measured(one))
    return "\n".join(texts)


def _measured(one: Measured) -> str:
    """Return `0.41% 1.1k`, or `~2% 50` for hardware, where runs vary."""
    if one.problem:
        return "fails"
    rough, found = one.cell.driven, one.agreement
    off = "" if found is None else share(found.error, rough=rough)
    return f"{off}{'' if one.ok else '!'} {_speed(one.steps)}".strip()


def share(error: float, *, rough: bool) -> str:
    """Return a fraction of the way for the table, such as `0.41%`.

    rough: whether it differs from run to run; then it is `~0.4%`
    """
    percent = 100 * error
    if rough:
        return f"~{percent:.0f}%" if percent >= 10 else f"~{percent:.1g}%"
    if percent < 0.01:
        return "<0.01%"
    return f"{percent:.0f}%" if percent >= 10 else f"{percent:.2g}%"


def _speed(steps: float) -> str:
    return f"{steps / 1e3:.3g}k" if steps >= 1e3 else f"{steps:.3g}"
