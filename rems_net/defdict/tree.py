"""What a user writes as a schema, brought into one tree of fields.

Groups may be dicts, schemas, or paths such as "wheel/left"; the order is kept. Names
are those that a key of the fabric can have.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from rems_net.defdict.field import Field
from rems_net.errors import SchemaError

_BARRED = r"\s/*$#?\x00-\x1f\ud800-\udfff"
_NAME = re.compile(rf"[^@{_BARRED}][^{_BARRED}]*")
MAX_DEPTH, MAX_NAME = 16, 64


def nest(name: str, entries: Any) -> dict[str, Any]:
    """Return nested dicts of fields from dicts, schemas and paths, in any mixture."""
    tree: dict[str, Any] = {}
    for chunks, field in _flatten(name, entries, ()):
        here = tree
        for chunk in chunks[:-1]:
            here = here.setdefault(chunk, {})
            if not isinstance(here, dict):
                raise SchemaError(f"{name}: {'/'.join(chunks)!r} lies inside a field.")
        if chunks[-1] in here:
            raise SchemaError(f"{name} defines {'/'.join(chunks)!r} twice.")
        here[chunks[-1]] = field
    return tree


def _flatten(
    name: str, entries: Any, before: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], Field]]:
    entries = getattr(entries, "entries", entries)  # a schema nests like its dict
    if not isinstance(entries, Mapping):
        raise SchemaError(
            f"{'/'.join((name, *before))} must be a field such as length('m'), or a "
            f"dict of fields; got {entries!r}."
        )
    if before and not entries:
        raise SchemaError(f"{'/'.join((name, *before))} is a group without fields.")
    if len(before) > MAX_DEPTH:
        raise SchemaError(f"{name} nests more than {MAX_DEPTH} deep.")
    for path, entry in entries.items():
        chunks = (*before, *_chunks(name, path))
        if isinstance(entry, Field):
            yield chunks, entry
        else:
            yield from _flatten(name, entry, chunks)


def _chunks(name: str, path: object) -> list[str]:
    if not isinstance(path, str):
        raise SchemaError(f"{name}: field names are text, not {path!r}.")
    chunks = path.split("/")
    for chunk in chunks:
        if not _NAME.fullmatch(chunk) or len(chunk.encode()) > MAX_NAME:
            raise SchemaError(
                f"{name}: {path!r} is not a field name. Names have letters, digits "
                f"and _, no spaces, none of * $ # ?, and do not begin with @."
            )
    return chunks
