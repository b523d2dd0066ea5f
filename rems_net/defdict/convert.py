"""The conversion of one schema's values into another's, compiled once.

`plan` decides where every field of the target comes from: a rule whose needs can be
met, the field of the same path, a rule run backwards, or (if asked) the default.
`Converter` turns the plan into a few lines of Python, readable as `converter.code`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

from rems_net.defdict.describe import columns
from rems_net.defdict.field import Field
from rems_net.defdict.link import MismatchError, guard, link
from rems_net.defdict.rule import Rule
from rems_net.defdict.schema import Schema
from rems_net.defdict.value import DefDict
from rems_net.errors import ConversionError, DimensionError, nearest

__all__ = ["Converter"]

Leaves = list[Any]
Rules = tuple[Rule, ...]


class Converter:
    """Turns values (or payloads) of `source` into values of `target`."""

    def __init__(
        self,
        source: Schema,
        target: Schema,
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
        writer = _Writer(self, rules, missing)
        self.rows = writer.rows
        self.code = writer.write(surplus)
        exec(
            compile(self.code, f"<{source.name} to {target.name}>", "exec"),
            writer.names,
        )
        self._convert: Callable[[Leaves], Leaves] = writer.names["convert"]
        self._layout, self._read = target.layout, source.layout.decode
        self._new, self._kind = target.layout.new, source.layout.value_class

    def __call__(self, value: Any) -> DefDict:
        """Convert a value of the source schema (or what one can be built from)."""
        if type(value) is self._kind:
            return self._new(self._convert(value._leaves))
        if not isinstance(value, DefDict):
            value = self.source(value)
        elif value.schema is not self.source and value.schema != self.source:
            if value.schema.digest != self.source.digest:
                raise ConversionError(
                    f"this converter takes {self.source.name}@{self.source.digest}, "
                    f"not {value.schema.name}@{value.schema.digest}."
                )
            value = self.source(value.flat())
        return self._new(self._convert(value.leaves()))

    def decode(self, payload: bytes) -> DefDict:
        """Convert a payload of the source; raise WireError if it does not fit."""
        return self._new(self._convert(self._read(payload)))

    def explain(self) -> str:
        """Return the table of where each field comes from."""
        head = ("field", "from", "to", "factor", "rule")
        return f"{self.labels[0]} to {self.labels[1]}\n{columns([head, *self.rows])}"

    def __repr__(self) -> str:
        return f"<Converter {self.labels[0]} to {self.labels[1]}>"


def _policy(name: str, given: str, known: tuple[str, ...]) -> None:
    if given not in known:
        raise ConversionError(
            f"{name}= is {' or '.join(map(repr, known))}, not {given!r}."
        )


def _label(schema: Schema, label: str) -> str:
    return f"{label} ({schema.name})" if label else schema.name


class _Writer:
    """Writes the function of one conversion, line by line."""

    def __init__(self, owner: Converter, rules: Rules, missing: str) -> None:
        self.source, self.target = owner.source, owner.target
        self.labels, self.missing = owner.labels, missing
        self.forward = rules
        self.backward = tuple(one for one in (r.back() for r in rules) if one)
        self.names: dict[str, Any] = {}
        self.lines: list[str] = []
        self.rows: list[tuple[str, ...]] = []
        self.problems: list[str] = []
        self.dimension = False
        self.used: set[str] = set()
        self.done: dict[int, dict[str, tuple[str, Field]]] = {}
        self.start = {
            path: (f"v{i}", field)
            for i, (path, field) in enumerate(
                zip(self.source.paths, self.source.fields, strict=True)
            )
        }

    def write(self, surplus: str) -> str:
        made = []
        for i, path in enumerate(self.target.paths):
            made.append(self._target(path, self.target.fields[i], f"t{i}"))
        unused = [path for path in self.source.paths if path not in self.used]
        if surplus == "error" and unused:
            self.problems.append(
                f"{unused[0]!r} would be dropped; allow it with surplus='drop'"
            )
        if self.problems:
            raise self._error()
        values = "".join(f"v{i}, " for i in range(len(self.start)))
        body = "\n".join(f"    {line}" for line in self.lines)
        return (
            f"def convert(leaves):\n    {values or '[]'} = leaves\n{body}\n"
            f"    return [{', '.join(made)}]\n"
        )

    def _error(self) -> ConversionError:
        kind = DimensionError if self.dimension else ConversionError
        listed = "".join(f"\n  - {problem}." for problem in self.problems)
        return kind(f"{self.labels[0]} cannot become {self.labels[1]}:{listed}")

    # -- one field ------------------------------------------------------------

    def _target(self, path: str, field: Field, name: str) -> str:
        found, rule = self._resolve(path, ())
        if found is None:
            self._default(path, field, name)
            return name
        return self._link(found, (path, field), name, rule)

    def _default(self, path: str, field: Field, name: str) -> None:
        if self.missing == "error":
            unused = [p for p in self.source.paths if p not in self.target]
            self.problems.append(
                f"nothing gives {path!r} ({_kind(field)}).{nearest(path, unused)} "
                f"Add a rule, or ask for its default with missing='default'"
            )
        self.names[f"default{name}"] = field.default
        self.lines.append(f"{name} = default{name}")
        if field.dtype == "list":
            self.lines[-1] = f"{name} = tuple(x.copy() for x in default{name})"
        self.rows.append((path, "default", _kind(field), "", ""))

    def _link(
        self,
        found: tuple[str, str, Field],
        target: tuple[str, Field],
        name: str,
        rule: str,
    ) -> str:
        variable, origin, a = found
        path, b = target
        try:
            made = link(a, b, name)
        except (MismatchError, ConversionError) as why:
            self.dimension |= getattr(why, "dimension", False)
            moved = f" (from {origin!r})" if origin != path else ""
            self.problems.append(f"{path!r}{moved}: {why}")
            return name
        self.names.update(made.names)
        if made.inside and made.code == "{x}":
            name = variable
        else:
            self.lines.append(f"{name} = {made.code.format(x=variable)}")
        if not made.inside:
            where = f"{self.labels[1]}: {path!r}"
            self.names[f"settle{name}"] = guard(b, where, a.unit, made.slack)
            if b.numeric and not b.shape:
                low, high = b.limits
                self.lines.append(f"if not {low!r} <= {name} <= {high!r}:")
                self.lines.append(f"    {name} = settle{name}({name}, {variable})")
            else:
                self.lines.append(f"{name} = settle{name}({name}, {variable})")
        self.rows.append((path, _kind(a), _kind(b), made.factor, rule))
        return name

    # -- where it comes from --------------------------------------------------

    def _resolve(
        self, path: str, stack: Rules
    ) -> tuple[tuple[str, str, Field] | None, str]:
        rule = self._rule(path, self.forward, stack)
        if rule is None and path in self.start:
            self.used.add(path)
            variable, field = self.start[path]
            return (variable, path, field), ""
        rule = rule or self._rule(path, self.backward, stack)
        if rule is None:
            return None, ""
        variable, field = self._apply(rule, stack)[path]
        return (variable, path, field), rule.name

    def _rule(self, path: str, rules: Rules, stack: Rules) -> Rule | None:
        found = [
            rule
            for rule in rules
            if rule not in stack
            and path in rule.gives.paths
            and all(self._can(need, (*stack, rule)) for need in rule.needs.paths)
        ]
        if len(found) > 1:
            names = " and ".join(rule.name for rule in found)
            self.problems.append(f"rules {names} both give {path!r}; pass only one")
        return found[0] if found else None

    def _can(self, path: str, stack: Rules) -> bool:
        return path in self.start or any(
            rule not in stack
            and path in rule.gives.paths
            and all(self._can(need, (*stack, rule)) for need in rule.needs.paths)
            for rule in (*self.forward, *self.backward)
        )

    def _apply(self, rule: Rule, stack: Rules) -> dict[str, tuple[str, Field]]:
        if id(rule) in self.done:
            return self.done[id(rule)]
        place = len(self.done)
        gives = {
            path: (f"r{place}_{i}", field)
            for i, (path, field) in enumerate(
                zip(rule.gives.paths, rule.gives.fields, strict=True)
            )
        }
        self.done[id(rule)] = gives
        needs = []
        for i, path in enumerate(rule.needs.paths):
            found, by = self._resolve(path, (*stack, rule))
            assert found is not None
            name = f"n{place}_{i}"
            needs.append(self._link(found, (path, rule.needs.fields[i]), name, by))
            self.rows[-1:] = [
                (f"{path} (for {rule.name})", *row[1:]) for row in self.rows[-1:]
            ]
        self.names[f"rule{place}"] = rule.leaves
        self.names[f"needs{place}"] = rule.needs.layout.new
        outputs = "".join(f"{name}, " for name, _ in gives.values())
        call = f"rule{place}(needs{place}([{', '.join(needs)}]))"
        self.lines.append(f"{outputs}= {call}  # {rule.name}")
        return gives


def _kind(field: Field) -> str:
    """Return type, unit and range of a field in a few characters."""
    words = [field.unit or field.describe_type()]
    if field.shape and field.unit:
        words.append(field.describe_type())
    if field.means:
        words.append(f"of {field.means}")
    if field.range:
        words.append(f"{field.range[0]:g}..{field.range[1]:g}")
    return " ".join(words)


@lru_cache(maxsize=1024)
def converter(
    source: Schema,
    target: Schema,
    rules: Rules,
    missing: str,
    surplus: str,
    source_label: str,
    target_label: str,
) -> Converter:
    """Return the converter, compiled once for the same question."""
    return Converter(
        source, target, rules, missing, surplus, source_label, target_label
    )
