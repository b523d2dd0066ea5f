"""What the page on checking shows is what is said."""

import re
from pathlib import Path

from tests.commands import ROOT, python
from tests.pages import blocks

PAGE = ROOT / "docs" / "robots.md"


def steady(text: str) -> str:
    """The text, without the times that differ from machine to machine."""
    return re.sub(r"\d+(\.\d+)? (us|ms)( a step)?$", "a moment", text, flags=re.M)


def test_the_wrong_cart(tmp_path: Path) -> None:
    (tmp_path / "cart.py").write_text(blocks(PAGE, "python")[-1])
    done = python(tmp_path, "cart.py")
    assert (done.returncode, done.stderr) == (0, "")
    assert steady(done.stdout) == steady(blocks(PAGE, "text")[0])
