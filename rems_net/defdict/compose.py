"""Schemas from schemas: add, rename, prefix, slice, merge. All return new ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from rems_net.defdict.field import Field
from rems_net.defdict.glob import matching
from rems_net.defdict.schema import Schema
from rems_net.errors import SchemaError

__all__ = ["merge_schemas"]


def fields_of(schema: Schema) -> dict[str, Field]:
    """Return path to field."""
    return dict(zip(schema.paths, schema.fields, strict=True))


def merge_schemas(parts: Iterable[tuple[Schema, str]], name: str = "") -> Schema:
    """Merge schemas, each given with its origin (the class or file that has it).

    A field that two of them define alike is kept once; one that they define
    differently, or a group that meets a field, raises SchemaError naming both.
    """
    merged: dict[str, Field] = {}
    origins: dict[str, str] = {}
    names = []
    for schema, origin in parts:
        names.append(schema.name)
        for path, field in fields_of(schema).items():
            _check_nesting(path, origin, merged, origins)
            if path in merged and not _alike(merged[path], field):
                raise SchemaError(
                    f"{path!r} is defined twice: {words(merged[path])} by "
                    f"{origins[path]}, and {words(field)} by {origin}. "
                    f"Rename one of them, or give one a prefix."
                )
            if path not in merged:
                merged[path], origins[path] = field, origin
    return Schema(name or "+".join(dict.fromkeys(names)), merged)


def _check_nesting(
    path: str, origin: str, merged: Mapping[str, Field], origins: Mapping[str, str]
) -> None:
    for other in merged:
        short, long = sorted((path, other), key=len)
        if long.startswith(f"{short}/"):
            whose, its = (origin, origins[other])
            group, field = (whose, its) if short == other else (its, whose)
            raise SchemaError(
                f"{short!r} is a field in {field}, but a group in {group} "
                f"({long!r}). Rename one of them."
            )


def _alike(a: Field, b: Field) -> bool:
    return Schema("a", {"x": a}).digest == Schema("b", {"x": b}).digest


def words(field: Field) -> str:
    """Return a field in a few words: type, unit, range."""
    text = f"{field.unit or field.describe_type()}"
    if field.range is not None:
        text += f" from {field.range[0]:.10g} to {field.range[1]:.10g}"
    if field.choices:
        text += f" of {', '.join(field.choices)}"
    if not field.shape and field.default:
        text += f" (default {field.default!r})"
    if field.max_age is not None:
        text += f" (max_age {field.max_age:g} s)"
    return text


def rename(schema: Schema, new: Mapping[str, str], name: str = "") -> Schema:
    """Rename fields or groups: {"wheel/left": "motor/1"}; the order stays."""
    for old in new:
        schema[old]
    made: dict[str, Field] = {}
    for path, field in fields_of(schema).items():
        moved = _moved(path, new)
        if moved in made:
            raise SchemaError(f"{schema.name}: two fields would be named {moved!r}.")
        made[moved] = field
    return Schema(name or schema.name, made)


def _moved(path: str, new: Mapping[str, str]) -> str:
    chunks = path.split("/")
    for end in range(len(chunks), 0, -1):
        head = "/".join(chunks[:end])
        if head in new:
            return "/".join([new[head], *chunks[end:]])
    return path


def prefix(schema: Schema, group: str, name: str = "") -> Schema:
    """Put all fields into a group: "arm" makes "joint/1" "arm/joint/1"."""
    made = {f"{group}/{path}": field for path, field in fields_of(schema).items()}
    return Schema(name or schema.name, made)


def cut(schema: Schema, selections: tuple[str, ...], name: str = "") -> Schema:
    """Keep the fields that any of the paths, groups or globs selects."""
    keep: set[str] = set()
    for selection in selections:
        found: Any = matching(selection, schema.paths)
        if not found and "*" not in selection:
            found = matching(f"{selection}/**", schema.paths)
        if not found:
            raise schema.unknown(selection)
        keep.update(found)
    made = {path: field for path, field in fields_of(schema).items() if path in keep}
    return Schema(name or schema.name, made)
