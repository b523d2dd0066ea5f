"""Rule: the decorator that makes a rule of a function.

@rule(needs={"up": boolean(), "down": boolean()}, gives={"speed": percent()})
def keys_to_speed(keys):
    return {"speed": 50 * (keys.up - keys.down)}
"""

from collections.abc import Callable, Mapping
from typing import Any

from rems_net.defdict.conversion.rule import Rule
from rems_net.defdict.schema import Schema
from rems_net.errors import SchemaError


def rule(
    needs: Schema | Mapping[str, Any],
    gives: Schema | Mapping[str, Any],
    *,
    inverse: Callable[[Any], Any] | None = None,
    name: str = "",
) -> Callable[[Callable[[Any], Any]], Rule]:
    """Make a rule of the function below it."""

    def make(function: Callable[[Any], Any]) -> Rule:
        if not callable(function):
            raise SchemaError(
                f"@rule(...) stands above a function, not {function!r}. (R0116)"
            )
        called = name or getattr(function, "__name__", "rule")
        return Rule(
            called,
            _schema(f"{called}.needs", needs),
            _schema(f"{called}.gives", gives),
            function,
            inverse,
        )

    return make


def _schema(name: str, given: Schema | Mapping[str, Any]) -> Schema:
    made = given if isinstance(given, Schema) else Schema(name, given)
    if not made.paths:
        raise SchemaError(
            f"{name}: a rule names at least one field, such as "
            f"{{'x': length()}}. (R0116)"
        )
    return made
