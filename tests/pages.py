"""What pages show: their blocks of code, and the lines that they say to type."""

import csv
import re
import shlex
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.agents.runs import ticking
from tests.commands import Done, Running, command, environment, inside
from tests.interrupts import APART

#: a file beside a page; the site shows it below the paragraph that links it
SHOWN = re.compile(r"\]\(((?:programs|rover)/[\w./]+)\)")
LANGUAGES = {".py": "python", ".urdf": "xml"}
#: programs that need a file, a device or an experiment beside them
NEEDING = ("arm.py", "plain_agent.py", "read_mcap.py", "serial_cart.py")


def blocks(page: Path, language: str) -> list[str]:
    """Return the blocks of a language, with the files that the page shows in full."""
    text = "\n".join(_complete(page))
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)


def _complete(page: Path) -> Iterator[str]:
    """Yield the lines of a page, with each file after the paragraph that links it."""
    fenced, linked = False, list[str]()
    for line in [*page.read_text(encoding="utf-8").splitlines(), ""]:
        begins = line.startswith("```") and not fenced
        while linked and (begins or not line):
            file = page.parent / linked.pop(0)
            name = LANGUAGES.get(file.suffix, file.suffix[1:])
            yield f"```{'py' if file.name in NEEDING else name}"
            yield f"{file.read_text(encoding='utf-8')}```"
        fenced ^= line.startswith("```")
        linked += [] if fenced else SHOWN.findall(line)
        yield line


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
        encoding="utf-8",
        **APART,
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
