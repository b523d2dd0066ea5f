"""A run's folder: its own while it runs, and never mixed with an older run's."""

import hashlib
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

from rems_net.agents.about.wiring import resolve
from rems_net.agents.agent import Agent, Input, Output
from rems_net.agents.experiment.checking import settings, surroundings
from rems_net.agents.experiment.checking.connections import written
from rems_net.agents.experiment.lineup import Lineup
from rems_net.agents.experiment.origins import manifest
from rems_net.agents.experiment.show import Show
from rems_net.agents.tick import time_of
from rems_net.errors import AgentError, ExperimentError, shown
from rems_net.events import Event
from rems_net.recordings.manifest import NAME, Manifest, read_manifest
from rems_net.recordings.mcap.scan import finish as end_recording
from rems_net.recordings.mcap.writer import FILE as RECORDING
from rems_net.recordings.recording import Recording, moved
from rems_net.router import notes
from rems_net.system.patience import patiently

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
    pace: float = 0.0,
    dt: float = 0.0,
) -> Iterator[Path]:
    """Make `out` (or `runs/<name>`) the folder of a run, until the block ends.

    Earlier files there are moved, which is reported: all in the usual folder; in
    another folder, only the files that the earlier run lists.
    native: also if the lineup does not ask for it.  pace: of the run; 0 for none.
    dt: s, of the open fabric that it joins; 0 for its own.
    Raises ExperimentError if another run writes there, or the files cannot be moved.
    """
    path = settings.check_folder(Path("runs") / lab.name if out is None else out)
    usual = path.parts[-2:] == ("runs", lab.name)
    saved = manifest(lab, agents, native=native, pace=pace)
    saved = replace(saved, dt=dt or lab.dt)
    with locked(path):
        found = [p for p in _entries(path) if p.name not in NOTHING]
        before = read_manifest(path)
        if found and (usual or before):
            files = () if before is None else before.files
            needed = [a.file() for a in agents.values() if isinstance(a, Input)]
            _check_needed(path, None if usual else files, [p for p in needed if p])
            show.say(
                "run", Event("info", 0, "run", "moved", move_away(path, files, usual))
            )
        settings.make_folder(path)
        # A run that is interrupted leaves at least these.
        expected = _expected(lab, agents)
        files = [file for file in expected if not (path / file).exists()]
        put_manifest(replace(saved, files=files), path)
        there = {path / NAME, *_files(path)}
        for text in surroundings.doubts(agents):
            show.say("run", Event("warning", 0, "run", "start", text))
        for plan in lab.plans.values():
            plan.out = path
        try:
            yield path
        except BaseException as error:
            _list(path, saved, [file for file in _files(path) if file not in there])
            if isinstance(error, Exception):
                _leave(path)
            raise
        finally:
            _mend(path, show)


def put_manifest(saved: Manifest, folder: Path) -> None:
    """Write the manifest of a run into its folder. Raises ExperimentError."""
    try:
        saved.write(folder)
    except OSError as error:
        raise ExperimentError(
            f"cannot write {folder / NAME}: {error.strerror}. (R0414)"
        ) from None


def note_end(error: BaseException, n: int, dt: float, folder: Path) -> None:
    """Add to an error that ended a run how far it came, and where its files are."""
    how = "Interrupted" if isinstance(error, KeyboardInterrupt) else "Ended"
    if n and isinstance(error, KeyboardInterrupt | AgentError):
        error.add_note(
            f"{how} after tick {n} ({time_of(n, dt):.2f} s); what the outputs had "
            f"written is in {shown(folder)}."
        )
    elif isinstance(error, KeyboardInterrupt):
        error.add_note(f"{how} before the first tick.")


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


def finish(folder: Path, result: Result) -> None:
    """Add the run's files to the folder's manifest; find files that no output lists."""
    saved, files = read_manifest(folder), result.files
    if saved is None:
        return
    # An output may have been killed, and the run went on.
    left = [folder / name for name in saved.files if (folder / name).exists()]
    files += [path for path in left if path not in files]
    since = (folder / NAME).stat().st_mtime_ns  # written as the run began
    known = {folder / NAME, *files, *(p for f in files for p in f.parents)}
    found = sorted(path for path in _entries(folder) if path not in known)
    result.others = [p for p in found if p.lstat().st_mtime_ns >= since]
    _list(folder, saved, [path for path in files if path.is_relative_to(folder)])


def _list(folder: Path, saved: Manifest, files: Sequence[Path]) -> None:
    """Write the manifest of a run that is over, with the files that it has written."""
    names = sorted(path.relative_to(folder).as_posix() for path in files)
    with suppress(OSError):  # they are complete, or the run's own error is reported
        replace(saved, files=names).write(folder)


def _files(folder: Path) -> list[Path]:
    """Return the files in a folder, and in those below it."""
    with suppress(OSError):
        return [path for path in folder.rglob("*") if path.is_file()]
    return []


def _expected(lab: Lineup, agents: Mapping[str, Agent]) -> list[str]:
    """Return the names of the files that the outputs are going to write."""
    entries, names = written(agents), dict[str, None]()
    for key, agent in agents.items():
        if isinstance(agent, Output):
            sources = lab.plans[key].sources.values()
            read = [one for s in sources for one in resolve(s, entries, key, key)]
            schemas = {r.key: agents[r.entry.key].published()[r.port] for r in read}
            names |= dict.fromkeys(agent.expected(schemas))
    return [*names]


def _entries(path: Path) -> list[Path]:
    try:
        return list(path.iterdir()) if path.is_dir() else []
    except OSError as error:
        raise ExperimentError(
            f"cannot look into the folder {path}: {error.strerror}. (R0414)"
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
                f"this run plays {shown(file)}, and {shown(path)} is where it would "
                "write; give the experiment another name or folder. (R0414)"
            )


def move_away(path: Path, files: Sequence[str], whole: bool) -> str:
    """Move an earlier run's files to the next free name; return a sentence about it."""
    count = 1
    while (new := path.with_name(f"{path.name}.{count}")).exists():
        count += 1
    try:
        if whole:
            patiently(partial(path.rename, new))
        else:
            for name in [*files, NAME, *PICTURES]:
                target = new / name
                target.parent.mkdir(parents=True, exist_ok=True)
                with suppress(FileNotFoundError):
                    patiently(partial((path / name).rename, target))
        moved(path, new)
    except OSError as error:
        raise ExperimentError(
            f"what an earlier run left in {shown(path)} cannot be moved to "
            f"{shown(new)}: {error.strerror}. Close what has its files open (Excel?), "
            f"or give this run another folder: --out {shown(new)} (R0414)"
        ) from None
    what = "was in" if whole else "an earlier run left in"
    return f"what {what} {shown(path)} is now in {shown(new)}"


def _leave(path: Path) -> None:
    """Remove the folder of a run that was refused before it wrote anything."""
    with suppress(OSError):
        if [entry.name for entry in path.iterdir()] == [NAME]:
            (path / NAME).unlink()
            path.rmdir()


@contextmanager
def locked(path: Path) -> Iterator[None]:
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
                f"another run that still goes on writes to {shown(path)}; end that "
                "one (`rems clock end`), or give this one another name or folder."
                " (R0414)"
            ) from None
        raise ExperimentError(f"cannot write {file}: {error}. (R0414)") from None
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
