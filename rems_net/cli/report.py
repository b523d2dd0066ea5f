"""Report of a run: how far its robots are apart, and why."""

from collections.abc import Iterator, Sequence
from math import degrees
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

from rems_net.cli.options import plain_table, warn
from rems_net.errors import ExperimentError, MissingPartError, shown
from rems_net.recordings.comparison import CROWD, Pair, Trajectory, reference
from rems_net.recordings.csv_file import heading
from rems_net.recordings.differences import MANY, Difference
from rems_net.recordings.parting.together import Together
from rems_net.recordings.picture import draw
from rems_net.recordings.recording import Recording

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

PICTURE = "comparison.png"
#: robots whose parting is explained; columns of a terminal
SHOWN, WIDE = 9, 80


def report(out: "Console", title: str, recording: Recording) -> None:
    """Print how far apart robots were, if there are two, and draw a picture of it."""
    every = recording.shared if isinstance(recording, Together) else [*recording]
    names = every[:CROWD]
    robots = recording.trajectories(*names)
    pairs = recording.pairs(robots)
    others = recording.differences({robot.name for robot in robots}, *names)
    if len(names) < len(every):
        out.print(f"\nThe first {len(names)} of {len(every)} robots:")
    if pairs:
        _picture(out, title, recording.folder, robots, pairs)
        out.print()
        out.print(pairs_table(pairs))
        for pair in pairs[:MANY]:
            if pair.remark:
                out.print(f"{pair.a} - {pair.b}{pair.remark}", soft_wrap=True)
    if others:
        out.print()
        out.print(differences_table(others))
    for group in (pairs, others):
        if group:
            out.print()
            for line in why_lines(recording, group, min(out.width, WIDE)):
                out.print(line, soft_wrap=True)  # so that its command can be copied


def _picture(
    out: "Console",
    title: str,
    folder: Path,
    robots: Sequence[Trajectory],
    pairs: Sequence[Pair],
) -> None:
    try:
        draw(folder / PICTURE, title, robots, pairs)
        out.print(f"picture  {shown(folder / PICTURE)}", soft_wrap=True)
    except MissingPartError as error:
        warn(error)
    except OSError as error:
        warn(f"cannot write {folder / PICTURE}: {error.strerror}.")


def pairs_table(pairs: Sequence[Pair]) -> "Table":
    """Return a line per pair: position error, heading error, when they parted.

    With many robots it has one line for each, compared with the reference robot.
    """
    first = reference([*dict.fromkeys(n for one in pairs for n in (one.a, one.b))])
    # Robots of two runs are compared with themselves only: no one is in all pairs.
    few = len(pairs) <= MANY or sum(first in (one.a, one.b) for one in pairs) < 2
    columns = (
        "position\nrms [mm]",
        "position\nfinal [mm]",
        "heading\nrms [deg]",
        "heading\nfinal [deg]",
        "first apart\n> 10 mm",
    )
    name = "\npair" if few else f"from\n{first}"
    table = plain_table(name, *columns, right=columns)
    for pair in pairs:
        if not few and first not in (pair.a, pair.b):
            continue
        other = pair.b if pair.a == first else pair.a
        itself = pair.b.startswith(f"{pair.a} (")  # `sim (tuesday)` of another run
        both = pair.b if itself else f"{pair.a} - {pair.b}"
        table.add_row(
            both if few else other,
            f"{1e3 * pair.rms:.2f}",
            f"{1e3 * pair.final:.2f}",
            f"{degrees(pair.rms_turn):.2f}",
            f"{degrees(pair.final_turn):+.2f}",
            "never" if pair.parted is None else f"{pair.parted:.2f} s",
        )
    return table


def why_lines(
    recording: Recording,
    pairs: Sequence[Pair] | Sequence[Difference],
    columns: int = WIDE,
) -> Iterator[str]:
    """Yield a line or two for each robot: why it parts from the reference robot.

    Of two runs: why each parts from itself.
    """
    names = [*dict.fromkeys(name for pair in pairs for name in (pair.a, pair.b))]
    first = reference(names)
    folders, origin = shown(recording.folder), f" from {first}"
    if isinstance(recording, Together):
        couples = [*dict.fromkeys((one.a, one.b) for one in pairs)]
        folders, origin = f"{folders} {shown(recording.other.folder)}", ""
    else:
        met = {
            name for one in pairs if first in (one.a, one.b) for name in (one.a, one.b)
        }
        couples = [(first, name) for name in names if name in met - {first}]
    wide = max(len(name) for _, name in couples)
    yield f"why they part{origin}, and how much of the difference that explains"
    for a, b in couples[:SHOWN]:
        try:
            line = recording.why(a, b).line
        except ExperimentError as error:  # nothing to compare
            line = str(error)
        text = f"{b:<{wide}}  {line}"
        yield from wrap(text, columns, subsequent_indent=" " * (wide + 2))
    if len(couples) > SHOWN:
        yield f"and {len(couples) - SHOWN} more"
    which = couples[0][:1] if isinstance(recording, Together) else couples[0]
    yield f"where, and what else: rems compare {folders} {' '.join(which)}"


def differences_table(found: Sequence[Difference]) -> "Table":
    """Return a line per pair and field, in the unit of the first."""
    columns = ("rms", "final", "most")
    table = plain_table("pair", "field", *columns, right=columns)
    for one in found:
        numbers = f"{one.rms:.4g}", f"{one.final:+.4g}", f"{one.most:.4g}"
        field = heading(one.field.removeprefix("state/"), one.unit)
        table.add_row(f"{one.a} - {one.b}", field, *numbers)
    return table
