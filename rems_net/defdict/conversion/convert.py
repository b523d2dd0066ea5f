"""Converter: turns values of one schema into another's, compiled once.

The plan becomes a few lines of Python, readable as `converter.code`.
"""

from collections.abc import Callable
from functools import cached_property, lru_cache
from types import MethodType
from typing import TYPE_CHECKING, Any

from rems_net.defdict.conversion.plan import Plan, Rules
from rems_net.defdict.trees.tree import columns
from rems_net.defdict.values.classes import decode_into, own_leaves, value_class
from rems_net.defdict.values.mapping import Leaves
from rems_net.defdict.values.value import DefDict
from rems_net.defdict.wire.codec import Code, targets
from rems_net.errors import ConversionError

if TYPE_CHECKING:
    from rems_net.defdict.schema import Schema


class Converter:
    """Conversion of values (or payloads) of `source` into values of `target`."""

    def __init__(
        self,
        source: "Schema",
        target: "Schema",
        rules: Rules = (),
        missing: str = "error",
        surplus: str = "drop",
        source_label: str = "",
        target_label: str = "",
    ) -> None:
        _policy("missing", missing, ("error", "default"))
        _policy("surplus", surplus, ("drop", "error"))
        self.source, self.target = source, target
        self.labels = _label(source, source_label), _label(target, target_label)
        self._plan = plan = Plan(source, target, self.labels, rules, missing, surplus)
        lines = [f"{targets(len(source.fields))} = leaves", *plan.lines]
        code = Code([*lines, f"return [{', '.join(plan.made)}]"], plan.names)
        head, title = "def convert(leaves):", f"{source.name} to {target.name}"
        self.code, self._convert = code.source(head), code.compile(head, title)
        self._kind = value_class(source)
        self._around: Callable[[Leaves], DefDict] = value_class(target)._around

    def __call__(self, value: Any) -> DefDict:
        """Convert a value of the source schema, or data that one can be built from."""
        if type(value) is self._kind or isinstance(value, self._kind):
            return self._around(self._convert(value._leaves))
        if not isinstance(value, DefDict):
            value = self.source(value)
        leaves = own_leaves(self.source, value)
        if leaves is None:
            raise ConversionError(
                f"this converter takes {self.source.name}@{self.source.digest}, "
                f"not {value.schema.name}@{value.schema.digest}. (R0118)"
            )
        return self._around(self._convert(leaves))

    @cached_property
    def decode(self) -> Callable[[bytes], DefDict]:
        """Convert a payload of the source; raise WireError if it does not fit.

        Reading it, converting and making the value are one function.
        """
        plan = Code(self._plan.lines, self._plan.names)
        method = decode_into(self.source, self.target, plan, self._plan.made)
        return MethodType(method, self)

    def explain(self) -> str:
        """Return the table of where each field comes from."""
        head = ("field", "from", "to", "factor", "rule")
        rows = columns([head, *self._plan.rows])
        return f"{self.labels[0]} to {self.labels[1]}\n{rows}"

    def __repr__(self) -> str:
        return f"<Converter {self.labels[0]} to {self.labels[1]}>"


def _policy(name: str, given: str, known: tuple[str, ...]) -> None:
    if given not in known:
        raise ConversionError(
            f"{name}= is {' or '.join(map(repr, known))}, not {given!r}. (R0118)"
        )


def _label(schema: "Schema", label: str) -> str:
    return f"{label} ({schema.name})" if label else schema.name


#: Equal arguments give the same converter, compiled once.
converter = lru_cache(maxsize=1024)(Converter)
