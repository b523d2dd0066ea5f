"""Commands as a user types them: Python and `rems`, each in a process of its own."""

import io
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from rems_net.cli import main
from tests.agents.runs import quiet
from tests.interrupts import APART

ROOT = Path(__file__).parents[1]

#: what a user types in a terminal, at a question
YES = "y\n"
#: s that a command may take; Windows (and Wine, above all) starts processes slowly
SECONDS = 110 if sys.platform == "win32" else 60

Done = subprocess.CompletedProcess[str]
Running = subprocess.Popen[str]
#: what the fixtures `rems`, `start`, `serve`, `agents`, `gone` ... of tests/cli are
Run = Callable[..., Done]
Start = Callable[..., Running]
Serve = Callable[[], Running]
Agents = Callable[..., list[dict[str, Any]]]
Gone = Callable[[list[dict[str, Any]]], None]


#: variables without which a command has no colours and no display
GONE = ("DISPLAY", "WAYLAND_DISPLAY", "FORCE_COLOR")


def environment(**more: str) -> dict[str, str]:
    """A terminal of 80 columns, without colours or a display; and `more`.

    Into a pipe, too, Python writes every character, as a terminal of Windows shows it.
    """
    kept = {k: v for k, v in os.environ.items() if k not in GONE}
    kept |= {"PYTHONPATH": str(ROOT), "COLUMNS": "80", "PYTHONIOENCODING": "utf-8"}
    return kept | more


def command(*args: str) -> list[str]:
    """What runs `rems args...`; what it is warned of is an error."""
    return [sys.executable, "-W", "error", "-m", "rems_net", *args]


def link_of(process: Running) -> str:
    """Return the link that a command prints."""
    assert process.stdout is not None
    found = (re.search(r"http://\S+", line) for line in process.stdout)
    return next(one for one in found if one).group()


@contextmanager
def terminal(typed: str = YES) -> Iterator[int]:
    """A terminal in which this was typed; the file that a process reads it from."""
    if sys.platform == "win32":
        pytest.skip("Windows has no pseudo-terminals")
    ours, theirs = os.openpty()
    try:
        os.write(ours, typed.encode())
        yield theirs
    finally:
        os.close(ours)
        os.close(theirs)


def finished(
    words: Sequence[str | Path],
    folder: Path | None = None,
    env: dict[str, str] | None = None,
    typed: str = "",
    seconds: float = SECONDS,
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
        encoding="utf-8",
        timeout=seconds,
        check=False,
    )
    done.stderr = quiet(done.stderr)
    return done


def begun(
    words: Sequence[str | Path],
    folder: Path | None = None,
    env: dict[str, str] | None = None,
    screen: int = subprocess.PIPE,
    stdin: int | None = None,
) -> Running:
    """Start these words in a process group of their own; who does so ends them.

    screen: a terminal that they have. Without, their output goes into pipes.
    """
    if stdin is None and screen != subprocess.PIPE:
        stdin = screen
    return subprocess.Popen(
        words,
        cwd=folder,
        env=env or environment(),
        stdin=stdin,
        stdout=screen,
        stderr=screen,
        encoding="utf-8",
        **APART,
    )


def python(folder: Path, *args: str, **more: str) -> Done:
    """Run `python args...` there, to its end."""
    return finished([sys.executable, "-W", "error", *args], folder, environment(**more))


def rems(folder: Path, *args: str, **more: str) -> Done:
    """Run `rems args...` there, to its end."""
    return finished(command(*args), folder, environment(**more))


def inside(
    *args: str, typed: str = "", folder: Path | None = None, **more: str
) -> Done:
    """Run `rems args...` in this process, in a folder or the working one, to its end.

    typed: what is on its standard input.  more: variables of its environment.

    Sooner than in one of its own, by what Python and its imports take. What the command
    changes in this process is as before; what it printed is in what this returns.
    """
    out, error = io.StringIO(), io.StringIO()
    signs = [getattr(signal, name, None) for name in ("SIGTERM", "SIGHUP")]
    handlers = {sign: signal.getsignal(sign) for sign in signs if sign}
    known = {*sys.modules}
    with pytest.MonkeyPatch.context() as now:
        for name in GONE:
            now.delenv(name, raising=False)
        for name, value in ({"COLUMNS": "80"} | more).items():
            now.setenv(name, value)
        now.setattr(sys, "path", sys.path[:])
        if folder is not None:
            now.chdir(folder)
        try:
            with (
                tempfile.TemporaryFile("w+", encoding="utf-8") as keys,
                redirect_stdout(out),
                redirect_stderr(error),
            ):
                keys.write(typed)
                keys.seek(0)
                now.setattr(sys, "stdin", keys)
                status = main(args)
        except SystemExit as end:
            status = int(end.code or 0)
        finally:
            for sign, handler in handlers.items():
                signal.signal(sign, handler)
            _forget({*sys.modules} - known)
    return Done(args, status, out.getvalue(), quiet(error.getvalue()))


def _forget(modules: set[str]) -> None:
    """Forget those of these modules that lie in the working folder."""
    with suppress(FileNotFoundError):  # the folder was removed
        here = Path.cwd()
        for name in modules:
            file = getattr(sys.modules[name], "__file__", None) or ""
            if Path(file).is_relative_to(here):
                del sys.modules[name]


def reason_of(refused: Callable[[], object]) -> str:
    """Return the system's words for why it refuses this."""
    try:
        refused()
    except OSError as error:
        return str(error.strerror)
    raise AssertionError(f"{refused} is not refused")


def needs(*libraries: str) -> None:
    """Skip the test if one of the libraries is not installed."""
    for library in libraries:
        if not find_spec(library):
            pytest.skip(f"{library} is not installed")


def drivers_of(text: str) -> list[str]:
    """Return the libraries that an experiment needs for the drivers it names."""
    return [one for one in ("mujoco", "pybullet") if f'"{one}"' in text]


def fetched(folder: Path, *packages: str) -> Path:
    """Return the modules of npm's packages, fetched into a folder; or skip the test."""
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip(f"There is no npm here, which fetches {packages[0]}.")
    words = ["install", "--silent", "--no-audit", "--no-fund", "--prefix", str(folder)]
    done = subprocess.run([npm, *words, *packages], capture_output=True, check=False)
    if done.returncode:
        pytest.skip(f"npm does not fetch {packages[0]}: is its registry reached?")
    return folder / "node_modules"
