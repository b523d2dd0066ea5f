"""Every cell of the table: found among the parts, and it does what a robot must."""

import re

import pytest

from rems_net.agents.registry import BUILT_IN
from rems_net.cli.check.robots import share
from rems_net.emulators.known import KNOWN
from rems_net.errors import ExperimentError
from rems_net.libraries import look_for
from rems_net.testing import Subject, examine
from rems_net.testing.agreement import measure
from rems_net.testing.cells import Cell, cells, is_emulated
from rems_net.testing.matrix import measured
from tests.commands import ROOT
from tests.testing.robots import Breaks, Cart, Good

#: robots that move
ROBOTS = [name for name in BUILT_IN["definition"] if name != "camera"]
DRIVERS = [name for name in BUILT_IN["driver"] if name != "remote"]
#: what is driven is called as the robot is
CELLS = [
    (robot, driver)
    for robot in ROBOTS
    for driver in DRIVERS
    if driver not in KNOWN or is_emulated(robot, driver)
]


def cell_of(definition: str, driver: str) -> Cell:
    return next(c for c in cells([definition]) if c.driver == driver)


#: robot -> the shares in its row of the page's table, as they are printed
PAGE = {
    line.split()[0]: re.findall(r"[~<]?[\d.]+%", line)
    for line in (ROOT / "docs/measured/accuracy.md").read_text("utf-8").splitlines()
    if re.match(r"\w+ +<?[\d.]+% ", line)
}
#: columns of that table, the last for robots with an emulator only
COLUMNS = ("kinematic", "mujoco", "pybullet", "hardware")


@pytest.mark.parametrize("robot", ROBOTS)
def test_every_robot_by_its_mathematics(robot: str) -> None:
    (cell,) = cells([robot, "kinematic"])
    assert cell.subject is not None
    found = list(examine(cell.subject, alone=True))
    assert [one for one in found if one.findings] == []
    (remark,) = (one.remark for one in found if one.name == "agrees")
    (percent,) = re.findall(r"within ([\d.]+)%", remark)
    page = float(PAGE[robot][0].strip("<%"))
    assert float(percent) == pytest.approx(page, abs=0.0101)


def page_has(robot: str, driver: str) -> None:
    cell = cell_of(robot, driver)
    if cell.subject is None:
        pytest.skip(cell.why)
    found, _ = measure(cell.subject)
    assert found is not None
    assert share(found.error, rough=False) == PAGE[robot][COLUMNS.index(driver)]


@pytest.mark.parametrize("driver", ["mujoco", "pybullet"])
def test_the_page_has_what_rems_matrix_prints(driver: str) -> None:
    page_has("dynabot", driver)


@pytest.mark.slow
@pytest.mark.parametrize("driver", ["mujoco", "pybullet"])
@pytest.mark.parametrize("robot", ROBOTS)
def test_the_page_has_all_that_rems_matrix_prints(robot: str, driver: str) -> None:
    page_has(robot, driver)


def test_what_differs_from_run_to_run_is_marked() -> None:
    """In the page and in what the command prints: hardware, and nothing else."""
    assert PAGE.keys() == set(ROBOTS)
    rough = {robot: [one[0] == "~" for one in row] for robot, row in PAGE.items()}
    assert rough == {
        robot: [False] * 3 + [True] * any(is_emulated(robot, name) for name in KNOWN)
        for robot in ROBOTS
    }
    assert share(0.0362, rough=True) == "~4%"
    assert share(0.0362, rough=False) == "3.6%"


@pytest.mark.slow
@pytest.mark.parametrize(("robot", "driver"), CELLS)
def test_every_cell(robot: str, driver: str) -> None:
    """With all there is to check, processes too."""
    cell = cell_of(robot, driver)
    if cell.subject is None:
        pytest.skip(cell.why)
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


class Needy(Good):
    """A driver whose library nobody has."""

    def prepare(self) -> None:
        look_for("no_such_library", "hardware")
        super().prepare()


def test_what_another_machine_could_do() -> None:
    """It is left out with its reason, and nothing is wrong."""
    found = measured(Cell("cart", "needy", Subject(Cart, Needy)))
    assert found.ok
    assert found.cell.missing
    assert "no_such_library" in found.cell.why
    assert not found.to_plain()["runs"]


def test_a_cell_that_fails() -> None:
    """The others are measured; this one says why, and where."""
    found = measured(Cell("cart", "breaks", Subject(Cart, Breaks)))
    assert not found.ok
    assert "ZeroDivisionError" in found.problem
    assert "robots.py, line" in found.problem


def test_a_name_of_both_is_the_definition() -> None:
    found = {cell.driver for cell in cells(["create2"])}
    assert found == {*DRIVERS}
    assert [c.driven for c in cells(["create2"]) if c.driver == "create2"] == [True]


def test_a_part_that_nobody_has() -> None:
    with pytest.raises(ExperimentError, match="Did you mean 'woodbot'"):
        list(cells(["wodbot"]))
