"""Origins: what an experiment is made of, so that it can be done again and compared.

Its sources, data files and versions, without anything that depends on this machine.
"""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path, PurePath

from rems_net.agents.agent import Agent
from rems_net.agents.experiment.placement.needs import (
    code_of,
    file_of,
    source_digest,
    texts,
)
from rems_net.agents.protocol.plan import Plan
from rems_net.uncaught import is_users


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
        for value in texts(agent):
            with suppress(OSError, ValueError):  # no text that could be a name
                path = here / value
                if value and path.is_file():
                    name = PurePath(value)
                    shown = name.name if name.is_absolute() else name.as_posix()
                    found[shown] = source_digest(path.read_bytes())
    return dict(sorted(found.items()))


def _sources(plan: Plan) -> Iterator[Path]:
    """Yield the user's files in which the classes of an agent are, with their bases."""
    for base in (base for cls in plan.classes for base in cls.__mro__):
        if (file := file_of(base.__module__)) and is_users(str(file.resolve())):
            yield file.resolve()


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
