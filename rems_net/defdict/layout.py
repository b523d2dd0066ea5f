"""What is compiled once for all equal schemas: class, defaults, encoder, decoder.

The live values of a schema lie in one flat list, in schema order. A layout knows
the place of every path in that list; a nested group is a view with an offset.
"""

from __future__ import annotations

from functools import lru_cache, partial
from typing import Any

from rems_net.defdict.classes import value_class, view
from rems_net.defdict.codec import Codec
from rems_net.defdict.field import Field
from rems_net.defdict.schema import Schema
from rems_net.defdict.value import DefDict
from rems_net.errors import FieldValueError

Leaves = list[Any]


class Layout:
    """The compiled form of a schema."""

    def __init__(self, schema: Schema) -> None:
        self.schema = schema
        self.fields: tuple[Field, ...] = schema.fields
        self.index = {path: i for i, path in enumerate(schema.paths)}
        self.groups: dict[str, type[DefDict]] = {}
        self.value_class = value_class(self, schema, "", 0)
        self.codec = Codec(schema)
        self.encode = self.codec.encode
        self.decode = self.codec.decode
        self.has_lists = any(field.dtype == "list" for field in schema.fields)
        self._defaults = [field.default for field in schema.fields]
        self.new = partial(view, self.value_class)

    def defaults(self) -> Leaves:
        """Return fresh default leaves."""
        if self.has_lists:
            return self.copy(self._defaults)
        return self._defaults.copy()

    def copy(self, leaves: Leaves) -> Leaves:
        """Return leaves that share nothing that can change."""
        if not self.has_lists:
            return leaves.copy()
        return [
            tuple(item.copy() for item in leaf) if type(leaf) is tuple else leaf
            for leaf in leaves
        ]

    def group(self, path: str) -> type[DefDict]:
        """Return the class of the view on a nested group."""
        found = self.groups.get(path)
        if found is None:
            nested = self.schema[path]
            assert isinstance(nested, Schema)
            first = self.index[f"{path}/{nested.paths[0]}"]
            found = value_class(self, nested, f"{path}/", first)
            self.groups[path] = found
        return found

    def view(self, path: str, leaves: Leaves) -> DefDict:
        """Return the live view on a nested group of these leaves."""
        return view(self.group(path), leaves)

    def encode_value(self, value: Any) -> bytes:
        """Encode a value of this schema, or anything a value can be built from."""
        if isinstance(value, DefDict):
            if value.schema.digest != self.schema.digest:
                raise FieldValueError(
                    f"{self.schema.name} cannot encode a value of {value.schema.name} "
                    f"as it is. Convert it: value.to({self.schema.name.split('.')[-1]})"
                )
            if value.schema.paths == self.schema.paths:
                return self.encode(value.leaves())
            return self.encode(self.schema(value.flat()).leaves())
        return self.encode(self.schema(value).leaves())


@lru_cache(maxsize=2048)
def layout_of(schema: Schema) -> Layout:
    """Return the layout that all schemas equal to this one share."""
    return Layout(schema)
