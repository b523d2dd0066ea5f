"""A run's folder: its own while it runs, and never mixed with an older run's."""

import hashlib
import os
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from rems_net.agents.agent import Agent, Input
from rems_net.agents.experiment import origins
from rems_net.agents.experiment.checking import settings, surroundings
from rems_net.agents.experiment.lineup import Lineup
from rems_net.agents.experiment.show import Show
from rems_net.agents.parts import reference
from rems_net.agents.protocol.plan import Plan, by_kind
from rems_net.agents.robot import Robot
from rems_net.agents.tick import time_of
from rems_net.agents.verbs import CALLED
from rems_net.agents.world import World
from rems_net.errors import AgentError, ExperimentError
from rems_net.events import Event
from rems_net.maths.numerics import describe as describe_numerics
from rems_net.maths.numerics import environment
from rems_net.pictures import album, is_picture
from rems_net.recordings.csv_file import heading, recorded
from rems_net.recordings.manifest import NAME, Manifest, Start, read_manifest
from rems_net.recordings.mcap.scan import finish as end_recording
from rems_net.recordings.mcap.writer import FILE as RECORDING
from rems_net.recordings.recording import Recording, moved
from rems_net.router import notes

#: files that are drawn into it when the run is over
PICTURES = ("comparison.png", "plot.png")
#: files that systems leave in a folder that no user has put anything into
NOTHING = {".DS_Store", "Thumbs.db", "desktop.ini"}


class Result(Recording):
    """Result of a run: its recording, and how many ticks were made.

    others: other files written into its folder, which no output has listed as made
    """

    others: Sequence[Path] = ()

    def __init__(self, ticks: int, folder: Path, files: Sequence[Path]):
        super().__init__(folder, files)
        self.ticks = ticks


@contextmanager
def own_folder(
    lab: Lineup,
    out: Path | str | None,
    agents: Mapping[str, Agent],
    show: Show,
    *,
    native: bool = False,
) -> Iterator[Path]:
    """Make `out` (or `runs/<name>`) the folder of a run, until the block ends.

    Earlier files there are moved, which is reported: all in the usual folder; in
    another folder, only the files that the earlier run lists.
    native: also if the lineup does not ask for it.
    Raises ExperimentError if another run writes there, or the files cannot be moved.
    """
    path = settings.check_folder(Path("runs") / lab.name if out is None else out)
    usual = path.parts[-2:] == ("runs", lab.name)
    told = manifest(lab, agents, native=native)
    with _lock(path):
        found = [p for p in _entries(path) if p.name not in NOTHING]
        before = read_manifest(path)
        if found and (usual or before):
            files = () if before is None else before.files
            needed = [a.file() for a in agents.values() if isinstance(a, Input)]
            _check_needed(path, None if usual else files, [p for p in needed if p])
            show.say("run", Event("info", 0, "run", "moved", _move(path, files, usual)))
        settings.make_folder(path)
        # A run that is interrupted leaves at least these.
        worlds = [a for a in agents.values() if isinstance(a, World) and a.schemas()]
        names = [*told.robots, *(recorded(w.name, w.kind) for w in worlds)]
        expected = [*(f"{name}.csv" for name in names), *_albums(agents.values())]
        expected.append(RECORDING)
        files = [file for file in expected if not (path / file).exists()]
        put_manifest(replace(told, files=files), path)
        for text in surroundings.doubts(agents):
            show.say("run", Event("warning", 0, "run", "start", text))
        for plan in lab.plans.values():
            plan.out = path
        try:
            yield path
        except Exception:
            _leave(path)
            raise
        finally:
            _mend(path, show)


def manifest(lab: Lineup, agents: Mapping[str, Agent], *, native: bool) -> Manifest:
    """Return what a run says of itself before it begins, without its files."""
    plans = [plan for _, plan in sorted(lab.plans.items())]
    return Manifest(
        lab.name,
        describe(lab.plans, agents, lab.dt),
        seed=lab.seed,
        numerics=numerics(agents.values(), native=native or lab.native),
        agents=by_kind((p.kind, _table(p, agents[p.key], lab)) for p in plans),
        worlds=surroundings.worlds(agents),
        dt=lab.dt,
        ticks=lab.ticks(agents) if lab.ends(agents) else 0,
        sources=origins.digests(lab.plans, agents, lab.folder),
        versions=origins.versions(agents.values()),
    )


def put_manifest(told: Manifest, folder: Path) -> None:
    """Write what a run says of itself into its folder. Raises ExperimentError."""
    try:
        told.write(folder)
    except OSError as error:
        raise ExperimentError(
            f"cannot write {folder / NAME}: {error.strerror}."
        ) from None


def note_end(error: BaseException, n: int, dt: float, folder: Path) -> None:
    """Add to an error that ended a run how far it came, and where its files are."""
    how = "Interrupted" if isinstance(error, KeyboardInterrupt) else "Ended"
    if n and isinstance(error, KeyboardInterrupt | AgentError):
        error.add_note(
            f"{how} after tick {n} ({time_of(n, dt):.2f} s); what the outputs had "
            f"written is in {_shown(folder)}."
        )
    elif isinstance(error, KeyboardInterrupt):
        error.add_note(f"{how} before the first tick.")


def _table(plan: Plan, agent: Agent, lab: Lineup) -> dict[str, Any]:
    """Return a plan as it is kept with a run: the same on every laptop."""

    def named(cls: type) -> str:
        try:
            where, _, name = reference(cls).rpartition(":")
        except ExperimentError:  # in one process a class may be in no file
            where, name = cls.__module__, cls.__qualname__
        return f"{origins.shown_class(where, lab.folder)}:{name}"

    made = plan.table(agent, lab.dt, named)
    leave = ("host", "machine", CALLED)  # it follows from the calling processes
    return {word: made[word] for word in made if word not in leave}


def _mend(folder: Path, show: Show) -> None:
    """Give a recording its end, if the process that wrote it was killed."""
    path = folder / RECORDING
    try:
        if path.is_file() and end_recording(path):
            text = (
                f"{RECORDING} was left without its end; it has one now, and all that "
                "was in whole chunks"
            )
            show.say("run", Event("info", 0, "run", "exit", text))
    except (OSError, ExperimentError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        text = f"{RECORDING} has no end, and got none: {why}"
        show.say("run", Event("warning", 0, "run", "exit", text))


def finish(folder: Path, result: Result, show: Show) -> None:
    """Add the run's files to the folder's manifest; find files that no output lists."""
    _mend(folder, show)
    told, files = read_manifest(folder), result.files
    left = folder / RECORDING
    if told and RECORDING in told.files and left.is_file() and left not in files:
        files.append(left)  # its output was killed, and the run went on
    if told is not None:
        since = (folder / NAME).stat().st_mtime_ns  # written as the run began
        known = {folder / NAME, *files, *(p for f in files for p in f.parents)}
        found = sorted(path for path in _entries(folder) if path not in known)
        result.others = [p for p in found if p.lstat().st_mtime_ns >= since]
        ours = [path for path in files if path.is_relative_to(folder)]
        names = sorted(path.relative_to(folder).as_posix() for path in ours)
        with suppress(OSError):  # the recordings themselves are complete
            replace(told, files=names).write(folder)


def describe(
    plans: Mapping[str, Plan], agents: Mapping[str, Agent], dt: float
) -> dict[str, Start]:
    """Return the places of the robots before their first step, by name."""
    robots, outlines = {}, surroundings.outlines(agents)
    for key, agent in sorted(agents.items()):
        # The place of a real robot is unknown before the run.
        if isinstance(agent, Robot) and agent.lockstep:
            state, places = agent.state, {}
            pairs = zip(state.schema.paths, state.schema.fields, strict=True)
            for path, field in pairs:
                if field.dtype == "float" and not field.shape:
                    places[heading(f"state/{path}", field.unit)] = float(state[path])
            start = time_of(plans[key].since - 1, dt)
            with settings.origin(f"robot {agent.name!r}"):
                robots[agent.name] = Start(
                    start,
                    places,
                    surroundings.radius(agent),
                    outlines.get(key, ""),
                    plans[key].world.partition("/")[2],
                )
    return robots


def numerics(agents: Iterable[Agent], *, native: bool) -> str:
    """Return the libraries that this machine's hosts and robots compute with."""
    line = describe_numerics(environment(os.environ, native=native))
    robots = (a for a in agents if isinstance(a, Robot))
    engines = [f"{lib} {v}" for lib, v in origins.versions(robots).items()]
    return ", ".join([line, *engines[1:]])  # the first is rems_net


def _albums(agents: Iterable[Agent]) -> Iterator[str]:
    """Yield the folders in which an output would keep what robots see."""
    for agent in agents:
        for port, schema in agent.schemas().items() if isinstance(agent, Robot) else ():
            for path, field in schema.rows():
                if is_picture(field):
                    yield album(agent.name, port, path)


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
    """Refuse to move files that the run itself reads; files: None for all of them."""
    for file in (p.resolve() for p in needed):
        if file.is_relative_to(path) and (
            files is None or file.relative_to(path).as_posix() in files
        ):
            raise ExperimentError(
                f"this run plays {_shown(file)}, and {_shown(path)} is where it would "
                "write; give the experiment another name or folder."
            )


def _move(path: Path, files: Sequence[str], whole: bool) -> str:
    """Move an earlier run's files to the next free name; return a sentence about it."""
    count = 1
    while (new := path.with_name(f"{path.name}.{count}")).exists():
        count += 1
    try:
        if whole:
            path.rename(new)
        else:
            for name in [*files, NAME, *PICTURES]:
                target = new / name
                target.parent.mkdir(parents=True, exist_ok=True)
                with suppress(FileNotFoundError):
                    (path / name).rename(target)
        moved(path, new)
    except OSError as error:
        raise ExperimentError(
            f"what an earlier run left in {_shown(path)} cannot be moved to "
            f"{_shown(new)}: {error.strerror}. Close what has its files open, or give "
            "this run another folder."
        ) from None
    what = "was in" if whole else "an earlier run left in"
    return f"what {what} {_shown(path)} is now in {_shown(new)}"


def _leave(path: Path) -> None:
    """Remove the folder of a run that was refused before it wrote anything."""
    with suppress(OSError):
        if [entry.name for entry in path.iterdir()] == [NAME]:
            (path / NAME).unlink()
            path.rmdir()


def _shown(path: Path) -> str:
    with suppress(ValueError, OSError):
        return str(path.relative_to(Path.cwd()))
    return str(path)


@contextmanager
def _lock(path: Path) -> Iterator[None]:
    """Lock the folder against other runs of this machine, as long as we live.

    SQLite locks a file in the same way on every system, and the system releases the
    lock of a process that dies. The file is in the folder for notes, which is never on
    a network.
    """
    mark = hashlib.sha256(str(path).encode()).hexdigest()[:16]
    file = notes.folder() / f"{mark}.lock"
    held = None
    try:
        held = sqlite3.connect(file, timeout=0, isolation_level=None)
        held.execute("BEGIN EXCLUSIVE")
    except sqlite3.Error as error:
        if held is not None:
            held.close()
        if error.sqlite_errorcode == sqlite3.SQLITE_BUSY:
            raise ExperimentError(
                f"another run that still goes on writes to {_shown(path)}; end that "
                "one (`rems clock end`), or give this one another name or folder."
            ) from None
        raise ExperimentError(f"cannot write {file}: {error}.") from None
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
