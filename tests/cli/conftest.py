"""The `rems` command in a folder of its own: in this process, or in one of its own.

Each verb has at least one test in which it is a process, as a user has it. What a
command says and leaves is looked at in this process, which is ten times as fast.
"""

import re
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from rems_net.agents.experiment.hosting.process import HostProcess
from rems_net.client import Fabric, join
from rems_net.client.proxy import Proxy
from rems_net.errors import FabricError
from rems_net.router import find
from tests import commands
from tests.agents.runs import alive, free_port, ticking, until
from tests.cli.recorded import AGENTS, scripted
from tests.commands import (
    Agents,
    Gone,
    Run,
    Running,
    Serve,
    Start,
    begun,
    command,
)
from tests.interrupts import interrupt

LAB = """\
[experiment]
name = "lab"
dt = "0.1 s"
duration = "1 s"

[[input]]
name = "keys"
type = "csv"
options.file = "keys.csv"

[[robot]]
name = "model"
definition = "woodbot"
driver = "kinematic"
command = "input/keys"
parameters = { track = "0.1 m" }

[[output]]
name = "log"
type = "csv"
"""
#: a robot that nobody in the experiment commands
FREE = """
[experiment]
name = "free"
dt = "20 ms"
duration = "600 s"
pace = 1.0

[[robot]]
name = "bot"
definition = "woodbot"
driver = "kinematic"
host = "here"
"""
KEYS = """\
time [s],command/wheel/left [rad/s],command/wheel/right [rad/s]
0.5,1.0,2.0
1.0,3.0,4.0
"""


def together(lab: str, host: str = "one") -> str:
    """Return the experiment with all its agents in one host, which starts sooner."""
    there = rf'\g<0>\nhost = "{host}"'
    return re.sub(r"^\[\[\w+\]\]$", there, lab, flags=re.MULTILINE)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the user is: a good `lab.toml` and its `keys.csv`."""
    here = tmp_path / "here"
    here.mkdir()
    (here / "lab.toml").write_text(LAB)
    (here / "keys.csv").write_text(KEYS)
    monkeypatch.chdir(here)
    return here


@pytest.fixture
def nothing_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    """What would start a process or a session fails the test."""

    def refuse(*_: object) -> None:
        raise AssertionError("something was started")

    monkeypatch.setattr(HostProcess, "start", refuse)
    monkeypatch.setattr(find, "serve", refuse)


@pytest.fixture
def rems(folder: Path) -> Run:
    """Run `rems ...` to its end, in this process."""
    return commands.inside


@pytest.fixture
def program(folder: Path) -> Run:
    """Run `rems ...` to its end, in a process of its own."""
    return partial(commands.rems, folder)


@pytest.fixture
def start(folder: Path) -> Iterator[Start]:
    """Start `rems ...`, in a process group of its own; ended with the test."""
    with starting(folder) as begin:
        yield begin


@contextmanager
def starting(folder: Path) -> Iterator[Start]:
    """Start `rems ...` here, each in a process group of its own; then end them."""
    running: list[Running] = []

    def begin(*args: str, typed: bool = False) -> Running:
        stdin = subprocess.PIPE if typed else None
        process = begun(command(*args), folder, stdin=stdin)
        running.append(process)
        return process

    yield begin
    for process in running:
        if process.poll() is None:
            interrupt(process)
        try:
            process.communicate(timeout=20)
        except subprocess.TimeoutExpired:
            process.kill()  # or what it leaves open fails another test
            process.communicate()
            raise


@contextmanager
def place(folder: Path) -> Iterator[Path]:
    """Routers leave their notes in `folder`, for all tests of a module."""
    with pytest.MonkeyPatch.context() as here:
        for name in ("XDG_RUNTIME_DIR", "XDG_CONFIG_HOME", "APPDATA"):
            here.setenv(name, str(folder / name))
        (folder / "XDG_RUNTIME_DIR").mkdir(mode=0o700)
        here.delenv("REMS_ROUTER", raising=False)
        yield folder / "XDG_RUNTIME_DIR"


@pytest.fixture
def agents() -> Agents:
    """Wait until the fabric has made this many ticks; then who is on it."""
    return ticking


@pytest.fixture
def gone() -> Gone:
    """Wait until no process of these agents is left, three seconds at most."""

    def wait(agents: list[dict[str, Any]]) -> None:
        pids = [int(agent["host"].rpartition(":")[2]) for agent in agents]
        until(lambda: not any(map(alive, pids)), 3.0)

    return wait


def text(process: Running, end: Callable[[Running], None] = interrupt) -> str:
    """End it; all that it said."""
    end(process)
    out, error = process.communicate(timeout=20)
    return out + error


def fabric() -> Fabric:
    def attempt() -> Fabric | None:
        try:
            return join()
        except FabricError:
            return None

    found: Fabric = until(attempt)
    return found


def row(here: Fabric, agent: str) -> dict[str, Any] | None:
    try:
        return next((r for r in here.agents() if r["agent"] == agent), None)
    except FabricError:  # no clock yet
        return None


def ticks(here: Fabric, agent: str, more: int = 5) -> dict[str, Any]:
    """Wait until this agent has made some more ticks."""
    first = until(lambda: row(here, agent))

    def later() -> dict[str, Any] | None:
        now = row(here, agent)
        return now if now and now["tick"] >= first["tick"] + more else None

    found: dict[str, Any] = until(later)
    return found


def robot(start: Start, name: str, *more: str) -> Running:
    return start(
        "agent", "start", "robot", "woodbot", "kinematic", "--name", name, *more
    )


@pytest.fixture
def serve(start: Start) -> Serve:
    """Start `rems router serve`, at the same place again and again."""
    where = f"tcp/127.0.0.1:{free_port()}"
    return lambda: start("router", "serve", "--listen", where)


@pytest.fixture
def alice(start: Start, serve: Serve) -> Running:
    """The program of robot/alice, a Woodbot on an open fabric."""
    serve()
    with fabric():
        return robot(start, "alice")


@pytest.fixture
def here(alice: Running) -> Iterator[Fabric]:
    """The fabric with robot/alice."""
    with fabric() as found:
        until(lambda: row(found, "robot/alice"))
        yield found
        if alice.poll() is None:
            text(alice)


@contextmanager
def served(folder: Path, *names: str) -> Iterator[Path]:
    """Serve an open fabric with these robots; yield the runtime folder."""
    with starting(folder) as start:
        with place(folder) as notes:
            start("router", "serve", "--listen", f"tcp/127.0.0.1:{free_port()}")
            with fabric() as found:
                for name in names:
                    robot(start, name)
                    until(partial(row, found, f"robot/{name}"))
        yield notes


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The runtime folder of an open fabric with robot/alice, for tests of a module."""
    with served(tmp_path_factory.mktemp("driven"), "alice") as notes:
        yield notes


@pytest.fixture
def still(
    driven: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Fabric]:
    """That fabric, with nobody else; alice stands, and nobody drives it."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(driven))
    monkeypatch.chdir(tmp_path)
    with join() as found:
        until(lambda: [one["agent"] for one in found.agents()] == ["robot/alice"])
        until(lambda: not found.drivers() and stands(found.robot("alice")))
        yield found


def stands(proxy: Proxy) -> bool:
    """Return whether it stands: three states, one like the other."""
    first, *others = list(proxy.watch("state", 3))
    return all(one == first for one in others)


@pytest.fixture
def three(tmp_path: Path) -> Path:
    """A folder with a recording of three agents in `run`."""
    (tmp_path / "again_lab.py").write_text(AGENTS, encoding="utf-8")
    with pytest.MonkeyPatch.context() as now:
        now.chdir(tmp_path)
        scripted(Path("again_lab.py"), tmp_path / "run")
    return tmp_path
