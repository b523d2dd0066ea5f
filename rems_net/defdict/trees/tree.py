"""Tree: a frozen, ordered set of fields in groups; the basis of a schema.

Groups may be written as dicts, trees, or paths such as "wheel/left"; the order is kept.
A tree has its paths, its description for the wire, and its equality.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, Self

from rems_net.arguments import taught
from rems_net.defdict.fields.descriptions import is_quantity
from rems_net.defdict.fields.field import Field
from rems_net.defdict.fields.makers import Maker
from rems_net.defdict.trees.paths import MAX_DEPTH, chunks_of
from rems_net.errors import SchemaError, UnknownFieldError, nearest
from rems_net.packing import list_header, map_header, pack

MAX_FIELDS, MAX_TITLE = 4096, 128
FORMAT = 1


class Tree:
    """A frozen, ordered set of fields; nested dicts and trees nest.

    Two trees are equal when they have the same name and the same fields in the
    same order. They have the same `digest` when their values mean the same.
    """

    name: str
    entries: Mapping[str, Field | Self]
    paths: tuple[str, ...]
    fields: tuple[Field, ...]

    @taught(SchemaError)
    def __init__(self, name: str, entries: Mapping[str, Any] | None = None) -> None:
        if not isinstance(name, str) or not name or len(name) > MAX_TITLE:
            raise SchemaError(
                f"a schema begins with its name, such as Schema('woodbot.command', "
                f"{{...}}); got {name!r}. (R0113)"
            )
        if not name.isprintable():
            raise SchemaError(
                f"the name of a schema is printable, not {name!r}. (R0113)"
            )
        tree: dict[str, Any] = {}
        _nest(name, {} if entries is None else entries, (), tree)
        self._fill(name, tree)

    def _fill(self, name: str, tree: dict[str, Any]) -> None:
        """Take over nested dicts of fields; each inner dict becomes a tree."""
        paths: list[str] = []
        fields: list[Field] = []
        for key, entry in tree.items():
            if isinstance(entry, Field):
                paths.append(key)
                fields.append(entry)
            else:
                group = tree[key] = object.__new__(type(self))
                group._fill(f"{name}/{key}", entry)
                paths += [f"{key}/{path}" for path in group.paths]
                fields += group.fields
        if len(paths) > MAX_FIELDS:
            raise SchemaError(
                f"{name} has more than {MAX_FIELDS} fields. Put numbers of one kind "
                "into an array(). (R0115)"
            )
        put = self.__dict__
        put["name"], put["entries"] = name, tree
        put["paths"], put["fields"] = tuple(paths), tuple(fields)

    def __setattr__(self, name: str, value: object) -> None:
        raise SchemaError(
            f"{self.name} is frozen: build another schema (+, rename, prefix, "
            "slice). (R0106)"
        )

    def __delattr__(self, name: str) -> None:
        raise SchemaError(f"{self.name} is frozen: build another schema. (R0106)")

    def __getitem__(self, path: str) -> Field | Self:
        """Return the field or the nested schema at a path."""
        found = self.find(path)
        if found is None:
            raise self.unknown(path)
        return found

    def __contains__(self, path: object) -> bool:
        return self.find(path) is not None

    def __iter__(self) -> Iterator[str]:
        return iter(self.entries)

    def __len__(self) -> int:
        return len(self.entries)

    def rows(self) -> Iterator[tuple[str, Field]]:
        """Yield the path and the field of every leaf, in order."""
        return zip(self.paths, self.fields, strict=True)

    def find(self, path: object) -> Field | Self | None:
        if not isinstance(path, str):
            return None
        here: Any = self
        for chunk in path.split("/"):
            here = here.entries.get(chunk) if isinstance(here, Tree) else None
        found: Field | Self | None = here
        return found

    def unknown(self, path: object) -> UnknownFieldError:
        """Return the error for an unknown path."""
        every = [*self.paths, *self.entries]
        hint = nearest(path, every)
        if not hint:
            some = ", ".join(map(repr, self.paths[:8]))
            more = ", ..." if len(self.paths) > 8 else ""
            hint = f" It has {some}{more}." if some else " It has no fields."
            if not some and self.name.endswith((".options", ".parameters")):
                slot = self.name.rpartition(".")[2]
                hint += f" Your class states them: {slot} = Settings({path}=number())."
        return UnknownFieldError(f"{self.name} has no field {path!r}.{hint} (R0104)")

    @cached_property
    def _key(self) -> tuple[object, ...]:
        functions = tuple(one.functions for one in self.fields if one.functions)
        return (
            self.name,
            self.paths,
            *(one.described for one in self.fields),
            functions,
        )

    @cached_property
    def _hash(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        return isinstance(other, Tree) and self._key == other._key

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def description(self) -> bytes:
        """The description for the wire: `{"rems": 1, "name": ..., "fields": [...]}`.

        Each field is `[path, dtype, {only the properties that are not the default}]`.
        """
        rows = zip(self.paths, (one.described for one in self.fields), strict=True)
        head = map_header(3) + pack("rems") + pack(FORMAT) + pack("name")
        return head + pack(self.name) + pack("fields") + _rows(list(rows))

    @cached_property
    def meaning(self) -> bytes:
        """The meaning of the values: fields sorted by path, without names and docs."""
        rows = zip(self.paths, (one.meaning for one in self.fields), strict=True)
        return _rows(sorted(rows))

    @cached_property
    def digest(self) -> str:
        """16 hexadecimal digits: equal for all trees with the same meaning."""
        import hashlib  # OpenSSL takes 5 ms to load

        found = list_header(2) + pack(FORMAT) + self.meaning
        return hashlib.sha256(found).hexdigest()[:16]

    def __str__(self) -> str:
        """Return a table for people: each field with type, unit, range, default."""
        rows = [("field", "type", "unit", "range", "default", "")]
        for path, field in self.rows():
            limits = f"{field.range[0]:g} to {field.range[1]:g}" if field.range else ""
            plain = field.shape or field.dtype == "list"
            default = "" if plain else f"{field.default!r}"
            doc = field.doc if field.doc.isprintable() else repr(field.doc)[1:-1]
            row = (path, field.describe_type(), field.unit, limits, default, doc)
            rows.append(row)
        return f"{self.name}@{self.digest}\n{columns(rows)}"

    def __repr__(self) -> str:
        return f"<Schema {self.name}@{self.digest}: {', '.join(self.paths)}>"


def columns(rows: Sequence[tuple[str, ...]]) -> str:
    """Return rows as aligned columns."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return "\n".join(
        "  " + "  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )


def _rows(rows: list[tuple[str, bytes]]) -> bytes:
    head = list_header(3)
    packed = b"".join(head + pack(path) + form for path, form in rows)
    return list_header(len(rows)) + packed


def _nest(
    name: str, entries: Any, before: tuple[str, ...], tree: dict[str, Any]
) -> None:
    """Put a user's entries, in any mixture, into nested dicts of fields."""
    if isinstance(entries, Tree):
        entries = entries.entries
    if not isinstance(entries, Mapping):
        raise _no_field("/".join((name, *before)), entries)
    if before and not entries:
        raise SchemaError(
            f"{'/'.join((name, *before))} is a group without fields. Give it one, or "
            "leave it out. (R0115)"
        )
    for path, entry in entries.items():
        if not isinstance(path, str):
            raise SchemaError(f"{name}: field names are text, not {path!r}. (R0113)")
        chunks = chunks_of(path)
        if not chunks:
            raise SchemaError(
                f"{name}: {path!r} is not a field name. Names have letters, digits "
                f"and _, no spaces, none of * $ # ?, and do not begin with @. (R0113)"
            )
        if before:
            chunks = (*before, *chunks)
        if len(chunks) > MAX_DEPTH:
            raise SchemaError(
                f"{name} nests more than {MAX_DEPTH} groups deep. Join two of the "
                "groups. (R0115)"
            )
        if isinstance(entry, Field):
            _put(name, chunks, entry, tree)
        else:
            _nest(name, entry, chunks, tree)


def _put(
    name: str, chunks: tuple[str, ...], field: Field, tree: dict[str, Any]
) -> None:
    for chunk in chunks[:-1]:
        tree = tree.setdefault(chunk, {})
        if not isinstance(tree, dict):
            raise SchemaError(
                f"{name}: {'/'.join(chunks)!r} lies inside a field. Rename one of "
                "them. (R0114)"
            )
    if chunks[-1] in tree:
        raise SchemaError(
            f"{name} defines {'/'.join(chunks)!r} twice. Rename one of them. (R0114)"
        )
    tree[chunks[-1]] = field


def _no_field(place: str, got: object) -> SchemaError:
    hint = ""
    if isinstance(got, Maker):
        hint = f" Call it: {got.__name__}(...)."
    elif is_quantity(got):
        hint = (
            " That is a unit, to calculate with; what makes a field is in "
            "rems_net.units, too: from rems_net.units import percent, length."
        )
    return SchemaError(
        f"{place} must be a field such as length('m'), or a dict of fields; "
        f"got {got!r}.{hint} (R0112)"
    )
