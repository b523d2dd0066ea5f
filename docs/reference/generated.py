"""Write the reference of a front door: each public name, its docstring, an example.

The examples are in `rems_net.txt`, `units.txt`, ... beside this file. Each one is a
cell that begins with `# %%` and the names that it shows, and runs alone.
"""

import importlib
import re
import textwrap
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import UnionType
from typing import get_args

from rems_net import Definition
from rems_net.doors import DOORS

ROOT = Path(__file__).parents[2]
#: in a docstring: the beginning of a line that explains one argument
ARGUMENT = re.compile(r"[a-z]\w*(?:, \w+)*(?:\(.*\))?: ")


def package(door: str) -> str:
    """Return the front door of a page, such as `rems_net.units` for `units`."""
    return "rems_net" if door == "rems_net" else f"rems_net.{door}"


def page(door: str) -> str:
    """Return the directives for all names of a front door, as reStructuredText."""
    module = importlib.import_module(package(door))
    made, units = [], []
    for name in module.__all__:
        value = getattr(module, name)
        full = f"{package(door)}.{name}"
        if isinstance(value, UnionType):
            # A union has the docstring of Python's own class.
            some = ", ".join(f"`{one.__name__}`" for one in get_args(value))
            made.append(f".. py:data:: {full}\n\n   One of: {some}.\n{shown(full)}")
        elif isinstance(value, type):
            kind = "exception" if issubclass(value, Exception) else "class"
            # Of a robot, its methods are for drivers.
            members = not issubclass(value, Definition) or value is Definition
            made.append(f".. auto{kind}:: {full}\n{'   :members:' * members}\n")
        elif callable(value):
            made.append(f".. autofunction:: {full}\n")
        else:
            units.append(name)
    return "\n".join([*made, *_units(units)])


def _units(names: list[str]) -> Iterator[str]:
    """Yield a table of units: what each one measures, and its size in SI units."""
    if names:
        import unyt

        yield "Units\n-----\n\nFor other units write their names in unyt."
        yield shown("rems_net.units.m", indent="")
        yield ".. list-table::\n   :header-rows: 1\n\n   * - unit\n     - is\n"
        for name in names:
            unit = getattr(unyt, name)
            one = unyt.unyt_quantity(1, getattr(unit, "units", unit))
            base = one.in_mks()
            size = f"{float(base.value):g} {base.units}"
            yield f"   * - `{name}`\n     - {size.replace('*', ' ')}"


@cache
def cells(door: str) -> dict[str, str]:
    """Return the examples of a front door: the names that each shows, and its code."""
    text = Path(__file__).with_name(f"{door}.txt").read_text(encoding="utf-8")
    pairs = re.findall(
        r"^# %% ([^\n]*)\n(.*?)(?=^# %%|\Z)", text, re.DOTALL | re.MULTILINE
    )
    return {names: code.strip() for names, code in pairs}


@cache
def blocks() -> list[tuple[str, str]]:
    """Return the Python of pages and examples, each with a link to its place."""
    found = []
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        name = path.relative_to(ROOT).with_suffix("").as_posix()
        link = (
            ":doc:`the first page </README>`" if name == "README" else f":doc:`/{name}`"
        )
        text = path.read_text(encoding="utf-8")
        for code in re.findall(r"^```py(?:thon)?\n(.*?)^```$", text, re.S | re.M):
            found.append((link, code))
        for file in re.findall(r"\]\(((?:programs|rover)/[\w./]+\.py)\)", text):
            found.append((link, (path.parent / file).read_text(encoding="utf-8")))
    for path in sorted((ROOT / "examples").glob("*.py")):
        found.append((f"``examples/{path.name}``", path.read_text(encoding="utf-8")))
    return found


def uses(full: str) -> list[str]:
    """Return links to the pages and examples that import a public name."""
    door, _, name = full.rpartition(".")
    wanted = re.compile(
        rf"^from {re.escape(door)} import (?:\([^)]*|.*)\b{name}\b", re.MULTILINE
    )
    return list(dict.fromkeys(link for link, code in blocks() if wanted.search(code)))


def shown(full: str, indent: str = "   ") -> str:
    """Return the example of a public name, and the pages that use it."""
    door, _, name = full.rpartition(".")
    lines = []
    for names, code in cells(door.rpartition(".")[2]).items():
        first, *others = names.split(", ")
        if name in others:
            lines += ["", f":py:obj:`An example <{door}.{first}>`", ""]
            break
        if name == first:
            lines += ["", ".. code-block:: python", ""]
            lines += [f"   {line}" for line in code.splitlines()]
            break
    if used := uses(full):
        lines += ["", f"Used in {', '.join(used[:4])}.", ""]
    return "\n".join(f"{indent}{line}".rstrip() for line in [*lines, ""])


def document(app, what, name, obj, options, lines) -> None:  # type: ignore[no-untyped-def]
    """Make reStructuredText of a docstring, in place, and add its example."""
    made = []
    for paragraph in "\n".join(lines).split("\n\n"):
        rows = paragraph.split("\n")
        if all(row.startswith("    ") for row in rows if row):
            made += ["", "::", "", *rows, ""]
        elif any(row.startswith("    ") or ARGUMENT.match(row) for row in rows):
            first = [i for i, row in enumerate(rows) if ARGUMENT.match(row)][:1] or [0]
            made += map(plain, rows[: first[0]])
            made += [""] * bool(first[0])
            for row in rows[first[0] :]:
                mark = "  " if row.startswith(" ") else "| "
                made.append(f"{mark}{plain(row.strip())}")
            made.append("")
        else:
            made += [*map(plain, rows), ""]
    if name.rpartition(".")[0] in DOORS:
        made += textwrap.dedent(shown(name)).splitlines()
    lines[:] = made


def plain(row: str) -> str:
    """Return a line of text in which only its `code` is marked."""
    parts = re.split(r"`+([^`]+)`+", row)
    parts[::2] = [re.sub(r"([\\*|_])", r"\\\1", text) for text in parts[::2]]
    parts[1::2] = [f"``{code}``" for code in parts[1::2]]
    return "".join(parts)
