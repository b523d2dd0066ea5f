"""The project's own tests, by Windows' Python: a part of them, or all."""

import re
from pathlib import Path

import pytest

from tests.windows.wine import ROOT, Windows

pytestmark = pytest.mark.wine

#: what differs between systems: files, processes, time, commands, ends of programs
PART = (
    "tests/system",
    "tests/outputs/test_csv.py",
    "tests/agents/test_random.py",
    "tests/cli/test_bad_input.py",
    "tests/client/test_live.py",
    "tests/recordings/test_killed.py",
)
#: s for a part, and for all
MINUTES, HOUR = 600, 3600


@pytest.mark.timeout(MINUTES)
def test_a_part(windows: Windows, tmp_path: Path) -> None:
    passed(windows, tmp_path, MINUTES, *PART)


@pytest.mark.slow
@pytest.mark.timeout(HOUR)
def test_all(windows: Windows, tmp_path: Path) -> None:
    passed(windows, tmp_path, HOUR, "tests")


def passed(windows: Windows, cache: Path, seconds: float, *tests: str) -> None:
    """Run these tests; those that failed beside others are run once more, alone."""
    pytest = ["-m", "pytest", "-q", "--timeout", "400", "-o", f"cache_dir={cache}"]
    words: list[str | Path] = [windows.exe, *pytest, "-n", "3", *tests]
    again = ["--last-failed", "--last-failed-no-failures", "none"]
    process = windows.start(*words, cwd=ROOT, CI="true")
    printed, _ = process.communicate(timeout=seconds)
    failed = len(re.findall(r"^(?:FAILED|ERROR) ", printed, re.MULTILINE))
    assert process.returncode == 0 or 0 < failed <= 8, printed[-6000:]
    if process.returncode:
        windows.python(*pytest, *again, *tests, cwd=ROOT, seconds=seconds)
