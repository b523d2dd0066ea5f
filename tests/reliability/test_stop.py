"""STOP, timed: `python -m tests.reliability stop` has the figures."""

import sys
from pathlib import Path

import pytest

from tests.reliability.rig.rig import missing
from tests.reliability.stop import GOAL, measure

pytest.importorskip("pty", reason="there are no pseudo-terminals here")
pytest.importorskip("serial", reason="pyserial is not installed")
pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"),
    reason="it reads /proc and CLOCK_BOOTTIME, which are Linux's",
)


def test_four_robots_stand(tmp_path: Path) -> None:
    found = measure(2, tmp_path, place="same", robots=4)
    assert len(found.seconds) == 2
    # A busy machine is granted four times as long.
    assert max(found.seconds) <= 4 * GOAL


@pytest.mark.slow
@pytest.mark.root
@pytest.mark.skipif(bool(missing()), reason=missing())
@pytest.mark.parametrize("wifi", [False, True], ids=["no delay", "class Wi-Fi"])
def test_thirty_robots_stand(wifi: bool, tmp_path: Path) -> None:
    found = measure(20, tmp_path, wifi=wifi)
    assert found.share(0.9) <= GOAL, " | ".join(found.cells())
