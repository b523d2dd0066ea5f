"""Each robot, when somebody goes silent; `python -m tests.reliability` has figures."""

import os
import re
import sys
from pathlib import Path
from typing import Any

import pytest

from rems_net.agents import parts
from rems_net.agents.registry import BUILT_IN
from rems_net.agents.robot import combine
from rems_net.drivers import Driven
from rems_net.robots.create2 import Create2
from rems_net.robots.dynabot import Dynabot
from rems_net.robots.scaler import Scaler
from rems_net.robots.woodbot import Woodbot
from tests.commands import ROOT
from tests.reliability.crossings import DRIVERS, ELSEWHERE, ROBOTS, SILENT, has, once

pytest.importorskip("pty", reason="there are no pseudo-terminals here")
pytest.importorskip("serial", reason="pyserial is not installed")
pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"),
    reason="it freezes processes and reads /proc, which is Linux's",
)
#: those that CI tries once
QUICK = [
    ("its cable", "create2"),
    ("its frozen holder", "woodbot-ws"),
    ("the clock", "kinematic"),
    ("a closed lid", "dynabot"),
]
CELLS = [(s, r) for s in SILENT for r in ROBOTS if has(s, r) and (s, r) not in QUICK]
TRIALS = int(os.environ.get("REMS_TRIALS", "1"))
#: inputs that no person moves
NO_HANDS = {"csv", "replay", "hand"}


def test_every_driver_and_every_hand_has_a_place() -> None:
    """A new one needs a row, a column, or five words why it has none."""
    assert set(BUILT_IN["driver"]) == set(DRIVERS)
    assert set(BUILT_IN["input"]) - NO_HANDS <= {*SILENT, *ELSEWHERE}
    words = [d[4:] for d in DRIVERS.values() if d.startswith("no: ")]
    words += [*ELSEWHERE.values(), *(w for s in SILENT.values() for w in s.without)]
    assert [text for text in words if len(text.split()) > 5] == []


def test_the_page_says_which_devices_stop_by_themselves() -> None:
    page = (ROOT / "docs" / "safety.md").read_text(encoding="utf-8")
    row = re.compile(r"^\| `([\w-]+)` \| [^|]+ \| ([^|]+) \|", re.MULTILINE)
    said = dict(row.findall(page))
    robots = {"create2": Create2, "dynabot": Dynabot, "scaler": Scaler}
    found = {}
    for name, known in parts.by_name("driver").items():
        driver = known[0].load()
        if issubclass(driver, Driven):
            robot: Any = combine(robots.get(name, Woodbot), driver)("b")
            alone = robot.stops_alone
            found[name] = "no" if alone is None else f"{alone:g} s"
    assert said == found


def hold(silent: str, robot: str, folder: Path) -> None:
    answer = once(silent, robot, folder)
    assert answer.wrong == [], answer.told


@pytest.mark.parametrize(("silent", "robot"), QUICK)
def test_a_cell(silent: str, robot: str, tmp_path: Path) -> None:
    hold(silent, robot, tmp_path)


@pytest.mark.slow
@pytest.mark.timeout(60 * (1 + TRIALS))
@pytest.mark.parametrize(("silent", "robot"), CELLS)
def test_the_other_cells(silent: str, robot: str, tmp_path: Path) -> None:
    for n in range(TRIALS):
        hold(silent, robot, tmp_path / str(n))
