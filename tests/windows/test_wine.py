"""Wine's folder: it is made once, and every session has a system of its own."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.windows.wine import ROOT, Windows

pytestmark = [pytest.mark.wine, pytest.mark.timeout(300)]


def test_the_end_of_another_system_ends_no_program(
    windows: Windows, kept: Windows
) -> None:
    with windows.start(windows.exe, "-c", "print(1, flush=True); input()") as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "1\n"
        kept.end()
        printed, _ = process.communicate("\n")
        assert (printed, process.returncode) == ("", 0)


def test_a_wine_that_is_not_yet_complete_is_named(tmp_path: Path) -> None:
    """As while apt still installs it: the command is there, and its library is not."""
    wine = tmp_path / "wine"
    wine.write_text("#!/bin/sh\necho no kernel32.dll; exit 1\n", encoding="utf-8")
    wine.chmod(0o755)
    folder = tmp_path / "folder"
    done = subprocess.run(
        [sys.executable, "-m", "tests.windows.wine", folder],
        cwd=ROOT,
        env=os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}"},
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert "no kernel32.dll" in done.stderr
    assert done.stderr.endswith("; then run this again, and it goes on.\n")
    assert done.stderr.count("\n") == 1
    assert not (folder / "complete.txt").exists()
