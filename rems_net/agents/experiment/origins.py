"""Origins: what an experiment is made of, so that it can be done again and compared.

Its sources, data files and versions, without anything that depends on this machine.
"""

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from pathlib import Path, PurePath
from typing import Any

from rems_net.agents.agent import Agent
from rems_net.agents.experiment.checking import settings, surroundings
from rems_net.agents.experiment.lineup import Lineup
from rems_net.agents.experiment.placement.needs import (
    code_of,
    file_of,
    source_digest,
    texts,
)
from rems_net.agents.parts import reference
from rems_net.agents.protocol.plan import Plan, grouped
from rems_net.agents.robot import Robot
from rems_net.agents.tick import time_of
from rems_net.agents.verbs import CALLED
from rems_net.errors import ExperimentError
from rems_net.maths.numerics import describe as describe_numerics, environment
from rems_net.recordings.csv_file import heading
from rems_net.recordings.manifest import Manifest, Start


def digests(
    plans: Mapping[str, Plan], agents: Mapping[str, Agent], folder: Path
) -> dict[str, str]:
    """Return the SHA-256 of the user's sources and data files, by their names.

    A name is relative to the folder of the experiment; of a file elsewhere it is the
    name alone. Ends of lines do not count: Git changes them on Windows.
    """
    here, found = folder.resolve(), dict[str, str]()
    for path in sorted({p for plan in plans.values() for p in _sources(plan)}):
        if path.is_relative_to(here):
            found |= code_of(path, here)
        else:
            found[path.name] = source_digest(path.read_bytes())
    for agent in agents.values():
        found |= files(texts(agent), here)
    return dict(sorted(found.items()))


def files(values: Iterable[str], folder: Path) -> dict[str, str]:
    """Return the SHA-256 of the files that these texts name, by their names."""
    found: dict[str, str] = {}
    for value in values:
        with suppress(OSError, ValueError):  # no text that could be a name
            path = folder / value
            if value and path.is_file():
                name = PurePath(value)
                shown = name.name if name.is_absolute() else name.as_posix()
                found[shown] = source_digest(path.read_bytes())
    return found


def _sources(plan: Plan) -> Iterator[Path]:
    """Yield the user's files in which the classes of an agent are, with their bases."""
    for base in (base for cls in plan.classes for base in cls.__mro__):
        if file := file_of(base.__module__):
            yield _resolved(file)


@lru_cache(maxsize=1024)  # a sweep asks for every class at every run
def _resolved(file: Path) -> Path:
    return file.resolve()


def shown_class(where: str, folder: Path) -> str:
    """Return a class's module or file; a file relative to the experiment's folder."""
    if not where.endswith(".py"):
        return where
    path, here = Path(where).resolve(), folder.resolve()
    below = path.is_relative_to(here)
    return path.relative_to(here).as_posix() if below else path.name


def versions(agents: Iterable[Agent]) -> dict[str, str]:
    """Return the versions of rems_net, and of the libraries that the agents need."""
    from importlib.metadata import PackageNotFoundError, version  # takes 12 ms to load

    from rems_net import __version__

    found = {"rems_net": __version__}
    for library in sorted({library for agent in agents for library in agent.needs}):
        with suppress(PackageNotFoundError):
            found[library] = version(library)
    return found


def manifest(
    lab: Lineup, agents: Mapping[str, Agent], *, native: bool, pace: float = 0.0
) -> Manifest:
    """Return the description of a run before it begins, without its files.

    native: also if the lineup does not ask for it.  pace: of the run; 0 for none.
    """
    plans = [plan for _, plan in sorted(lab.plans.items())]
    return Manifest(
        lab.name,
        describe(lab.plans, agents, lab.dt),
        seed=lab.seed,
        numerics=numerics(agents.values(), native=native or lab.native),
        agents=grouped((p.kind, _table(p, agents[p.key], lab)) for p in plans),
        worlds=surroundings.worlds(agents),
        dt=lab.dt,
        pace=pace,
        ticks=lab.ticks(agents) if lab.ends(agents) else 0,
        sources=digests(lab.plans, agents, lab.folder),
        versions=versions(agents.values()),
        fields=orders(agents),
    )


def _table(plan: Plan, agent: Agent, lab: Lineup) -> dict[str, Any]:
    """Return a plan as it is kept with a run: the same on every laptop."""

    def named(cls: type) -> str:
        try:
            where, _, name = reference(cls).rpartition(":")
        except ExperimentError:  # in one process a class may be in no file
            where, name = cls.__module__, cls.__qualname__
        return f"{shown_class(where, lab.folder)}:{name}"

    made = plan.table(agent, lab.dt, named)
    leave = ("host", "machine", CALLED)  # it follows from the calling processes
    return {word: made[word] for word in made if word not in leave}


def describe(
    plans: Mapping[str, Plan], agents: Mapping[str, Agent], dt: float
) -> dict[str, Start]:
    """Return the places of the robots before their first step, by name."""
    robots, bodies = {}, surroundings.bodies(agents)
    for key, agent in sorted(agents.items()):
        # The place of a real robot is unknown before the run.
        if isinstance(agent, Robot) and agent.lockstep:
            state, places = agent.state, {}
            for path, field in state.schema.rows():
                if field.dtype == "float" and not field.shape:
                    places[heading(f"state/{path}", field.unit)] = float(state[path])
            start = time_of(plans[key].since - 1, dt)
            with settings.origin(f"robot {agent.name!r}"):
                robots[agent.name] = Start(
                    start,
                    places,
                    surroundings.radius(agent),
                    surroundings.outline_of(bodies.get(key)),
                    plans[key].world.partition("/")[2],
                    surroundings.rays_of(bodies.get(key)),
                )
    return robots


def numerics(agents: Iterable[Agent], *, native: bool) -> str:
    """Return the libraries that this machine's hosts and robots compute with."""
    line = describe_numerics(environment(os.environ, native=native))
    robots = (a for a in agents if isinstance(a, Robot))
    engines = [f"{lib} {v}" for lib, v in versions(robots).items()]
    return ", ".join([line, *engines[1:]])  # the first is rems_net


def orders(agents: Mapping[str, Agent]) -> dict[str, list[str]]:
    """Return the paths of published schemas in their own order, by digest.

    Schemas in alphabetical order are left out: a recording has that order.
    """
    found: dict[str, list[str]] = {}
    for _, agent in sorted(agents.items()):
        for schema in agent.published().values():
            if [*schema.paths] != sorted(schema.paths):
                found.setdefault(schema.digest, [*schema.paths])
    return found
