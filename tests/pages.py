"""What pages show: their blocks of code, and the lines that they say to type."""

from __future__ import annotations

import csv
import re
import shlex
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.agents.runs import ticking
from tests.commands import Done, Running, command, environment, inside

#: a block of a page that is a file beside it, with the language if its name has none
SHOWN = re.compile(r"^```{literalinclude} (\S+)\n(?::language: (\w+)\n)?```$", re.M)
LANGUAGES = {".py": "python", ".urdf": "xml"}


def blocks(page: Path, language: str) -> list[str]:
    """Return the blocks of a language, with the files that the page shows in full."""

    def fence(match: re.Match[str]) -> str:
        file = page.parent / match[1]
        name = match[2] or LANGUAGES.get(file.suffix, file.suffix[1:])
        return f"```{name}\n{file.read_text(encoding='utf-8')}```"

    text = SHOWN.sub(fence, page.read_text(encoding="utf-8"))
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)


def rems(folder: Path, line: str, **more: str) -> Done:
    """Type a line of a page, to its end; it is done in this process."""
    return inside(*shlex.split(line)[1:], folder=folder, **more)


@contextmanager
def started(folder: Path, line: str, stdin: int | None = None) -> Iterator[Running]:
    """`rems ...` in the background, until it is told to end."""
    process = subprocess.Popen(
        command(*shlex.split(line)[1:]),
        cwd=folder,
        env=environment(),
        stdin=stdin,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        yield process
    finally:
        process.terminate()
        process.communicate(timeout=20)


@contextmanager
def running(folder: Path, line: str) -> Iterator[str]:
    """Run `rems ...` in the background, once it ticks; where its fabric is."""
    with started(folder, line) as process:
        assert process.stdout is not None
        first = process.stdout.readline()
        ticking()
        yield first.rpartition("fabric at ")[2].strip().rstrip(".")


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))
