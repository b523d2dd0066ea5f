"""What the page on checking shows is what is said."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from tests.test_docs import ROOT, blocks, environment

PAGE = ROOT / "docs" / "robots_check.md"


def steady(text: str) -> str:
    """The text, without the times that differ from machine to machine."""
    return re.sub(r"\d+(\.\d+)? (us|ms)( a step)?$", "a moment", text, flags=re.M)


def test_the_wrong_cart(tmp_path: Path) -> None:
    (tmp_path / "cart.py").write_text(blocks(PAGE, "python")[0])
    done = subprocess.run(
        [sys.executable, "-W", "error", "cart.py"],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert steady(done.stdout) == steady(blocks(PAGE, "text")[0])
