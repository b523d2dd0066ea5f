"""A schema: a frozen, ordered set of fields, and the maker of DefDicts and rules.

command = Schema("woodbot.command", {
    "wheel": {
        "left": angular_velocity("rad/s", range=(-8, 8)),
        "right": angular_velocity("rad/s", range=(-8, 8)),
    },
})
value = command({"wheel/left": 1.0})
"""

from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from types import MethodType
from typing import Any

from rems_net.defdict.conversion.convert import Converter, converter
from rems_net.defdict.conversion.rule import Rule
from rems_net.defdict.fields.descriptions import definition
from rems_net.defdict.fields.field import Field
from rems_net.defdict.trees import describe
from rems_net.defdict.trees.paths import matching
from rems_net.defdict.trees.tree import Tree
from rems_net.defdict.values.classes import decode, own_leaves, value_class
from rems_net.defdict.values.value import DefDict
from rems_net.errors import FieldValueError, SchemaError, UnknownFieldError


class Schema(Tree):
    """A tree of fields that makes DefDicts, reads them, and converts them."""

    def __reduce__(self) -> "tuple[Callable[[bytes], Schema], tuple[bytes]]":
        return Schema.from_wire, (self.to_wire(),)

    @cached_property
    def _kind(self) -> type[DefDict]:
        return value_class(self)

    def __call__(self, values: Any = None, /, **fields: Any) -> DefDict:
        """Build a value: defaults, then the given fields, each by its name or path."""
        kind = self._kind
        made: DefDict = kind._around(kind._blank())
        if values is not None:
            made._assign(values)
        if fields:
            made._assign(fields)
        return made

    def around(self, leaves: list[Any]) -> DefDict:
        """Return a value that keeps this list of leaves. Nothing is checked.

        For code that has checked leaves: in schema order, as from `value.leaves()`.
        """
        made: DefDict = self._kind._around(leaves)
        return made

    def _build(self, values: Any, where: str) -> DefDict:
        """Build an item of a list, or a result of a rule; `where` begins its errors."""
        if isinstance(values, DefDict) and values.schema == self:
            return values.copy()
        try:
            return self(values)
        except (UnknownFieldError, ValueError) as why:
            raise type(why)(f"{where}: {why}") from why

    def encode(self, value: Any) -> bytes:
        """Return the payload of a value: one msgpack map in schema order."""
        if not isinstance(value, DefDict):
            return self(value).encode()
        leaves = own_leaves(self, value)
        if leaves is None:
            raise FieldValueError(
                f"{self.name} cannot encode a value of {value.schema.name} "
                f"as it is. Convert it: value.to({self.name.split('.')[-1]}) (R0120)"
            )
        return self.around(leaves).encode()

    @cached_property
    def decode(self) -> Callable[[bytes], DefDict]:
        """Return the value in a payload; raise WireError if it does not fit."""
        return MethodType(decode(self), self)

    def to_wire(self) -> bytes:
        """Return the description from which another process can build this schema."""
        for path, field in self.rows():
            if field.functions is not None:
                raise SchemaError(
                    f"{self.name}: {path!r} is read through Python functions, which "
                    "cannot be sent. Give count() a table=, or convert before "
                    "sending. (R0121)"
                )
        return self.description

    @staticmethod
    def from_wire(payload: bytes) -> "Schema":
        """Build a schema from its description; raise WireError on anything else."""
        return describe.from_wire(payload, Schema)

    def converter(
        self,
        target: "Schema",
        rules: Iterable[Rule] = (),
        *,
        missing: str = "error",
        surplus: str = "drop",
        source_label: str = "",
        target_label: str = "",
    ) -> Converter:
        """Compile the conversion of this schema's values into another's."""
        return converter(
            self, target, tuple(rules), missing, surplus, source_label, target_label
        )

    def explain(self, target: "Schema", rules: Iterable[Rule] = ()) -> str:
        """Return a table of where each field of the target would come from."""
        return self.converter(target, rules).explain()

    def __add__(self, other: "Schema") -> "Schema":
        """Return a schema with the fields of both; a clash is refused."""
        if not isinstance(other, Schema):
            return NotImplemented
        return self.merge(other)

    def merge(self, *others: "Schema", name: str = "") -> "Schema":
        """Return a schema with the fields of all; a clash names both schemas."""
        return merge_schemas(((one, one.name) for one in (self, *others)), name)

    def rename(
        self, new: Mapping[str, str] | None = None, /, *, name: str = ""
    ) -> "Schema":
        """Return a schema with other field (or group) names, or another name."""
        for old in new or {}:
            self[old]
        made: dict[str, Field] = {}
        for path, field in self.rows():
            moved = _moved(path, new or {})
            if moved in made:
                raise SchemaError(
                    f"{self.name}: two fields would be named {moved!r}. Rename one "
                    "of them. (R0114)"
                )
            made[moved] = field
        return Schema(name or self.name, made)

    def prefix(self, group: str, *, name: str = "") -> "Schema":
        """Return a schema with all fields inside a group."""
        fields = {f"{group}/{path}": field for path, field in self.rows()}
        return Schema(name or self.name, fields)

    def slice(self, *selections: str, name: str = "") -> "Schema":
        """Return a schema of the fields that paths, groups or globs select."""
        keep: set[str] = set()
        for selection in selections:
            found = matching(selection, self.paths)
            if not found and "*" not in selection:
                found = matching(f"{selection}/**", self.paths)
            if not found:
                raise self.unknown(selection)
            keep.update(found)
        fields = {path: field for path, field in self.rows() if path in keep}
        return Schema(name or self.name, fields)


def merge_schemas(parts: Iterable[tuple[Schema, str]], name: str = "") -> Schema:
    """Merge schemas, each given with its origin (the class or file that has it).

    A field with the same meaning in two of them is kept once. If the meanings differ,
    or a group has the path of a field, raise SchemaError with both origins.
    """
    parts = list(parts)
    names = dict.fromkeys(schema.name for schema, _ in parts)
    merged: dict[str, Field] = {}
    origins: dict[str, str] = {}
    for schema, origin in parts:
        for path, field in schema.rows():
            _check_nesting(path, origin, merged, origins)
            if path in merged and merged[path].meaning != field.meaning:
                raise SchemaError(
                    f"{path!r} is defined twice: {definition(merged[path])} by "
                    f"{origins[path]}, and {definition(field)} by {origin}. "
                    f"Rename one of them, or give one a prefix. (R0114)"
                )
            if path not in merged:
                merged[path], origins[path] = field, origin
    return Schema(name or "+".join(names), merged)


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
                f"({long!r}). Rename one of them. (R0114)"
            )


def _moved(path: str, new: Mapping[str, str]) -> str:
    chunks = path.split("/")
    for end in range(len(chunks), 0, -1):
        head = "/".join(chunks[:end])
        if head in new:
            return "/".join([new[head], *chunks[end:]])
    return path


def rule(
    needs: Schema | Mapping[str, Any],
    gives: Schema | Mapping[str, Any],
    *,
    inverse: Callable[[Any], Any] | None = None,
    name: str = "",
) -> Callable[[Callable[[Any], Any]], Rule]:
    """Make a rule of the function below it.

    @rule(needs={"up": boolean(), "down": boolean()}, gives={"speed": percent()})
    def keys_to_speed(keys):
        return {"speed": 50 * (keys.up - keys.down)}
    """

    def make(function: Callable[[Any], Any]) -> Rule:
        if not callable(function):
            raise SchemaError(
                f"@rule(...) stands above a function, not {function!r}. (R0116)"
            )
        called = name or getattr(function, "__name__", "rule")
        return Rule(
            called,
            _of_rule(f"{called}.needs", needs),
            _of_rule(f"{called}.gives", gives),
            function,
            inverse,
        )

    return make


def _of_rule(name: str, given: Schema | Mapping[str, Any]) -> Schema:
    made = given if isinstance(given, Schema) else Schema(name, given)
    if not made.paths:
        raise SchemaError(
            f"{name}: a rule names at least one field, such as "
            f"{{'x': length()}}. (R0116)"
        )
    return made
