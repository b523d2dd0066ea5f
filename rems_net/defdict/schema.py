"""A schema: a frozen, ordered set of fields, and the maker of DefDicts.

command = Schema("woodbot.command", {
    "wheel": {
        "left": angular_velocity("rad/s", range=(-8, 8)),
        "right": angular_velocity("rad/s", range=(-8, 8)),
    },
})
value = command({"wheel/left": 1.0})
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

from rems_net.defdict.field import Field
from rems_net.defdict.tree import MAX_DEPTH, nest
from rems_net.errors import SchemaError, UnknownFieldError, nearest

if TYPE_CHECKING:
    from rems_net.defdict.convert import Converter
    from rems_net.defdict.layout import Layout
    from rems_net.defdict.rule import Rule
    from rems_net.defdict.value import DefDict

__all__ = ["Schema"]

MAX_FIELDS = 4096


class Schema:
    """A frozen, ordered set of fields; nested dicts and schemas nest.

    Two schemas are equal when they have the same name and the same fields in the
    same order. They have the same `digest` when their values mean the same.
    """

    name: str
    entries: Mapping[str, Field | Schema]
    paths: tuple[str, ...]
    fields: tuple[Field, ...]

    def __init__(self, name: str, entries: Mapping[str, Any] | None = None) -> None:
        if not isinstance(name, str) or not name or len(name) > 128:
            raise SchemaError(
                f"a schema begins with its name, such as Schema('woodbot.command', "
                f"{{...}}); got {name!r}."
            )
        self._fill(name, _grow(name, nest(name, {} if entries is None else entries)))

    @classmethod
    def _group(cls, name: str, tree: dict[str, Any]) -> Schema:
        made = object.__new__(cls)
        made._fill(name, _grow(name, tree))
        return made

    def _fill(self, name: str, entries: Mapping[str, Field | Schema]) -> None:
        put = object.__setattr__
        put(self, "name", name)
        put(self, "entries", entries)
        leaves = tuple(_leaves(entries, ""))
        put(self, "paths", tuple(path for path, _ in leaves))
        put(self, "fields", tuple(field for _, field in leaves))
        if len(leaves) > MAX_FIELDS:
            raise SchemaError(f"{name} has more than {MAX_FIELDS} fields.")
        if any(path.count("/") >= MAX_DEPTH for path in self.paths):
            raise SchemaError(f"{name} nests more than {MAX_DEPTH} deep.")

    def __setattr__(self, name: str, value: object) -> None:
        raise SchemaError(
            f"{self.name} is frozen: build another schema (+, rename, prefix, slice)."
        )

    def __delattr__(self, name: str) -> None:
        raise SchemaError(f"{self.name} is frozen.")

    # -- looking in -----------------------------------------------------------

    def __getitem__(self, path: str) -> Field | Schema:
        """Return the field or the nested schema at a path."""
        found = self._find(path)
        if found is None:
            raise self.unknown(path)
        return found

    def __contains__(self, path: object) -> bool:
        return self._find(path) is not None

    def __iter__(self) -> Iterator[str]:
        return iter(self.entries)

    def __len__(self) -> int:
        return len(self.entries)

    def _find(self, path: object) -> Field | Schema | None:
        if not isinstance(path, str):
            return None
        here: Any = self
        for chunk in path.split("/"):
            here = here.entries.get(chunk) if isinstance(here, Schema) else None
        found: Field | Schema | None = here
        return found

    def unknown(self, path: object) -> UnknownFieldError:
        """Return the error for a path that is not there."""
        every = [*self.paths, *self.entries]
        hint = nearest(path, every)
        if not hint:
            some = ", ".join(map(repr, self.paths[:8]))
            more = ", ..." if len(self.paths) > 8 else ""
            hint = f" It has {some}{more}." if some else " It has no fields."
        return UnknownFieldError(f"{self.name} has no field {path!r}.{hint}")

    # -- identity -------------------------------------------------------------

    @cached_property
    def _key(self) -> tuple[object, ...]:
        from rems_net.defdict.describe import identity

        return identity(self)

    @cached_property
    def digest(self) -> str:
        """16 hexadecimal digits: the same wherever values mean the same."""
        from rems_net.defdict.describe import digest

        return digest(self)

    @cached_property
    def _hash(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        return isinstance(other, Schema) and self._key == other._key

    def __hash__(self) -> int:
        return self._hash

    def __repr__(self) -> str:
        return f"<Schema {self.name}@{self.digest}: {', '.join(self.paths)}>"

    def __str__(self) -> str:
        from rems_net.defdict.describe import table

        return table(self)

    def __reduce__(self) -> tuple[Callable[[bytes], Schema], tuple[bytes]]:
        return Schema.from_wire, (self.to_wire(),)

    # -- values ---------------------------------------------------------------

    @cached_property
    def layout(self) -> Layout:
        """What was compiled for this schema; shared by all that are equal."""
        from rems_net.defdict.layout import layout_of

        return layout_of(self)

    def __call__(self, values: Any = None, /, **fields: Any) -> DefDict:
        """Build a value: defaults, then what is given, each by its name or path."""
        layout = self.layout
        made = layout.new(layout.defaults())
        if values is not None:
            made.assign(values)
        if fields:
            made.assign(fields)
        return made

    def build(self, values: Any, where: str) -> DefDict:
        """Build a value for an item of a list field, which errors name as `where`."""
        from rems_net.defdict.value import DefDict

        if isinstance(values, DefDict) and values.schema == self:
            return values.copy()
        try:
            return self(values)
        except (UnknownFieldError, ValueError) as why:
            raise type(why)(f"{where}: {why}") from why

    def encode(self, value: Any) -> bytes:
        """Return the payload of a value: one msgpack map in schema order."""
        return self.layout.encode_value(value)

    def decode(self, payload: bytes) -> DefDict:
        """Return the value in a payload; raise WireError if it does not fit."""
        layout = self.layout
        return layout.new(layout.decode(payload))

    def to_wire(self) -> bytes:
        """Return the description that another process can build this schema from."""
        from rems_net.defdict.describe import to_wire

        return to_wire(self)

    @staticmethod
    def from_wire(payload: bytes) -> Schema:
        """Build a schema from its description; raise WireError on anything else."""
        from rems_net.defdict.describe import from_wire

        return from_wire(payload)

    # -- becoming another -----------------------------------------------------

    def converter(
        self,
        target: Schema,
        rules: Iterable[Rule] = (),
        *,
        missing: str = "error",
        surplus: str = "drop",
        source_label: str = "",
        target_label: str = "",
    ) -> Converter:
        """Compile the conversion of this schema's values into another's."""
        from rems_net.defdict.convert import converter

        return converter(
            self, target, tuple(rules), missing, surplus, source_label, target_label
        )

    def explain(self, target: Schema, rules: Iterable[Rule] = ()) -> str:
        """Return the table of how each field of the target would be filled."""
        return self.converter(target, rules).explain()

    # -- composition ----------------------------------------------------------

    def __add__(self, other: Schema) -> Schema:
        """Return a schema with the fields of both; a clash is refused."""
        if not isinstance(other, Schema):
            return NotImplemented
        return self.merge(other)

    def merge(self, *others: Schema, name: str = "") -> Schema:
        """Return a schema with the fields of all; a clash names both schemas."""
        from rems_net.defdict.compose import merge_schemas

        return merge_schemas(((one, one.name) for one in (self, *others)), name)

    def rename(
        self, new: Mapping[str, str] | None = None, /, *, name: str = ""
    ) -> Schema:
        """Return a schema with other field (or group) names, or another name."""
        from rems_net.defdict.compose import rename

        return rename(self, new or {}, name)

    def prefix(self, group: str, *, name: str = "") -> Schema:
        """Return a schema with all fields inside a group."""
        from rems_net.defdict.compose import prefix

        return prefix(self, group, name)

    def slice(self, *selections: str, name: str = "") -> Schema:
        """Return a schema of the fields that paths, groups or globs select."""
        from rems_net.defdict.compose import cut

        return cut(self, selections, name)


def _grow(name: str, tree: Mapping[str, Any]) -> dict[str, Field | Schema]:
    return {
        key: Schema._group(f"{name}/{key}", entry) if isinstance(entry, dict) else entry
        for key, entry in tree.items()
    }


def _leaves(
    entries: Mapping[str, Field | Schema], prefix: str
) -> Iterator[tuple[str, Field]]:
    for key, entry in entries.items():
        if isinstance(entry, Schema):
            yield from _leaves(entry.entries, f"{prefix}{key}/")
        else:
            yield prefix + key, entry
