"""Every code block of docs/defdict.md runs, and prints what the page says."""

import contextlib
import io
import re
from pathlib import Path
from typing import Any

PAGE = Path(__file__).parent.parent.parent / "docs" / "defdict.md"
BLOCK = re.compile(r"```python\n(.*?)```\n(?:```text\n(.*?)```)?", re.DOTALL)


def test_every_block_runs() -> None:
    names: dict[str, Any] = {"__name__": "docs"}
    page = PAGE.read_text(encoding="utf-8")
    blocks = list(BLOCK.finditer(page))
    assert len(blocks) == page.count("```python") > 10
    for block in blocks:
        line = page.count("\n", 0, block.start()) + 2
        code = "\n" * (line - 1) + block[1]
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, str(PAGE), "exec"), names)
        assert printed.getvalue() == (block[2] or ""), f"line {line}"
