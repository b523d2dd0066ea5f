"""A driven robot stands still by itself; `python -m tests.reliability` has figures."""

import os
import sys
from pathlib import Path

import pytest

from tests.reliability.rig.rig import missing
from tests.reliability.rows import ROWS, Row
from tests.reliability.standstill import measure

pytest.importorskip("pty", reason="there are no pseudo-terminals here")
pytest.importorskip("serial", reason="pyserial is not installed")
pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"),
    reason="it freezes processes and reads /proc, which is Linux's",
)
#: those that CI tries once, on one machine; where a busy machine is granted more
QUICK = {
    "alone": [
        "the clock frozen",
        "the robot's host killed",
        "the robot's host frozen",
    ],
    "same": ["the router frozen"],
}
BUSY = 0.5
TRIALS = int(os.environ.get("REMS_TRIALS", "1"))


def rows(place: str) -> list[Row]:
    return [row for row in ROWS if place in row.places]


def hold(row: Row, place: str, folder: Path, trials: int, more: float = 0.0) -> None:
    found = measure([row], [place], trials, folder)[0]
    assert len(found.seconds) == trials
    assert found.worst <= row.limit + more, " | ".join(found.cells())


@pytest.mark.parametrize(
    ("place", "title"), [(p, title) for p, titles in QUICK.items() for title in titles]
)
def test_it_stands_still(place: str, title: str, tmp_path: Path) -> None:
    row = next(row for row in ROWS if row.title == title)
    hold(row, place, tmp_path, 1, BUSY)


@pytest.mark.slow
@pytest.mark.timeout(60 * (1 + TRIALS))
@pytest.mark.parametrize("place", ["alone", "same"])
@pytest.mark.parametrize("row", ROWS, ids=[row.title for row in ROWS])
def test_on_one_machine(row: Row, place: str, tmp_path: Path) -> None:
    if place not in row.places:
        pytest.skip(f"{row.title}: there is no such thing with {place!r}")
    hold(row, place, tmp_path, TRIALS)


@pytest.mark.slow
@pytest.mark.root
@pytest.mark.skipif(bool(missing()), reason=missing())
@pytest.mark.timeout(60 * (1 + TRIALS))
@pytest.mark.parametrize("row", rows("apart"), ids=[r.title for r in rows("apart")])
def test_on_four_machines(row: Row, tmp_path: Path) -> None:
    hold(row, "apart", tmp_path, TRIALS)
