"""`rems show [PART]`: the parts of experiments, or the details of one."""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from rems_net.agents import parts, registry
from rems_net.agents.parts import Part
from rems_net.cli.options import console, plain_table, warn
from rems_net.cli.part import about, first_sentence, identity, kind_of, missing, show
from rems_net.errors import ExperimentError, RemsError, nearest
from rems_net.libraries import no_wheels

EXAMPLES = """\
examples:
  rems show
  rems show woodbot
  rems show my_file.py:Cart      a class of your own; my_file.py for all in it
  rems show --json

A package of its own brings parts by entry points: docs/parts.md.
"""


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("part", metavar="PART", nargs="?", help="such as woodbot")
    parser.add_argument("--json", action="store_true", help="for programs")


def run(args: argparse.Namespace) -> int:
    """List the parts, or show one."""
    for sentence in parts.brought()[1]:
        warn(sentence)
    name = args.part or ""
    if not name or (name.endswith(".py") and ":" not in name):
        rows = [summary(part) for part in (in_file(name) if name else every())]
        if args.json:
            print(json.dumps(rows, indent=2))
        else:
            show_list(console(args), rows)
        return 0
    found = [about(part) for part in named(name)]
    if args.json:
        print(json.dumps(found, indent=2))
    else:
        for i, one in enumerate(found):
            show(console(args), one, first=i == 0)
    return 0


def every() -> list[Part]:
    """Return all parts that have a name, kind by kind."""
    by_name = (parts.by_name(kind).values() for kind in parts.BASES)
    return [part for names in by_name for some in names for part in some]


def in_file(name: str) -> list[Part]:
    """Return the parts that a user's file defines."""
    module = registry.load_file(Path(name).resolve())
    classes = [v for v in vars(module).values() if isinstance(v, type)]
    own = [c for c in classes if c.__module__ == module.__name__ and kind_of(c)]
    if not own:
        raise ExperimentError(
            f"{name} defines no part: no class that inherits from "
            f"{', '.join(b.__name__ for b in parts.BASES.values())}. (R0425)"
        )
    return [_own(c, f"{name}:{c.__qualname__}", name) for c in own]


def named(name: str) -> list[Part]:
    """Return the parts of this name, of any kind. Raises ExperimentError for none."""
    if ":" in name:
        cls = registry.load(name, Path())
        if not kind_of(cls):
            raise ExperimentError(
                f"{cls.__name__} is no part; expected a subclass of "
                f"{', '.join(b.__name__ for b in parts.BASES.values())}. (R0426)"
            )
        return [_own(cls, name, name.rpartition(":")[0])]
    known = every()
    found = [part for part in known if part.name == name]
    if not found:
        names = sorted({part.name for part in known})
        raise ExperimentError(
            f"There is no part {name!r}; there is {', '.join(names)}, or your own as "
            f"'my_file.py:MyClass'.{nearest(name, names)} (R0425)"
        )
    return found


def _own(cls: type, reference: str, origin: str) -> Part:
    return Part(kind_of(cls), reference, reference, origin)


def summary(part: Part) -> dict[str, Any]:
    """Return the summary of one part as plain data."""
    plain = {**identity(part), "doc": "", "missing": [], "problem": ""}
    try:
        cls = part.load()
        plain |= {"doc": first_sentence(cls), "missing": missing(cls)}
    except RemsError as error:
        plain["problem"] = str(error)
    return plain


def show_list(out: Console, rows: Sequence[dict[str, Any]]) -> None:
    """Print the parts, grouped by kind."""
    table = plain_table("", "", "")
    table.show_header = False
    for kind in parts.BASES:
        some = [row for row in rows if row["kind"] == kind]
        names = [row["name"] for row in some]
        if some:
            table.add_row(f"{kind}s" if kind != "process" else "processes")
        for row in some:
            table.add_row(f"  {row['name']}", _line(row, names), row["origin"])
    out.print(table)


def _lacks(library: str) -> str:
    return no_wheels(library).rstrip(".") or f"{library}: not installed"


def _line(row: dict[str, Any], names: Sequence[str]) -> str:
    """Return the first sentence about a part, or why it cannot be loaded."""
    if row["problem"]:
        return f"broken: {row['problem']}"
    said = [row["doc"] or "(It has no docstring.)"]
    said += [f"({_lacks(library)})" for library in row["missing"]]
    if names.count(row["name"]) > 1:
        said.append(f"(The name is taken twice: write {row['class']!r}.)")
    return " ".join(said)
