"""A person lets go of a robot; `python -m tests.reliability hands` has figures."""

import os
import signal
from pathlib import Path

import pytest

from tests.reliability.hands import WAYS, Way, measure

pytest.importorskip("websockets", reason="websockets is not installed")
pytestmark = pytest.mark.skipif(
    not hasattr(signal, "SIGSTOP"), reason="nothing freezes a process here"
)
TRIALS = int(os.environ.get("REMS_TRIALS", "3"))
#: s. A busy machine is granted so much more.
BUSY = 0.4


def hold(ways: list[Way], trials: int, folder: Path) -> None:
    for found in measure(ways, trials, folder):
        said = " | ".join([found.way.title, *found.cells(), *found.wrong])
        assert found.wrong == [], said
        assert max(found.seconds) <= found.way.limit + BUSY, said


def test_the_safe_command_comes_and_comes_once(tmp_path: Path) -> None:
    """Those ways that need no new page: the key, the focus, the tab, the gamepad."""
    quick = {"the key comes up", "another tab hides the page", "the browser is frozen"}
    hold([way for way in WAYS if way.title in quick], 1, tmp_path)


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_it_comes_whatever_fails(tmp_path: Path) -> None:
    hold(list(WAYS), TRIALS, tmp_path)
