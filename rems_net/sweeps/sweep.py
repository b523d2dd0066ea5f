"""Sweep: one experiment, run many times, into one table."""

import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import contextmanager, suppress
from copy import copy
from dataclasses import replace
from itertools import product
from pathlib import Path

from rems_net.agents import registry
from rems_net.agents.experiment import origins
from rems_net.agents.experiment.again.changed import replace_in
from rems_net.agents.experiment.checking.settings import check_seed
from rems_net.agents.experiment.direct import check_direct
from rems_net.agents.experiment.experiment import Experiment
from rems_net.agents.experiment.file import load
from rems_net.agents.experiment.folder import locked
from rems_net.agents.experiment.source.mistakes import idle
from rems_net.agents.robot import Driver
from rems_net.arguments import taught
from rems_net.errors import ExperimentError, RemsError, uncoded
from rems_net.events import warn
from rems_net.recordings.manifest import Manifest
from rems_net.sweeps.factors import Factor, Point, check_points, factor, names, points
from rems_net.sweeps.measures import measures
from rems_net.sweeps.pool import Pool, cores
from rems_net.sweeps.progress import Progress
from rems_net.sweeps.store import Store
from rems_net.sweeps.swept import Swept
from rems_net.sweeps.work import (
    FAILED,
    Made,
    Row,
    Run,
    described,
    replaced,
    vary,
    work,
)
from rems_net.system.interrupts import without_ctrl_c

#: runs of the largest sweep that is not asked for by its number
MOST = 100_000
#: runs that an executor has at a time: enough for a hundred cores
AHEAD = 400
#: The same, for each process of our own: waiting for many takes longer than for few.
EACH = 4
#: How often a run is tried whose worker dies.
TRIES = 3
#: s. Time between two looks at the progress.
LOOK = 0.2


@taught(ExperimentError, set="settings=", jobs="workers=", folder="out=")
def sweep(
    experiment: Experiment | Path | str,
    settings: Mapping[str, object] | None = None,
    *,
    seeds: int | Sequence[int] = 1,
    samples: int = 0,
    points: Sequence[Mapping[str, object]] = (),
    measure: str | Sequence[str] = (),
    out: Path | str | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    most: int = MOST,
    put: Callable[[str], object] | None = None,
) -> Swept:
    """Run an experiment many times, into one folder and one table.

    experiment: or its file, `lab.toml` or `lab.py`.  settings: values by name, such as
    {"robot/sim.track": "90..130 mm/9"}, or a list of them; with the name of an agent,
    classes: {"robot/sim": ["kinematic", "mujoco"]}. All combinations are run; with
    `samples`, this many points of a Latin hypercube; with `points`, these.
    seeds: of each point, how many, from the experiment's own; or a list.
    measure: expressions, such as "max(sim.state.x)"; without any, all states at the
    end.  out: the folder, `runs/<name>_sweep` by default. A sweep that is there and was
    interrupted goes on.  workers: processes, one for each core by default.
    executor: of `concurrent.futures`, for other machines.  most: runs.
    put: called with lines about the progress.
    Raises ExperimentError; a run that fails has a row in the table.
    """
    registry.check_starts("sweep()")
    lab = experiment if isinstance(experiment, Experiment) else load(experiment)
    some = [measure] if isinstance(measure, str) else [*measure]
    factors = [factor(*one) for one in (settings or {}).items()]
    _check_words(workers, executor, samples)
    every = _seeds(seeds, lab.seed)
    _check_size(check_points(factors, samples, points), len(every), most)
    runs = _runs(lab.seed, factors, samples, points, every)
    spec = described(lab, _variants(lab, runs), some)
    columns = _check(lab, runs, some)
    store = Store(Path(out or Path("runs") / f"{lab.name}_sweep"), len(runs))
    what = json.dumps([spec, [run.point for run in runs], every], default=str)
    with locked(store.path):
        rows = {row.number: row for row in store.begin(what)}
        left = [run for run in runs if run.number not in rows]
        result = Swept(store.path, runs, names([runs[0].point]), columns)
        progress = Progress(len(runs), len(rows), put)
        progress.failed = sum(row.status == FAILED for row in rows.values())
        with _noted(progress), _writing(store, result, rows):
            if left:
                with _executor(executor, workers, len(left), store) as pool:
                    own = store if executor is None else None
                    for made in _made(pool, spec, left, progress, own):
                        with without_ctrl_c():  # a run that is there is counted
                            store.add(made)
                            rows[made.row.number] = made.row
                            progress.add(made.row.status == FAILED)
        progress.end()
    return result


def _seeds(given: int | Sequence[int], first: int) -> list[int]:
    if isinstance(given, int) and not isinstance(given, bool) and given > 0:
        return [*range(first, first + given)]
    if isinstance(given, list | tuple | range) and given:
        every = [check_seed(one) for one in given]
        if len({*every}) == len(every):
            return every
    raise ExperimentError(
        f"seeds is {given!r:.60}; expected how many, such as 20, or a list of "
        "different ones, such as 3, 5, 7. (R1022)"
    )


def _check_words(workers: object, executor: object, samples: object) -> None:
    """Refuse words that are no numbers, and an executor that is none."""
    if workers is not None and not (type(workers) is int and 0 < workers <= 1000):
        raise ExperimentError(
            f"workers is {workers!r}; expected a number of processes, from 1. (R1022)"
        )
    if type(samples) is not int or samples < 0:
        raise ExperimentError(
            f"samples is {samples!r}; expected a number of points, such as 100. (R1022)"
        )
    if executor is not None and not isinstance(executor, Executor):
        raise ExperimentError(
            f"executor is {executor!r:.60}; expected one of concurrent.futures. In a "
            "terminal, --on dask=tcp://10.0.0.5:8786 makes one. (R1022)"
        )


def _check_size(count: int, seeds: int, most: int) -> None:
    if count * seeds > most:
        raise ExperimentError(
            f"this sweep has {count * seeds:,} runs ({count:,} points, {seeds:,} "
            f"seeds); expected at most {most:,}. Give fewer values, or take samples of "
            "them: --samples 1000; if you mean it, type "
            f"--most {count * seeds}. (R1022)"
        )


def _runs(
    seed: int,
    factors: Sequence[Factor],
    samples: int,
    listed: Sequence[Point],
    seeds: Sequence[int],
) -> list[Run]:
    each = product(points(factors, samples, listed, seed), seeds)
    return [Run(number, one, point) for number, (point, one) in enumerate(each, 1)]


def _variants(lab: Experiment, runs: Sequence[Run]) -> Manifest:
    """Return the manifest of an experiment, with the sources of all its variants."""
    agents = lab.check()
    check_direct(lab.plans, agents)
    lab.ticks(agents)  # it has an end
    if nobody := idle(agents, lab.plans):
        warn("idle", nobody)
    spec = origins.manifest(lab, agents, native=True)
    sources, versions = dict(spec.sources), dict(spec.versions)
    before = {key: [*plan.classes] for key, plan in lab.plans.items()}
    keys = [name for name in runs[0].point if name in lab.plans]
    for key, cls in {(k, str(run.point[k])) for run in runs for k in keys}:
        try:
            replace_in(lab, key, cls)
            classes = lab.plans[key].classes
            sources |= origins.digests({key: lab.plans[key]}, {}, lab.folder)
            versions |= origins.versions(classes)  # type: ignore[arg-type]
        finally:
            lab.plans[key].classes = before[key]
    texts = {v for run in runs for v in run.point.values() if isinstance(v, str)}
    sources |= origins.files(texts, lab.folder)
    return replace(spec, sources=dict(sorted(sources.items())), versions=versions)


def _check(lab: Experiment, runs: Sequence[Run], some: Sequence[str]) -> list[str]:
    """Try the first and last value of each factor; return the names of the measures.

    Raises ExperimentError.
    """
    tried: list[str] = []
    for run in (runs[0], runs[-1]):
        tryout = copy(lab)
        tryout.plans = {
            key: replace(plan, classes=[*plan.classes], sources=dict(plan.sources))
            for key, plan in lab.plans.items()
        }
        try:
            replaced(tryout, run)
            vary(tryout, run)
            agents = tryout.check()
        except ExperimentError as error:
            raise ExperimentError(f"{uncoded(error)} (R1021)") from None
        check_direct(tryout.plans, agents)
        for key, agent in agents.items():
            if isinstance(agent, Driver) and agent.one_per_process:
                raise ExperimentError(
                    f"{key} has a driver of which a process holds one robot only, and "
                    "a worker makes one run after the other: give it another driver, "
                    f"such as --replace {key}=kinematic. (R1029)"
                )
        tried = [one.name for one in measures(some, agents)]
    return tried


@contextmanager
def _executor(
    given: Executor | None, workers: int | None, runs: int, store: Store
) -> Iterator[Executor]:
    """Yield the executor; one of our own is shut down at the end of the block."""
    if given is not None:
        yield given
        return
    pool = Pool(min(workers or cores(), runs))
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)
        store.tidy()


@contextmanager
def _writing(store: Store, result: Swept, rows: Mapping[int, Row]) -> Iterator[None]:
    """Write the table at the end of the block, also of a sweep that is interrupted."""
    try:
        yield
    except BaseException:
        result.rows = sorted(rows.values())
        with suppress(ExperimentError):  # the first error is the one to report
            store.tables(result.csv())
        raise
    result.rows = sorted(rows.values())
    store.tables(result.csv())


@contextmanager
def _noted(progress: Progress) -> Iterator[None]:
    """Add to what ends a sweep how far it came."""
    try:
        yield
    except (RemsError, KeyboardInterrupt) as error:
        again = "; type the same command again, and it goes on with the others"
        if progress.over:
            again = again if isinstance(error, KeyboardInterrupt) else ""
            error.add_note(f"{progress.over} of {progress.runs} runs are there{again}.")
        raise


def _made(
    pool: Executor,
    spec: str,
    runs: Sequence[Run],
    progress: Progress,
    store: Store | None,
) -> Iterator[Made]:
    """Yield each run as it is over. Raises ExperimentError of a worker.

    store: where the sweep's own workers write; None for those of another executor.
    """
    waiting, tries = [*reversed(runs)], Counter[int]()
    most = EACH * pool.count if isinstance(pool, Pool) else AHEAD
    busy: dict[Future[Made], Run] = {}
    warned: set[str] = set()
    try:
        while waiting or busy:
            while waiting and len(busy) < most:
                run = waiting.pop()
                place = [f"{store.part(run.number)}"] if store else []
                busy[pool.submit(work, spec, run, *place)] = run
            over, _ = wait(busy, LOOK, FIRST_COMPLETED)
            progress.look()
            for future in over:
                run = busy.pop(future)
                made = _outcome(future, run, tries)
                if made is None:
                    waiting.append(run)
                    continue
                for text in made.news:
                    if text not in warned:
                        warn("sweep", f"run {run.number}: {text}")
                    warned.add(text)
                yield made
    except BrokenExecutor as error:
        raise ExperimentError(
            f"the executor has no workers any more ({error or 'one died'}). (R1028)"
        ) from None
    finally:
        for future in busy:
            future.cancel()


def _outcome(future: Future[Made], run: Run, tries: Counter[int]) -> Made | None:
    """Return what a worker has made; None if it died and the run is tried again.

    Raises the error of a worker that is not like the others.
    """
    error = future.exception()
    if error is None:
        return future.result()
    if isinstance(error, RemsError | BrokenExecutor):
        vars(error).pop("__notes__", None)  # of its process
        raise error
    tries[run.number] += 1
    if tries[run.number] < TRIES:
        return None
    why = f"its worker died {TRIES} times: {error}. (R1028)"
    return Made(Row(run.number, FAILED, 0, [], why), {}, [])
