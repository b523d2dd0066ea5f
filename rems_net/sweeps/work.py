"""Work: one run of a sweep, in any process: a worker's, or one of another machine.

A run comes as plain data, and its row goes back as plain data. A worker of a cluster
returns its files in the same way, so it needs no disk in common with the sweep. The
sweep's own workers write them where they stay: a copy would cost 3 % of a run of 50 ms.
"""

import hashlib
import json
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from rems_net.agents.experiment import origins
from rems_net.agents.experiment.again.changed import replace_in, set_in
from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.experiment.folder import Result, finish
from rems_net.agents.experiment.placement.needs import source_digest
from rems_net.agents.experiment.solo import Solo
from rems_net.agents.protocol.plan import read_plans
from rems_net.errors import AgentError, ExperimentError, RemsError, uncoded
from rems_net.events import Event, listening
from rems_net.recordings.manifest import Manifest
from rems_net.router.message import machine
from rems_net.sweeps.measures import measures, sampled

PACKAGE = Path(__file__).parent.parent
#: words of `status`
DONE, FAILED = "done", "failed"
#: code of an output that cannot write: its run has not failed, and is made again
NO_ROOM = "(R0801)"


class Run(NamedTuple):
    """One run of a sweep: its number, from 1, its seed, and the values of its factors.

    A factor with the key of an agent is its class.
    """

    number: int
    seed: int
    point: Mapping[str, object]


class Row(NamedTuple):
    """Outcome of a run: what the table has of it.

    status: `done` or `failed`.  ticks: made.  values: of the measures, each with its
    unit; none if it failed.  error: its sentence.
    """

    number: int
    status: str
    ticks: int
    values: Sequence[tuple[object, str]]
    error: str


class Made(NamedTuple):
    """A run that is over: its row, its files by name, and what it warned of."""

    row: Row
    files: Mapping[str, bytes]
    news: Sequence[str]


def described(lab: Experiment, spec: Manifest, texts: Sequence[str]) -> str:
    """Return what a worker needs to run an experiment, as text.

    spec: of the experiment, with the sources and versions of all its variants.
    texts: the measures.
    """
    below = [name for name in spec.sources if (lab.folder / name).is_file()]
    made = {
        **{"name": lab.name, "dt": lab.dt, "duration": lab.duration},
        **{"record": lab.record, "folder": str(lab.folder), "agents": spec.agents},
        **{"sources": spec.sources, "below": below, "versions": spec.versions},
        **{"code": code(), "measures": [*texts], "host": machine()},
    }
    return json.dumps(made, sort_keys=True, default=bytes.hex)


def work(text: str, run: Run, place: str = "") -> Made:
    """Make one run. A run that fails has a row with the reason.

    place: the folder in which its files stay; without it, they are in the result.
    Raises ExperimentError if this worker cannot make it as the others do.
    """
    spec, news = _spec(text), dict[str, None]()
    _check_version(spec)
    with _folder(place) as folder:

        def note(event: Event) -> None:
            if event.level == "warning":
                news[event.text] = None

        with listening(note):
            row = _row(spec, run, folder)
        row = row._replace(error=row.error.replace(f"{folder}", "its folder"))
        return Made(row, {} if place else dict(_files(folder)), [*news])


def _row(spec: Mapping[str, Any], run: Run, folder: Path) -> Row:
    lab = built(spec, run)
    engine: Solo | None = None
    values: Sequence[tuple[object, str]] = ()
    status, error = DONE, ""
    try:
        vary(lab, run)
        engine = lab.engine(out=folder)
        with engine:
            values = _stepped(engine, spec["measures"])
    except RemsError as why:
        if isinstance(why, AgentError) and NO_ROOM in str(why):
            raise ExperimentError(
                f"{machine()} has no room for run {run.number}: "
                f"{uncoded(why).partition(';')[0]}. Make room there, and type the same "
                "command again. (R1025)"
            ) from None
        status, error = FAILED, str(why)
    if engine is None:
        return Row(run.number, status, 0, values, error)
    files = [folder / file for file in engine.files]
    finish(folder, Result(engine.n, folder, files))
    return Row(run.number, status, engine.n, values, error)


def _stepped(engine: Solo, texts: Sequence[str]) -> list[tuple[object, str]]:
    """Make all ticks; return the values of the measures."""
    here = engine.agents
    some = measures(texts, here)
    if not any(one.lasting for one in some):
        engine.run()
        kept = sampled(some, here)
    else:
        kept = sampled(some, here)
        for values in kept.values():
            values.clear()  # those before the first tick

        def keep(_: Solo) -> bool:
            for place, (value,) in sampled(some, here).items():
                kept[place].append(value)
            return False

        engine.run(until=keep)
    return [one.value(kept) for one in some]


def replaced(lab: Experiment, run: Run) -> None:
    """Give an experiment the classes of a run. Raises ExperimentError."""
    for key, cls in run.point.items():
        if key in lab.plans:
            replace_in(lab, key, str(cls))


def vary(lab: Experiment, run: Run) -> None:
    """Give an experiment the seed and the settings of a run. Raises ExperimentError."""
    lab.seed = run.seed
    for where, value in run.point.items():
        if where not in lab.plans:
            set_in(lab, where, value)


def built(spec: Mapping[str, Any], run: Run) -> Experiment:
    """Return the experiment with the classes of a run.

    Raises ExperimentError if it is another one here.
    """
    lab = Experiment(
        spec["name"],
        dt=spec["dt"],
        duration=spec["duration"],
        folder=spec["folder"],
        record=spec["record"],
    )
    try:
        plans = read_plans(spec["agents"], lab.folder, lab.dt)
        lab.plans = {plan.key: plan for plan in plans}
        replaced(lab, run)
    except RemsError as error:
        raise _unlike(spec, uncoded(error).rstrip(".")) from None
    _check_alike(spec, lab)
    return lab


@lru_cache(maxsize=8)
def _spec(text: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(text)
    return found


# -- the same on every worker --------------------------------------------------------


@lru_cache(maxsize=1)
def code() -> str:
    """Return the SHA-256 of rems_net itself: a version can have many states."""
    mark = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        mark.update(f"{path.relative_to(PACKAGE).as_posix()}\n".encode())
        mark.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return mark.hexdigest()


def _check_version(spec: Mapping[str, Any]) -> None:
    """Raise ExperimentError if rems_net is another one here."""
    was, here = spec["versions"]["rems_net"], origins.versions(())["rems_net"]
    if was != here:
        raise _unlike(spec, f"it has rems_net {here}, and {spec['host']} has {was}")
    if spec["code"] != code():
        raise _unlike(spec, f"its rems_net {here} has other code than {spec['host']}")


def _check_alike(spec: Mapping[str, Any], lab: Experiment) -> None:
    """Raise ExperimentError if a library or a source is another one here."""
    classes = [cls for plan in lab.plans.values() for cls in plan.classes]
    for library in sorted({n for cls in classes for n in getattr(cls, "needs", ())}):
        if find_spec(library) is None:
            raise _unlike(spec, f"the library {library} is not installed there")
    for name, here in origins.versions(classes).items():  # type: ignore[arg-type]
        if (was := spec["versions"].get(name)) != here:
            raise _unlike(spec, f"it has {name} {here}, and {spec['host']} has {was}")
    now = origins.digests(lab.plans, {}, lab.folder)
    for name, was in spec["sources"].items():
        path = lab.folder / name
        if path.is_file():
            now[name] = source_digest(path.read_bytes())
        if name in spec["below"] and name not in now:
            raise _unlike(spec, f"{path} is not there")
        if now.get(name, was) != was:
            raise _unlike(spec, f"{name} differs there and on {spec['host']}")


def _unlike(spec: Mapping[str, Any], why: str) -> ExperimentError:
    return ExperimentError(
        f"a worker on {machine()} differs from {spec['host']}, which has started the "
        f"sweep: {why}. Install and copy the same there, and type the same command "
        "again. (R1024)"
    )


@contextmanager
def _folder(place: str) -> Iterator[Path]:
    """Give an empty folder: this one, or one that is gone at the end of the block."""
    if not place:
        with tempfile.TemporaryDirectory(prefix="rems-") as name:
            yield Path(name).resolve()
        return
    shutil.rmtree(place, ignore_errors=True)  # of a worker that died
    yield Path(place)


def _files(folder: Path) -> Iterator[tuple[str, bytes]]:
    for path in sorted(folder.rglob("*")):
        if path.is_file():
            yield path.relative_to(folder).as_posix(), path.read_bytes()
