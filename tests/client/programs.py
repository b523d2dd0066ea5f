"""Programs of somebody else, started by tests and ended with them."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

HERE = Path(__file__).parent

Start = Callable[..., subprocess.Popen[str]]


@contextmanager
def programs() -> Iterator[Start]:
    """`start(file, *arguments)` returns when the program says that it is there."""
    running: list[subprocess.Popen[str]] = []

    def start(file: str, *arguments: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, str(HERE / file), *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        running.append(process)
        assert process.stdout is not None
        assert process.stdout.readline() == "here\n"
        return process

    try:
        yield start
    finally:
        for process in running:
            process.communicate("")
