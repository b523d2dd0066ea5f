"""Rule: a pure function from some fields to others.

A conversion finds the rules whose needs it can meet. The function receives a DefDict of
its needs, already in the rule's units. It returns a dict (or a sequence) of all fields
that it gives. With an `inverse` the same rule converts back.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rems_net.defdict.values.value import DefDict
from rems_net.errors import FieldValueError

if TYPE_CHECKING:
    from rems_net.defdict.schema import Schema


@dataclass(frozen=True, slots=True, eq=False)
class Rule:
    """A function, the fields it needs and the fields it gives."""

    name: str
    needs: "Schema"
    gives: "Schema"
    function: Callable[[Any], Any]
    inverse: Callable[[Any], Any] | None = None

    def __call__(self, value: Any) -> DefDict:
        """Apply the rule to a value of its needs, or to a dict of them."""
        given = value if isinstance(value, DefDict) else self.needs(value)
        made: DefDict = self.gives.around(self.leaves(given))
        return made

    def leaves(self, needs: DefDict) -> list[Any]:
        """Return the function's result, checked, as leaves."""
        found = self.function(needs)
        if isinstance(found, DefDict):
            found = found.to(self.gives)
        if isinstance(found, Mapping):
            for path in self.gives.paths:
                if path not in found and path.split("/")[0] not in found:
                    raise FieldValueError(
                        f"rule {self.name} gives {path!r}, but its function returned "
                        f"only {', '.join(map(repr, found))}. (R0116)"
                    )
        elif found is None:
            raise FieldValueError(
                f"rule {self.name} returned nothing: end its function with return "
                f"{{...}}. (R0116)"
            )
        return self.gives._build(found, f"rule {self.name}").leaves()

    def back(self) -> "Rule | None":
        """Return the rule that undoes this one; None without an inverse."""
        if self.inverse is None:
            return None
        name = f"{self.name} (inverse)"
        return Rule(name, self.gives, self.needs, self.inverse, self.function)
