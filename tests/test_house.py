"""The architecture, as a test: what may import what, and what nothing may do."""

from __future__ import annotations

import ast
import importlib
import pkgutil
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from rems_net.errors import UnitError
from tests.sources import ROOT, below, trees, uncollected

PACKAGE = ROOT / "rems_net"
FILES = sorted(PACKAGE.rglob("*.py"))

#: room or wing -> the rooms and wings of rems_net it may import from; a file that is
#: in no wing of its room belongs to the room itself
#: the packages that a user imports from
DOORS = (
    "rems_net",
    "rems_net.units",
    "rems_net.bodies",
    "rems_net.drivers",
    "rems_net.gym",
)
LAYERS = ("units", "fields", "trees", "wire", "values", "conversion")
BASE = {"errors", "maths", "packing", "uncaught", "units", "defdict", "kinematics"}
BASE |= {
    "doors",
    "libraries",
    "arguments",
    "events",
    "pictures",
    "system",
    "toml",
}
WORDS = BASE | {"router", "bodies", "eyes", "scenes", "recordings", "teleop", "agents"}
SHIPPED = WORDS - {"recordings"}
ROOMS: dict[str, set[str]] = {
    "errors": set(),
    "arguments": {"errors"},
    "events": set(),
    "packing": set(),
    "system": set(),
    "pictures": {"defdict"},
    "toml": set(),
    "doors": {"errors"},
    "explain": {"errors"},
    "libraries": {"errors", "uncaught"},
    "uncaught": {"doors", "errors"},
    "units": {"errors"},
    "maths": set(),
    "kinematics": {"errors", "maths"},
    **{
        f"defdict/{layer}": {"arguments", "errors", "packing", "units"}
        | {f"defdict/{below}" for below in LAYERS[:i]}
        for i, layer in enumerate(LAYERS)
    },
    "defdict": BASE | {f"defdict/{layer}" for layer in LAYERS},
    "router": BASE,
    # What robots are made of, and the files that describe them; then places.
    "bodies": BASE,
    "scenes": BASE | {"bodies"},
    # Markers in pictures, and where they lie.
    "eyes": BASE | {"bodies"},
    "recordings": BASE,
    # What a person's hand does, and how it becomes a command.
    "teleop": BASE,
    "agents": BASE | {"router", "bodies", "scenes", "teleop"},
    # A tick as a plain function: no transport, no process, no wall clock.
    "engine": BASE | {"agents", "bodies", "scenes"},
    "agents/protocol": BASE | {"router", "agents", "engine"},
    "agents/clock": BASE | {"router", "agents", "agents/protocol", "engine"},
    "agents/host": BASE | {"router", "agents", "agents/protocol", "engine"},
    # A host, too: the one that is a thread of the run itself.
    "agents/experiment": WORDS
    | {"agents/protocol", "agents/clock", "agents/host", "engine"},
    "robots": SHIPPED,
    "drivers": SHIPPED,
    "drivers/kinematic": SHIPPED | {"drivers"},
    "drivers/physics": SHIPPED | {"drivers"},
    "drivers/hardware": SHIPPED | {"drivers"},
    "drivers/webots": SHIPPED | {"drivers"},
    "drivers/remote": SHIPPED | {"drivers", "drivers/hardware"},
    "emulators": SHIPPED
    | {"robots", "drivers", "drivers/kinematic", "drivers/hardware"},
    "inputs": WORDS,
    "outputs": WORDS,
    "processes": WORDS | {"drivers", "drivers/kinematic", "identification"},
    "client": BASE | {"router", "agents", "agents/protocol", "engine", "teleop"},
    "identification": WORDS | {"drivers", "drivers/kinematic"},
    # Many runs of one experiment, by engines in other processes.
    "sweeps": WORDS | {"agents/protocol", "agents/experiment", "engine"},
    # Optional; their libraries are in extras of their own.
    "gym": WORDS
    | {"agents/experiment", "agents/protocol", "engine"}
    | {"drivers", "drivers/kinematic", "drivers/physics", "defdict/units"},
    "dashboard": BASE
    | {"router", "bodies", "scenes", "recordings", "agents", "agents/protocol"}
    | {"engine", "client", "teleop", "defdict/wire"},
    "firmware": SHIPPED
    | {"agents/protocol", "agents/host", "agents/experiment", "defdict/wire"}
    | {"engine"}
    | {"drivers/hardware"},
    "cable": BASE | {"router", "drivers", "drivers/hardware"},
    "testing": WORDS
    | {"agents/protocol", "agents/experiment", "drivers/hardware", "emulators"},
    # Recordings in 3-D: the scenes of the page, drawn as the pictures of cameras.
    "films": WORDS | {"dashboard", "drivers", "drivers/physics"},
    "cli": WORDS
    | {"agents/protocol", "agents/clock", "agents/experiment"}
    | {
        "client",
        "dashboard",
        "films",
        "identification",
        "firmware",
        "cable",
        "emulators",
        "drivers/hardware",
        "testing",
        "sweeps",
    }
    | {"drivers", "explain"},
    "demo": set(),
}
#: modules that exist on one kind of system only
UNIX_ONLY = {"fcntl", "grp", "pty", "pwd", "resource", "termios", "tty", "posix"}
#: what imports such a module only where it is, and says so where it is not
GUARDED = {
    "emulators/terminal.py",
    "router/relay/descriptors.py",
    "teleop/posix.py",
}
#: where time is received, and nothing asks for it
TIMELESS = {
    "agents",
    "engine",
    "robots",
    "drivers",
    "defdict",
    "inputs",
    "outputs",
    "processes",
    "bodies",
    "scenes",
}
#: what may read the wall clock or sleep: the clock, those who watch over processes,
#: and the picture of progress; agents, robots and drivers receive time
KEEPERS_OF_TIME = {
    "agents/clock",
    "agents/experiment/display.py",
    "agents/wall.py",
    "drivers/hardware/periodic.py",  # the device thread's deadlines
}
#: who may ask for how long something has lasted: those who watch over members, and
#: device threads, which live in wall time: a robot that is driven goes on moving when
#: fabric time stands still
WATCHERS = {"agents/clock", "agents/host", "drivers/hardware"}
#: optional library -> the one file that may import it, or one for each purpose
OPTIONAL: dict[str, str | tuple[str, ...]] = {
    "gymnasium": "gym/library.py",
    "mujoco": "drivers/physics/mujoco.py",
    "pybullet": "drivers/physics/pybullet.py",
    "matplotlib": ("recordings/picture.py", "outputs/window.py"),
    "PIL": "recordings/animation/film.py",
    "pandas": "recordings/export/frames.py",
    "polars": "recordings/export/frames.py",
    "pyarrow": "recordings/export/frames.py",
    "esptool": "cable/flash.py",
    "serial": "drivers/hardware/holder.py",
    "websockets": ("drivers/hardware/websocket.py", "dashboard/server.py"),
    "dynamixel_sdk": "drivers/hardware/dynamixel/bus.py",
    "apriltag": "eyes/apriltags.py",
    "cv2": "eyes/opencv.py",
    "distributed": "sweeps/on_dask.py",
    "ray": "sweeps/on_ray.py",
}


def room(path: Path) -> str:
    """The wing or room a file is in: `agents/clock`, `agents`, `errors`."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    wing = "/".join(parts[:2])
    return wing if wing in ROOMS else parts[0]


@cache
def tree_of() -> dict[Path, ast.Module]:
    return trees()


@pytest.fixture(autouse=True, scope="module")
def _forgotten() -> Iterator[None]:
    """Keep no trees for the tests of other modules."""
    with uncollected():
        yield
    for cached in (tree_of, nodes, calls, needed):
        cached.cache_clear()


@cache
def nodes(path: Path) -> list[ast.AST]:
    kinds = ast.Import | ast.ImportFrom | ast.Call | ast.ExceptHandler
    return [node for node in ast.walk(tree_of()[path]) if isinstance(node, kinds)]


def imports(path: Path) -> Iterator[tuple[str, int]]:
    for node in nodes(path):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, f"{path}:{node.lineno}: a relative import"
            yield node.module, node.lineno
            yield from ((f"{node.module}.{a.name}", node.lineno) for a in node.names)


@cache
def calls(path: Path) -> list[tuple[str, int]]:
    return [
        (ast.unparse(node.func), node.lineno)
        for node in nodes(path)
        if isinstance(node, ast.Call)
    ]


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(path): path for path in FILES}


@cache
def needed(path: Path) -> set[str]:
    """The modules of rems_net that a file imports, anywhere but for type checking."""
    found: set[str] = set()

    def look(node: ast.AST) -> None:
        for child in below(node):
            if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
                continue
            if isinstance(child, ast.Import):
                found.update(alias.name for alias in child.names)
            elif isinstance(child, ast.ImportFrom) and child.module:
                for alias in child.names:
                    inner = f"{child.module}.{alias.name}"
                    found.add(inner if inner in MODULES else child.module)
            look(child)

    look(tree_of()[path])
    return found & MODULES.keys() - {module_of(path)}


def test_imports_run_one_way() -> None:
    for path in FILES:
        here = room(path)
        if here in ("__init__", "__main__"):
            continue
        for name in needed(path):
            there = room(MODULES[name])
            assert there in (here, "__init__") or there in ROOMS[here], (
                f"{path.name}: {here} imports {name}"
            )


def test_no_circles() -> None:
    """Take away, again and again, the modules that need none of those that are left."""
    left = {name: needed(path) for name, path in MODULES.items()}
    while free := {n for n, needs in left.items() if not needs & left.keys()}:
        left = {n: needs for n, needs in left.items() if n not in free}
    assert not left, f"in a circle, or above one: {sorted(left)}"


def test_private_parts_stay_in_their_room() -> None:
    for path in FILES:
        for name, line in imports(path):
            private = [p for p in name.split(".") if p.startswith("_") and p[1] != "_"]
            if name.startswith("rems_net") and private:
                home = MODULES.get(name.partition("._")[0])
                assert home is not None, f"{path.name}:{line}: {name}"
                assert room(home) == room(path), f"{path.name}:{line}: {name}"


def test_a_folder_holds_a_dozen_files() -> None:
    for folder in {path.parent for path in FILES} - {PACKAGE / "cli"}:
        files = [p for p in folder.glob("*.py") if p.name != "__init__.py"]
        assert len(files) <= 12, f"{folder.name}: {len(files)} files"


def test_wings_of_a_room_have_no_two_files_of_one_name() -> None:
    """Rooms may, as `inputs/csv.py` and `outputs/csv.py`; so may worlds of drivers."""
    rooms = (path for path in PACKAGE.rglob("*") if path.is_dir())
    for room in rooms:
        names = [path.name for path in room.glob("*/*.py")]
        twice = {one for one in names if names.count(one) > 1}
        assert twice <= {"__init__.py", "world.py"}, f"{room}: {twice}"


def test_the_rule_of_a_tick_is_short() -> None:
    """A reader finds it in one room, which is read in an evening."""
    texts = [p.read_text(encoding="utf-8") for p in FILES if room(p) == "engine"]
    assert sum(len(text.splitlines()) for text in texts) <= 900


def test_one_room_speaks_zenoh() -> None:
    for path in FILES:
        if room(path) != "router":
            names = {n.split(".")[0] for n, _ in imports(path)}
            assert "zenoh" not in names, path


def test_optional_libraries_live_in_one_file_each() -> None:
    for path in FILES:
        for name, line in imports(path):
            home = OPTIONAL.get(name.split(".")[0], ())
            homes = [
                PACKAGE / one for one in ([home] if isinstance(home, str) else home)
            ]
            assert not homes or path in homes, f"{path.name}:{line}: {name}"


def test_portable_and_safe() -> None:
    for path in FILES:
        names = {n.split(".")[0] for n, _ in imports(path)}
        if path.relative_to(PACKAGE).as_posix() not in GUARDED:
            assert not names & UNIX_ONLY, path
        unsafe = {"pickle", "marshal", "shelve", "dill", "cloudpickle"}
        assert not names & unsafe, path
        called = {name for name, _ in calls(path)}
        assert not called & {"os.fork", "os.killpg", "eval", "os.setsid"}, path
        source = path.read_text(encoding="utf-8")
        for signal in ("SIGKILL", "SIGUSR1", "SIGALRM", "SIGHUP"):
            assert f"signal.{signal}" not in source, path


def test_time_is_received() -> None:
    for path in FILES:
        here = room(path)
        name = path.relative_to(PACKAGE).as_posix()
        if here.split("/")[0] not in TIMELESS or {here, name} & KEEPERS_OF_TIME:
            continue
        if here not in WATCHERS:
            assert "rems_net.agents.wall" not in needed(path), path
        for name, line in calls(path):
            clock = name.startswith("time.") and name != "time.strftime"
            assert not clock, f"{path.name}:{line}: {name} where time is received"
            assert "datetime.now" not in name, f"{path.name}:{line}"


#: what reads the standard input while nothing else goes on: a question to a person, and
#: the first line of a process
QUESTIONS = {
    "cli/agent/bring.py",
    "cli/board/calibrate.py",
    "cli/board/provision.py",
    "drivers/hardware/holder.py",
}


def test_no_thread_waits_for_the_standard_input() -> None:
    """On Windows no library can be loaded as long as a read of a pipe waits."""
    for path in FILES:
        here = path.relative_to(PACKAGE).as_posix()
        if here in QUESTIONS or here.startswith("system/"):
            continue
        text = path.read_text(encoding="utf-8")
        reads = r"stdin\.(read|buffer)|in sys\.stdin\b|os\.read\(0\b"
        assert not re.search(reads, text), here
        asked = [line for name, line in calls(path) if name == "input"]
        assert not asked, f"{here}:{asked}"


#: what tells the system time, and what compares it with another laptop's
TELL_THE_TIME = {"agents/clock/replies.py", "client/checkup.py"}


def test_the_time_of_day_decides_nothing() -> None:
    """It can be set, forward and back, while a run goes on. The doctor compares it."""
    for path in FILES:
        if path.relative_to(PACKAGE).as_posix() in TELL_THE_TIME:
            continue
        for name, line in calls(path):
            last = name.rpartition(".")[2]
            of_day = last in ("utcnow", "today") or name.endswith("datetime.now")
            told = name in ("time.time", "time.time_ns") or of_day
            assert not told, f"{path.name}:{line}: {name}; use time.monotonic"


def test_no_swallowed_errors() -> None:
    for path in FILES:
        for node in nodes(path):
            if isinstance(node, ast.ExceptHandler):
                assert node.type is not None, f"{path.name}:{node.lineno}: bare except"


@pytest.mark.parametrize("door", DOORS)
def test_the_public_names_are_all(door: str) -> None:
    """Every name of a front door is there, has a docstring, and is offered once."""
    package = importlib.import_module(door)
    names = package.__all__
    assert len(names) == len({*names})
    assert {*names} <= {*dir(package)}
    for name in names:
        assert getattr(package, name).__doc__, f"{door}.{name} has no docstring"
    with pytest.raises((AttributeError, UnitError), match="nosuchname"):
        package.nosuchname  # noqa: B018
    # A module of such a name would take its place as soon as it is imported.
    modules = pkgutil.iter_modules(getattr(package, "__path__", []))
    assert not {*names} & {one.name for one in modules}


def test_what_users_read_imports_by_the_front_doors() -> None:
    """README, pages, examples, and what `rems new` writes: four packages, no more."""
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    pages += [*(ROOT / "deploy").glob("*.md"), *(ROOT / "examples").glob("*.py")]
    shown = [*(ROOT / "docs" / "programs").glob("*.py"), ROOT / "docs/rover/rover.py"]
    pages += [*(PACKAGE / "templates").iterdir(), PACKAGE / "bodies/files/draft.py"]
    pages += [*(ROOT / "docs" / "reference").glob("*.txt"), ROOT / "CONTRIBUTING.md"]
    found = re.compile(
        r"^ *(?:yield f?\")?from (rems_net[\w.]*) import ([^\n#(\"]*)", re.M
    )
    whole = {ROOT / "examples", *(path.parent for path in shown)}
    for page in [*pages, *shown]:
        text = page.read_text(encoding="utf-8")
        if page.suffix == ".py" and page.parent not in whole:
            text = "\n".join(line for line in text.split("\n") if "yield" in line)
        for door, names in found.findall(text):
            assert door in DOORS, f"{page.name}: from {door} import {names}"


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
    "module", ["rems_net.agents.experiment.experiment", "rems_net.router.session"]
)
def test_rooms_import_alone(module: str) -> None:
    assert importlib.import_module(module)
