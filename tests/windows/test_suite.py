"""The project's own tests, by Windows' Python: a part of them, or all."""

import re

import pytest

from tests.windows.wine import ROOT, Windows

pytestmark = pytest.mark.wine

#: what differs between systems: files, processes, time, commands, ends of programs
PART = (
    "tests/defdict",
    "tests/engine",
    "tests/outputs",
    "tests/system",
    "tests/agents/test_determinism.py",
    "tests/agents/test_processes.py",
    "tests/cli/test_bad_input.py",
    "tests/cli/test_demo.py",
    "tests/client/test_live.py",
    "tests/recordings/test_killed.py",
)
#: s for a part, and for all
MINUTES, HOUR = 600, 3600


@pytest.mark.timeout(MINUTES)
def test_a_part(windows: Windows) -> None:
    passed(windows, MINUTES, *PART)


@pytest.mark.slow
@pytest.mark.timeout(HOUR)
def test_all(windows: Windows) -> None:
    passed(windows, HOUR, "tests")


def passed(windows: Windows, seconds: float, *tests: str) -> None:
    """Run these tests; those that failed beside others are run once more, alone."""
    options = ["-m", "pytest", "-q", "-n", "3", "-p", "no:warnings"]
    again = [*options[:2], "-q", "--last-failed", "--last-failed-no-failures", "none"]
    process = windows.start(windows.exe, *options, *tests, cwd=ROOT, CI="true")
    printed, _ = process.communicate(timeout=seconds)
    failed = len(re.findall(r"^(?:FAILED|ERROR) ", printed, re.MULTILINE))
    assert process.returncode == 0 or 0 < failed <= 8, printed[-6000:]
    if process.returncode:
        windows.python(*again, *tests, cwd=ROOT, seconds=seconds)
