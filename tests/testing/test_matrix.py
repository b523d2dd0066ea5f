"""Every cell of the table: found among the parts, and it does what a robot must."""

from __future__ import annotations

import pytest

from rems_net.errors import ExperimentError
from rems_net.testing import examine
from rems_net.testing.cells import Cell, cells
from rems_net.testing.matrix import measured

CELLS = [cell for cell in cells() if cell.subject is not None]
#: an engine takes a second and more for each robot
QUICK = [cell for cell in CELLS if cell.driver == "kinematic"]


@pytest.mark.parametrize("cell", QUICK, ids=lambda cell: cell.name)
def test_every_cell_passes(cell: Cell) -> None:
    with cell.running() as subject:
        found = list(examine(subject, moves=True, alone=True))
    assert [one for one in found if one.findings] == []


@pytest.mark.slow
@pytest.mark.parametrize("cell", CELLS, ids=lambda cell: cell.name)
def test_every_cell_passes_in_processes(cell: Cell) -> None:
    with cell.running() as subject:
        found = list(examine(subject, moves=True))
    assert [one for one in found if one.findings] == []


def test_measured() -> None:
    (cell,) = cells(["woodbot", "kinematic"])
    found = measured(cell)
    assert found.ok
    assert found.steps > 100
    assert found.agreement is not None
    assert 0 < found.agreement.error < 0.01


def test_a_part_that_nobody_has() -> None:
    with pytest.raises(ExperimentError, match="Did you mean 'woodbot'"):
        list(cells(["wodbot"]))
