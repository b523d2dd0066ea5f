"""Two laptops, each a folder, a user, settings and notes of its own; one router."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.agents.runs import Router
from tests.cli.conftest import LAB
from tests.commands import YES, Running, begun, command, environment, inside, terminal
from tests.interrupts import interrupt

KEYS_LINE = 'options.file = "keys.csv"'
#: the input and the robot of `LAB` are on machine b, in one process
B = 'machine = "b"\nhost = "far"'
ON_B = LAB.replace(KEYS_LINE, f'options.file = "data/keys.csv"\n{B}').replace(
    'command = "input/keys"', f'command = "input/keys"\n{B}'
)
#: the same without a process on the laptop that runs it
BRIEF = ON_B.replace('name = "log"', 'host = "here"\nname = "log"').replace(
    'duration = "1 s"', 'duration = "1 s"\nrecord = false'
)


class Laptop:
    """A folder, a user, his settings and notes. `rems` runs there."""

    def __init__(self, folder: Path, user: str, router: str):
        self.folder = folder / user
        self.folder.mkdir()
        own = {"LOGNAME": user, "USER": user, "REMS_ROUTER": router}
        for name in ("XDG_RUNTIME_DIR", "XDG_CONFIG_HOME"):
            (folder / f"{user}.{name}").mkdir(mode=0o700)
            own[name] = str(folder / f"{user}.{name}")
        self._own = own.keys()
        self.environment = environment() | own
        self.running: list[Running] = []
        self._terminals = ExitStack()

    def start(self, *args: str, stdin: int = subprocess.DEVNULL) -> Running:
        return self.python(*command(*args)[1:], stdin=stdin)

    def python(self, *args: str, stdin: int = subprocess.DEVNULL) -> Running:
        words = [sys.executable, *args]
        process = begun(words, self.folder, self.environment, stdin=stdin)
        self.running.append(process)
        return process

    def bring(self, *args: str, typed: str = YES) -> Running:
        """Start `rems agent bring` in a terminal, in which somebody types this."""
        stdin = self._terminals.enter_context(terminal(typed))
        return self.start("agent", "bring", *args, stdin=stdin)

    def rems(self, *args: str) -> tuple[int, str, str]:
        """Run it in this process, to its end: exit status, output, complaints."""
        kept = self._own & self.environment.keys()
        own = {name: self.environment[name] for name in kept}
        done = inside(*args, folder=self.folder, **own)
        return done.returncode, done.stdout, done.stderr

    def write(self, **files: str) -> None:
        for name, text in files.items():
            path = self.folder / name.replace("__", "/").replace("_", ".")
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)

    def end(self) -> None:
        for process in self.running:
            if process.poll() is None:
                interrupt(process)
            process.communicate(timeout=30)
        self._terminals.close()


def ended(process: Running) -> tuple[int, str, str]:
    out, error = process.communicate(timeout=100)
    return process.returncode, out, error


def wait_for(process: Running, words: str) -> str:
    """What it says, up to these words."""
    said = ""
    assert process.stdout is not None
    while line := process.stdout.readline():
        said += line
        if words in line:
            return said
    raise AssertionError(f"it ended: {process.communicate()}")


Pair = tuple[Laptop, Laptop]


@pytest.fixture(scope="module")
def router() -> Iterator[str]:
    """Where the router of the room is."""
    with Router() as router:
        yield router.endpoint


@pytest.fixture
def pair(tmp_path: Path, router: str) -> Iterator[Pair]:
    """Anna's laptop, which runs lab.toml, and Ben's, which is machine b."""
    laptops = [Laptop(tmp_path, user, router) for user in ("anna", "ben")]
    yield laptops[0], laptops[1]
    for laptop in laptops:
        laptop.end()


def one_line(text: str) -> str:
    """Without the line breaks of a console of 80 columns."""
    return " ".join(text.split())
