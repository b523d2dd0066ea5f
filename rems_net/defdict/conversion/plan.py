"""Plan of a conversion: where each field of the target comes from.

In this order: a rule whose needs are there, the field of the same path, a rule run
backwards, or (only with missing="default") the default.
"""

from typing import Any

from rems_net.defdict.conversion.link import MismatchError, guard, link
from rems_net.defdict.conversion.rule import Rule
from rems_net.defdict.fields.descriptions import in_brief
from rems_net.defdict.fields.field import Field
from rems_net.defdict.trees.tree import Tree
from rems_net.errors import ConversionError, DimensionError, nearest, uncoded

Rules = tuple[Rule, ...]


class Plan:
    """Plan that decides where each field comes from, and writes lines of code for it.

    After `lines` have run, `made` holds the names of the target's leaves.
    """

    def __init__(
        self,
        source: Tree,
        target: Tree,
        labels: tuple[str, str],
        rules: Rules = (),
        missing: str = "error",
        surplus: str = "drop",
    ) -> None:
        self.source, self.target = source, target
        self.labels, self.missing = labels, missing
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
            path: (f"v{i}", field) for i, (path, field) in enumerate(source.rows())
        }
        self.made = [
            self._target(path, field, f"t{i}")
            for i, (path, field) in enumerate(target.rows())
        ]
        unused = [path for path in self.source.paths if path not in self.used]
        if surplus == "error" and unused:
            self.problems.append(
                f"{unused[0]!r} would be dropped; allow it with surplus='drop'"
            )
        if self.problems:
            kind = DimensionError if self.dimension else ConversionError
            listed = "".join(f"\n  - {problem}." for problem in self.problems)
            raise kind(f"{labels[0]} cannot become {labels[1]}:{listed} (R0117)")

    def _target(self, path: str, field: Field, name: str) -> str:
        found, rule = self._resolve(path, ())
        if found is None:
            self._default(path, field, name)
            return name
        return self._link(found, (path, field), name, rule)

    def _default(self, path: str, field: Field, name: str) -> None:
        if self.missing == "error":
            unused = [p for p in self.source.paths if p not in self.target]
            advice = "Add a rule, or ask for its default with missing='default'"
            if self.labels[1] != self.target.name:  # a connection has no such arguments
                advice = "Connect what has it, or a process that makes it"
            problem = f"nothing gives {path!r} ({in_brief(field)})."
            for rule in (one for one in self.forward if path in one.gives.paths):
                lacks = [one for one in rule.needs.paths if not self._can(one, ())]
                for need in lacks[:1]:
                    problem += f" The rule {rule.name} needs {need!r}."
                    path, advice = need, "Correct the rule, or connect what has it"
            self.problems.append(f"{problem}{nearest(path, unused)} {advice}")
        self.names[f"default{name}"] = field.default
        self.lines.append(f"{name} = default{name}")
        if field.dtype == "list":
            self.lines[-1] = f"{name} = tuple(x.copy() for x in default{name})"
        self.rows.append((path, "default", in_brief(field), "", ""))

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
            self.problems.append(f"{path!r}{moved}: {uncoded(why)}")
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
        self.rows.append((path, in_brief(a), in_brief(b), made.factor, rule))
        return name

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
            for i, (path, field) in enumerate(rule.gives.rows())
        }
        self.done[id(rule)] = gives
        needs = []
        for i, (path, field) in enumerate(rule.needs.rows()):
            found, by = self._resolve(path, (*stack, rule))
            assert found is not None
            needs.append(self._link(found, (path, field), f"n{place}_{i}", by))
            self.rows[-1:] = [
                (f"{path} (for {rule.name})", *row[1:]) for row in self.rows[-1:]
            ]
        self.names[f"rule{place}"] = rule.leaves
        self.names[f"needs{place}"] = rule.needs.around
        outputs = "".join(f"{name}, " for name, _ in gives.values())
        call = f"rule{place}(needs{place}([{', '.join(needs)}]))"
        self.lines.append(f"{outputs}= {call}  # {rule.name!r}")
        return gives
