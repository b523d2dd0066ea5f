"""Sources: the user's own classes that an offer names, found and checked here.

Code never travels. A file of this machine is used if it is below the user's folder, has
the same digest as on the run's machine, and defines, by its text, an agent of rems_net.
It is read for that, not imported: an import would run it.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

from rems_net.agents import parts
from rems_net.agents.experiment.placement.needs import source_digest
from rems_net.agents.protocol.placement import Offer, reference
from rems_net.agents.protocol.plan import ROBOT, class_names, each
from rems_net.errors import ExperimentError
from rems_net.system.reading import DESCRIPTION, read_file

#: Number of files and classes that one class may inherit through.
DEPTH = 20


def check_code(offer: Offer, here: Path) -> None:
    """Raise ExperimentError naming each source that is missing here, or differs."""
    sources: dict[str, bytes] = {}
    wrong = []
    for name, digest in sorted(offer.code.items()):
        path = own_file(here, name)
        if path is None:
            wrong.append(f"{name} is not here")
            continue
        sources[name] = read_file(path, DESCRIPTION)
        if source_digest(sources[name]) != digest:
            wrong.append(f"{name} differs here and on {offer.laptop}")
    if wrong:
        raise ExperimentError(
            f"{', '.join(wrong)} (here is {here}). Code never travels: copy it from "
            f"{offer.laptop}, which runs {offer.name}. (R0440)"
        )
    for one in sorted({c for plan in each(offer.agents) for c in class_names(*plan)}):
        where, name = reference(one)
        if where.endswith(".py") and not _is_agent(sources, where, name, DEPTH):
            raise ExperimentError(
                f"{where} has no class {name} that can be seen to be a part of an "
                "experiment, so it is not run; expected, in that file, such as: "
                f"class {name}(Process), with a base that is imported from rems_net."
                " (R0440)"
            )


def own_file(here: Path, name: str) -> Path | None:
    """Return a file below `here`, if it is there, and no link leads out."""
    path = (here / name).resolve()
    return path if path.is_relative_to(here.resolve()) and path.is_file() else None


def check_parts(offer: Offer) -> None:
    """Raise ExperimentError for a class that is not an installed part."""
    wanted = {}
    for kind, plan in each(offer.agents):
        kinds = ROBOT if kind == "robot" else (kind,)
        for pair in zip(kinds, class_names(kind, plan), strict=True):
            wanted[pair] = f"{kind}/{plan['name']}"
    for (kind, one), agent in wanted.items():
        known = {p.reference for found in parts.by_name(kind).values() for p in found}
        if one not in known and not reference(one)[0].endswith(".py"):
            raise ExperimentError(
                f"{agent} is made of {one!r}, which is no {kind} of rems_net, nor of a "
                "package that is installed here (`rems show`). (R0440)"
            )


def find_class(here: Path, one: str) -> str:
    """Return a class for a process of this machine, with the file's full path."""
    where, name = reference(one)
    if where.endswith(".py"):
        return f"{own_file(here, where)}:{name}"
    return one


def _is_agent(sources: dict[str, bytes], file: str, name: str, depth: int) -> bool:
    """Return whether a class of a file inherits from one of rems_net or of a part."""
    if not depth:
        return False
    try:
        body: list[ast.stmt] = ast.parse(sources[file]).body
    except (KeyError, SyntaxError, ValueError, RecursionError, MemoryError):
        return False
    imported = dict(_imports(body))
    bases: list[ast.expr] = []
    for chunk in name.split("."):
        classes = (node for node in body if isinstance(node, ast.ClassDef))
        found = next((one for one in classes if one.name == chunk), None)
        if found is None:  # it is imported there, from another file of the user's
            return _comes_from(sources, file, imported, name, depth)
        body, bases = found.body, found.bases
    words = map(ast.unparse, bases)
    return any(_is_agent(sources, file, w, depth - 1) for w in words if w != name)


def _comes_from(
    sources: dict[str, bytes],
    file: str,
    imported: dict[str, str],
    word: str,
    depth: int,
) -> bool:
    """Return whether an imported name, `Process` or `rems_net.Process`, is an agent."""
    first, _, rest = word.partition(".")
    if first not in imported:
        return False
    module, _, inside = f"{imported[first]}.{rest}".rstrip(".").rpartition(".")
    top = module.partition(".")[0] or inside
    # A class may also inherit from the packages of installed parts.
    packages = {part.reference.partition(".")[0] for part in parts.brought()[0]}
    if top == "rems_net" or top in packages:
        return True
    path = (Path(file).parent / f"{module.replace('.', '/')}.py").as_posix()
    return _is_agent(sources, path, inside, depth - 1)


def _imports(body: list[ast.stmt]) -> Iterator[tuple[str, str]]:
    """Yield each imported name, and its full name: `Process`, `rems_net.Process`."""
    for node in body:
        if isinstance(node, ast.Import):
            for alias in node.names:
                first = alias.name.partition(".")[0]
                yield alias.asname or first, alias.name if alias.asname else first
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for alias in node.names:
                yield alias.asname or alias.name, f"{node.module}.{alias.name}"
