"""Commands as a user types them: Python and `rems`, each in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.agents.runs import quiet

ROOT = Path(__file__).parents[1]

#: what a user types in a terminal, at a question
YES = "y\n"

Done = subprocess.CompletedProcess[str]
Running = subprocess.Popen[str]
#: what the fixtures `rems`, `start`, `agents` and `gone` of tests/cli are
Run = Callable[..., Done]
Start = Callable[..., Running]
Agents = Callable[..., list[dict[str, Any]]]
Gone = Callable[[list[dict[str, Any]]], None]


def environment(**more: str) -> dict[str, str]:
    """A terminal of 80 columns, without colours or a display; and `more`."""
    gone = {"DISPLAY", "WAYLAND_DISPLAY", "FORCE_COLOR"}
    kept = {k: v for k, v in os.environ.items() if k not in gone}
    return kept | {"PYTHONPATH": str(ROOT), "COLUMNS": "80"} | more


def command(*args: str) -> list[str]:
    """What runs `rems args...`; what it is warned of is an error."""
    return [sys.executable, "-W", "error", "-m", "rems_net.cli", *args]


@contextmanager
def terminal(typed: str = YES) -> Iterator[int]:
    """A terminal in which this was typed; the file that a process reads it from."""
    ours, theirs = os.openpty()
    try:
        os.write(ours, typed.encode())
        yield theirs
    finally:
        os.close(ours)
        os.close(theirs)


def finished(
    words: list[str],
    folder: Path | None = None,
    env: dict[str, str] | None = None,
    typed: str = "",
    seconds: float = 60,
) -> Done:
    """Run these words in a folder, to their end.

    Without what a busy machine says by itself: held ticks, lost real time.
    """
    done = subprocess.run(
        words,
        input=typed,
        cwd=folder,
        env=env or environment(),
        capture_output=True,
        text=True,
        timeout=seconds,
        check=False,
    )
    done.stderr = quiet(done.stderr)
    return done


def python(folder: Path, *args: str, **more: str) -> Done:
    """Run `python args...` there, to its end."""
    return finished([sys.executable, "-W", "error", *args], folder, environment(**more))


def rems(folder: Path, *args: str, **more: str) -> Done:
    """Run `rems args...` there, to its end."""
    return finished(command(*args), folder, environment(**more))
