"""Rules of connections: those of an experiment, and those of sticks and keys."""

from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

from rems_net.agents import registry
from rems_net.defdict import Converter, Rule, Schema
from rems_net.errors import ExperimentError
from rems_net.teleop.keys import KEYBOARD, KEYS_RULE
from rems_net.teleop.stick import STICK, stick_rule

Rules = tuple[Rule, ...]


def check_rules(given: object, folder: Path) -> Rules:
    """Return the rules that an agent is given: `file.py:name`, or a Rule, or several.

    folder: the base of a relative file name. Raises ExperimentError.
    """
    several = given if isinstance(given, list | tuple) else [given]
    return tuple(_rule(one, folder) for one in several)


def _rule(given: object, folder: Path) -> Rule:
    found = given
    if isinstance(given, str) and ":" in given:
        found = registry.find(given, folder)[0]
    if isinstance(found, Rule):
        return found
    if callable(found):
        name = getattr(found, "__name__", repr(found))
        raise ExperimentError(
            f"rules has {name}, a plain function: write @rule(needs=..., gives=...) "
            "above it (from rems_net import rule). (R0452)"
        )
    raise ExperimentError(
        f"rules has {given!r:.80}; expected a function with @rule above it, or its "
        "name, such as 'lab.py:arrows_to_wheels'. (R0452)"
    )


def rule_reference(rule: Rule, reference: Callable[[Any], str]) -> str:
    """Return the name by which another process finds a rule. Raises ExperimentError."""
    named = reference(rule.function)
    if rule.function.__qualname__ == "<lambda>":
        raise ExperimentError(
            f"the rule {rule.name!r} has no function with a name, by which the process "
            "of its agent could find it; write @rule(...) above a `def`. (R0427)"
        )
    return named


def connect(
    theirs: Schema, wanted: Schema, rules: Rules, source: str, target: str
) -> Converter:
    """Return what makes the wanted value of theirs, in a connection.

    rules: of the reader.  source, target: names of both ends, for messages. Raises
    ConversionError. Fields of a command that a stick does not move are at rest.
    """
    hand = by_hand(theirs, wanted, rules)
    return theirs.converter(
        wanted,
        (*rules, *hand),
        missing="default" if hand else "error",
        source_label=source,
        target_label=target,
    )


def by_hand(theirs: Schema, wanted: Schema, own: Rules = ()) -> Rules:
    """Return the rules for a stick, or keys, that drive a robot; none otherwise.

    own: rules of the reader. One that gives the same fields replaces ours.
    """
    if theirs not in (STICK, KEYBOARD) or wanted in (STICK, theirs):
        return (KEYS_RULE,) if (theirs, wanted) == (KEYBOARD, STICK) else ()
    drive = stick_rule(wanted)
    if drive is None or any({*drive.gives.paths} & {*r.gives.paths} for r in own):
        return ()
    return (KEYS_RULE, drive) if theirs == KEYBOARD else (drive,)


def given_paths(theirs: Schema, wanted: Schema, rules: Rules) -> set[str]:
    """Return the paths of the fields that a writer gives: its own, and by rules."""
    if hand := by_hand(theirs, wanted, rules):
        return {*hand[-1].gives.paths}
    found = {*theirs.paths}
    for rule in rules * len(rules):  # a rule may need what another one gives
        if {*rule.needs.paths} <= found:
            found |= {*rule.gives.paths}
    return found


def shared(
    own: Schema, theirs: Schema, rules: Rules, reader: str, source: str
) -> Schema:
    """Return the fields of `own` that the writer gives: by the same paths, or rules.

    rules: of the reader.  reader, source: names of both, for the message. Raises
    ExperimentError for a writer that gives none.
    """
    given = given_paths(theirs, own, rules)
    paths = [path for path in own.paths if path in given]
    if not paths:
        raise ExperimentError(
            f"{source} is one of several writers of {reader} and gives none of its "
            f"fields: it has {', '.join(theirs.paths)}, and {reader} has "
            f"{', '.join(own.paths)}. (R0420)"
        )
    return own.slice(*paths)


def given_part(
    own: Schema, theirs: Schema, rules: Rules, needed: Collection[str]
) -> Schema:
    """Return the fields of `own` that the writer gives, and those that are needed."""
    given = given_paths(theirs, own, rules)
    return own.slice(*(p for p in own.paths if p in given or p in needed))
