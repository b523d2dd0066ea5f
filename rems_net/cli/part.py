"""Details of one part: ports, settings, verbs, source file, and how to use it."""

import inspect
import re
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from itertools import islice
from math import prod
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from rems_net.agents import parts
from rems_net.agents.agent import Agent
from rems_net.agents.experiment.checking.settings import origin
from rems_net.agents.parts import Part
from rems_net.agents.ports import In, Port, Settings
from rems_net.agents.verbs import verb_names
from rems_net.cli.options import MANY, plain_table, sum_up
from rems_net.defdict import Field, Schema
from rems_net.errors import shown
from rems_net.libraries import no_wheels

#: settings by kind of part: a definition has parameters of its own, a driver options
SETTINGS = {"definition": ("parameters",), "driver": ("options",)}


def kind_of(cls: type) -> str:
    """Return the kind of part that a class is, or ""."""
    kinds = (kind for kind, base in parts.BASES.items() if issubclass(cls, base))
    return next(kinds, "")


def first_sentence(cls: type) -> str:
    """Return the first sentence of the class's own docstring, in one line."""
    paragraph = (vars(cls).get("__doc__") or "").strip().partition("\n\n")[0]
    line = " ".join(paragraph.split())
    return re.split(r"(?<=[.!?])\s", line, maxsplit=1)[0]


def missing(cls: type[Agent]) -> list[str]:
    """Return the optional libraries that the class needs and that are not installed."""
    return [library for library in cls.needs if find_spec(library) is None]


def identity(part: Part) -> dict[str, Any]:
    """Return a part's name, class and origin."""
    return {
        "kind": part.kind,
        "name": part.name,
        "class": part.reference,
        "origin": "built-in" if part.origin == parts.OURS else part.origin,
    }


def about(part: Part) -> dict[str, Any]:
    """Return all there is to know of a part, as plain data. Raises ExperimentError."""
    cls = part.load()
    with origin(f"{part.kind} {part.name!r}"):
        slots = SETTINGS.get(part.kind, ("options",))
        settings = {slot: _fields(getattr(cls, slot).schema) for slot in slots}
        ports = {name: _port(cls, port) for name, port in cls.ports().items()}
        if part.kind in SETTINGS:  # the other half of a robot declares the fields
            ports = {name: port for name, port in ports.items() if port["fields"]}
    return {
        **identity(part),
        "file": inspect.getsourcefile(cls) or "",
        "doc": inspect.cleandoc(vars(cls).get("__doc__") or ""),
        "missing": missing(cls),
        "ports": ports,
        **settings,
        "verbs": {name: _verb(cls, name) for name in verb_names(cls)},
        "use": dict(_use(part, cls)),
    }


def _port(cls: type[Agent], port: Port) -> dict[str, Any]:
    """Return a port's direction and its fields, for the default settings."""
    given: Settings = getattr(cls, "parameters", cls.options)
    schema = port.schema_for(given.schema())
    plain: dict[str, Any] = {"direction": "in" if isinstance(port, In) else "out"}
    if isinstance(port, In) and port.source:
        plain["source"] = port.source
    return {**plain, "fields": _fields(schema) if schema else {}}


def _fields(schema: Schema) -> dict[str, dict[str, Any]]:
    defaults = schema().describe()
    pairs = zip(schema.paths, schema.fields, strict=True)
    return {path: _field(field, defaults[path]["value"]) for path, field in pairs}


def _field(field: Field, default: object) -> dict[str, Any]:
    plain: dict[str, Any] = {"type": field.describe_type(), "unit": field.unit}
    if field.range:
        plain["range"] = list(field.range)
    if field.choices:
        plain["choices"] = list(field.choices)
    brief = sum_up(default) if prod(field.shape) > MANY else default
    return {**plain, "default": brief, "doc": field.doc}


def _verb(cls: type[Agent], name: str) -> tuple[str, str]:
    """Return a verb's call and the first paragraph of its docstring."""
    method = getattr(cls, name)
    signature = inspect.signature(method)
    # Only that of a class is short: `float`, not `int | None`, nor source.
    words = [
        word if type(word.annotation) is type else word.replace(annotation=word.empty)
        for word in list(signature.parameters.values())[1:]
    ]
    call = signature.replace(parameters=words, return_annotation=signature.empty)
    doc = (inspect.getdoc(method) or "").partition("\n\n")[0]
    return f"{name}{call}", " ".join(doc.split())


def _use(part: Part, cls: type[Agent]) -> Iterator[tuple[str, str]]:
    """Yield how to use it, in a file and in Python."""
    head, more, options = part.kind, dict[str, str](), _to_be_said(cls)
    if part.kind in SETTINGS:
        own = part.kind == "driver" and part.name in parts.by_name("definition")
        # a device's driver is used with its robot
        robot = part.name if own else "woodbot"
        words = {"definition": robot, "driver": "kinematic", part.kind: part.name}
        head, table = "robot", {"name": "my_robot", **words}
    elif part.kind == "world":
        table, options = {"name": "arena"}, {"radius": "1 m"}
    else:
        table = {"name": f"my_{part.kind}", "type": part.name}
        free = [port for port, one in cls.ins().items() if not one.source]
        more = dict.fromkeys(free, "robot/my_robot/state")
    call = [f'"{word}"' for word in table.values()]
    call += [f'{word}="{value}"' for word, value in more.items()]
    each = {**table, **more}.items()
    lines = [f"[[{head}]]", *(f'{key} = "{value}"' for key, value in each)]
    if options:
        toml = ", ".join(f'{word} = "{value}"' for word, value in options.items())
        python = ", ".join(f'"{word}": "{value}"' for word, value in options.items())
        lines.append(f"options = {{ {toml} }}")
        call.append(f"options={{{python}}}")
    yield "toml", "\n".join(lines)
    yield "python", f"lab.{head}({', '.join(call)})"


def _to_be_said(cls: type[Agent]) -> dict[str, str]:
    """Return the first option without a usable default, an empty string, as "..."."""
    rows = cls.options.schema.rows()
    empty = (path for path, f in rows if f.dtype == "str" and not f.default)
    return dict.fromkeys(islice(empty, 1), "...")


def show(out: Console, one: Mapping[str, Any], *, first: bool = True) -> None:
    """Print a part for people."""
    if not first:
        out.print()
    out.print(f"{one['name']}: {one['kind']}, {one['origin']}", style="bold")
    for library in one["missing"]:
        lacks = f"It needs the library {library}, which is not installed."
        out.print(no_wheels(library) or lacks)
    for paragraph in (one["doc"] or "It has no docstring.").split("\n\n"):
        # Only an indented paragraph keeps its line breaks.
        indented = "\n " in f"\n{paragraph}"
        out.print(f"\n{paragraph if indented else ' '.join(paragraph.split())}")
    for name, port in one["ports"].items():
        out.print()
        if port["fields"]:
            out.print(_table(f"{port['direction']} {name}", port["fields"]))
        else:
            takes = f"takes {port.get('source', 'what it is connected to')} as it is"
            follows = "what it has follows from the options"
            said = takes if port["direction"] == "in" else follows
            out.print(f"{port['direction']} {name}: {said}")
    for slot in ("parameters", "options"):
        if one.get(slot):
            out.print()
            out.print(_table(slot, one[slot]))
    if one["verbs"]:
        out.print()
        table = plain_table("verbs", "")
        table.columns[0].no_wrap = True
        for call, doc in one["verbs"].values():
            table.add_row(f"  {call}", doc)
        out.print(table)
    if one["file"]:
        out.print(f"\nsource  {shown(Path(one['file']))}", soft_wrap=True)
    out.print("\nIn an experiment file, or in Python:\n")
    out.print(one["use"]["toml"], soft_wrap=True)
    out.print(f"\n{one['use']['python']}", soft_wrap=True)


def _table(title: str, fields: Mapping[str, Mapping[str, Any]]) -> Table:
    table = plain_table(title, "unit", "range", "default", "")
    table.columns[0].no_wrap = True
    for path, field in fields.items():
        unit = field["unit"] or ("" if field["type"] == "float" else field["type"])
        limits = ", ".join(field.get("choices", ()))
        if "range" in field:
            limits = "{:g} to {:g}".format(*field["range"])
        default = field["default"]
        said = f"{default:g}" if isinstance(default, float) else str(default)
        table.add_row(f"  {path}", unit, limits, said, field["doc"])
    return table
