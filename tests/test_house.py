"""The architecture, as a test: what may import what, and what nothing may do."""

from __future__ import annotations

import ast
import importlib
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "rems_net"
FILES = sorted(PACKAGE.rglob("*.py"))

#: room -> rooms of rems_net it may import from
ROOMS = {
    "errors": set[str](),
    "packing": set[str](),
    "units": {"errors"},
    "defdict": {"errors", "packing", "units"},
    "router": {"errors", "packing", "units", "defdict"},
    "agents": {"errors", "units", "defdict", "router"},
    "robots": {"errors", "units", "defdict", "router", "agents"},
    "drivers": {"errors", "units", "defdict", "router", "agents"},
    "demo": {"errors", "units", "defdict", "router", "agents"},
    "cli": {"errors", "units", "defdict", "router", "agents", "robots", "drivers"},
}
#: modules that exist on one kind of system only
UNIX_ONLY = {"fcntl", "grp", "pty", "pwd", "resource", "termios", "tty", "posix"}
#: what may read the wall clock or sleep: the clock, those who watch over processes,
#: and the picture of progress; agents, robots and drivers receive time
KEEPERS_OF_TIME = {"agents/clock.py", "agents/sight.py", "agents/turns.py"}
#: optional library -> the one file that may import it
OPTIONAL = {
    "mujoco": "drivers/mujoco.py",
    "pybullet": "drivers/pybullet.py",
    "matplotlib": "agents/picture.py",
}


def room(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports(path: Path) -> Iterator[tuple[str, int]]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, f"{path}:{node.lineno}: a relative import"
            yield node.module, node.lineno
            yield from ((f"{node.module}.{a.name}", node.lineno) for a in node.names)


def calls(path: Path) -> Iterator[tuple[str, int]]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call):
            yield ast.unparse(node.func), node.lineno


ids = [str(f.relative_to(PACKAGE)) for f in FILES]


@pytest.mark.parametrize("path", FILES, ids=ids)
def test_imports_run_one_way(path: Path) -> None:
    here = room(path)
    if here == "__init__":
        return
    for name, line in imports(path):
        parts = name.split(".")
        if parts[0] == "rems_net" and len(parts) > 1 and parts[1] in ROOMS:
            if parts[1] == here:
                continue
            assert parts[1] in ROOMS[here], (
                f"{path.name}:{line}: {here} imports {parts[1]}"
            )


@pytest.mark.parametrize("path", FILES, ids=ids)
def test_one_room_speaks_zenoh(path: Path) -> None:
    if room(path) != "router":
        assert not [n for n, _ in imports(path) if n.split(".")[0] == "zenoh"]


@pytest.mark.parametrize("path", FILES, ids=ids)
def test_optional_libraries_live_in_one_file_each(path: Path) -> None:
    for name, line in imports(path):
        home = OPTIONAL.get(name.split(".")[0])
        assert home is None or path == PACKAGE / home, f"{path.name}:{line}: {name}"


@pytest.mark.parametrize("path", FILES, ids=ids)
def test_portable_and_safe(path: Path) -> None:
    names = {n.split(".")[0] for n, _ in imports(path)}
    assert not names & UNIX_ONLY
    assert not names & {"pickle", "marshal", "shelve", "dill", "cloudpickle"}
    called = {name for name, _ in calls(path)}
    assert not called & {"os.fork", "os.killpg", "eval", "os.setsid"}
    source = path.read_text(encoding="utf-8")
    for signal in ("SIGKILL", "SIGUSR1", "SIGALRM", "SIGHUP"):
        assert f"signal.{signal}" not in source


@pytest.mark.parametrize("path", FILES, ids=ids)
def test_time_is_received(path: Path) -> None:
    if room(path) not in {"agents", "robots", "drivers", "defdict"}:
        return
    if path.relative_to(PACKAGE).as_posix() in KEEPERS_OF_TIME:
        return
    for name, line in calls(path):
        clock = name.startswith("time.") and name != "time.strftime"
        assert not clock, f"{path.name}:{line}: {name} where time is received"
        assert "datetime.now" not in name


@pytest.mark.parametrize("path", FILES, ids=ids)
def test_no_swallowed_errors(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ExceptHandler):
            assert node.type is not None, f"{path.name}:{node.lineno}: bare except"


def test_the_public_names_are_all() -> None:
    import rems_net

    assert rems_net.__all__ == sorted(rems_net.__all__)
    for name in rems_net.__all__:
        assert getattr(rems_net, name) is not None
    assert set(rems_net.__all__) == set(rems_net._HOMES)


def test_import_is_light() -> None:
    """unyt costs 0.8 s and 75 MB: it comes in with the first quantity, not before."""
    code = (
        "import sys, rems_net; rems_net.Experiment; rems_net.Schema; "
        "heavy = {'unyt', 'sympy', 'mujoco', 'matplotlib'} & sys.modules.keys(); "
        "sys.exit(f'imported {heavy}' if heavy else 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "module", ["rems_net.agents.experiment", "rems_net.router.session"]
)
def test_rooms_import_alone(module: str) -> None:
    assert importlib.import_module(module)
