"""A run's folder: its own while it runs, and never mixed with an older run's."""

from __future__ import annotations

import hashlib
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from rems_net.agents.agent import Agent
from rems_net.agents.experiment.checking.settings import make_folder, origin
from rems_net.agents.robot import Robot
from rems_net.agents.tick import time_of
from rems_net.errors import ExperimentError
from rems_net.recordings.csv_file import heading
from rems_net.recordings.manifest import NAME, Manifest, Start, read_manifest
from rems_net.recordings.recording import moved
from rems_net.router import notes

#: what systems leave in a folder that nobody has put anything into
NOTHING = {".DS_Store", "Thumbs.db", "desktop.ini"}


@contextmanager
def own_folder(
    path: Path,
    manifest: Manifest,
    *,
    usual: bool,
    needed: Sequence[Path],
    tell: Callable[[str], None],
) -> Iterator[Path]:
    """Make `path` the folder of a run, until the block ends; what was there is moved.

    Everything, where it is the `usual` one or an earlier run began in an empty one;
    of any other folder, only what the earlier run says it made. The manifest is put
    into it. needed: files that the run reads. tell: called with a sentence about
    what was moved.
    Raises ExperimentError where another run writes there, or it cannot be moved.
    """
    with _lock(path):
        found = [p for p in _entries(path) if p.name not in NOTHING]
        before = read_manifest(path)
        whole = usual or not found or (before is not None and before.whole)
        if found and (whole or before):
            files = () if before is None else before.files
            _check_needed(path, None if whole else files, needed)
            tell(_move(path, files, whole))
        make_folder(path)
        # A run that is interrupted leaves at least these.
        expected = [f"{robot}.csv" for robot in manifest.robots]
        files = [name for name in expected if not (path / name).exists()]
        manifest = replace(manifest, whole=whole, files=files)
        try:
            manifest.write(path)
        except OSError as error:
            raise ExperimentError(
                f"cannot write {path / NAME}: {error.strerror}."
            ) from None
        yield path


def finish(folder: Path, files: Sequence[Path]) -> None:
    """Add to the folder's manifest what the run has made."""
    told = read_manifest(folder)
    if told is not None:
        ours = [path for path in files if path.is_relative_to(folder)]
        names = sorted(path.relative_to(folder).as_posix() for path in ours)
        with suppress(OSError):  # the recordings themselves are whole
            replace(told, files=names).write(folder)


def describe(
    name: str,
    agents: Mapping[str, Agent],
    since: Mapping[str, int],
    dt: float,
    seed: int,
) -> Manifest:
    """What a run says of itself before it starts: its seed, where its robots are."""
    robots = {}
    for key, agent in sorted(agents.items()):
        # Where a robot that is really driven stands is known to nobody before.
        if isinstance(agent, Robot) and agent.lockstep:
            state, places = agent.state, {}
            pairs = zip(state.schema.paths, state.schema.fields, strict=True)
            for path, field in pairs:
                if field.dtype == "float" and not field.shape:
                    places[heading(f"state/{path}", field.unit)] = float(state[path])
            start = time_of(since[key] - 1, dt)
            with origin(f"robot {agent.name!r}"):
                robots[agent.name] = Start(start, places, _radius(agent))
    return Manifest(name, False, robots, seed=seed)


def _radius(agent: Any) -> float:
    """Of the round wall it drives in, m; 0 where there is none."""
    arena = getattr(agent, "arena", None)
    radius = getattr(arena() if callable(arena) else None, "radius", 0.0)
    return float(radius) if isinstance(radius, int | float) else 0.0


def _entries(path: Path) -> list[Path]:
    try:
        return list(path.iterdir()) if path.is_dir() else []
    except OSError as error:
        raise ExperimentError(
            f"cannot look into the folder {path}: {error.strerror}."
        ) from None


def _check_needed(
    path: Path, files: Sequence[str] | None, needed: Sequence[Path]
) -> None:
    """Refuse to move what the run itself reads; files: None for all in the folder."""
    for file in (p.resolve() for p in needed):
        if file.is_relative_to(path) and (
            files is None or file.relative_to(path).as_posix() in files
        ):
            raise ExperimentError(
                f"this run plays {_shown(file)}, and {_shown(path)} is where it would "
                "write; give the experiment another name or folder."
            )


def _move(path: Path, files: Sequence[str], whole: bool) -> str:
    """Move what an earlier run left to the next free name; what to tell."""
    count = 1
    while (new := path.with_name(f"{path.name}.{count}")).exists():
        count += 1
    try:
        if whole:
            path.rename(new)
            moved(path, new)
        else:
            for name in [*files, NAME]:
                target = new / name
                target.parent.mkdir(parents=True, exist_ok=True)
                with suppress(FileNotFoundError):
                    (path / name).rename(target)
    except OSError as error:
        raise ExperimentError(
            f"what an earlier run left in {_shown(path)} cannot be moved to "
            f"{_shown(new)}: {error.strerror}. Close what has its files open, or give "
            "this run another folder."
        ) from None
    what = "was in" if whole else "an earlier run left in"
    return f"what {what} {_shown(path)} is now in {_shown(new)}"


def _shown(path: Path) -> str:
    with suppress(ValueError, OSError):
        return str(path.relative_to(Path.cwd()))
    return str(path)


@contextmanager
def _lock(path: Path) -> Iterator[None]:
    """Hold the folder against other runs of this machine, as long as we live.

    SQLite locks a file in the same way on every system, and the system takes the lock
    from a process that dies. The file is in the folder for notes, which is never on a
    network.
    """
    mark = hashlib.sha256(str(path).encode()).hexdigest()[:16]
    file = notes.folder() / f"{mark}.lock"
    held = sqlite3.connect(file, timeout=0, isolation_level=None)
    try:
        held.execute("BEGIN EXCLUSIVE")
    except sqlite3.OperationalError:
        held.close()
        raise ExperimentError(
            f"another run that still goes on writes to {_shown(path)}; end that one "
            "(`rems clock end`), or give this one another name or folder."
        ) from None
    try:
        yield
    finally:
        try:
            file.unlink(missing_ok=True)
            held.close()
        except OSError:  # on Windows, not while it is open
            held.close()
            with suppress(OSError):
                file.unlink()
