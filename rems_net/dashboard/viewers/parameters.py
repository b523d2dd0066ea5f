"""Parameters: the settings of all agents, which a viewer lists and changes.

A parameter is named like a setting of `--set`: `robot/sim.track`. A value with a unit
is a text such as "112.6 mm", so that nobody takes millimetres for metres.
"""

from contextlib import suppress
from typing import Any

from rems_net.client import Fabric
from rems_net.client.answers import NONSENSE
from rems_net.dashboard.requests import SHORT, read_settings
from rems_net.errors import WireError, nearest
from rems_net.router.asking import printable

#: parameters that are listed at most, and that a viewer may name at once
LISTED, NAMES = 2000, 1000
#: what JSON has, and a viewer shows
PLAIN = (bool, int, float, str)

Values = dict[str, Any]
#: by name: the value, and whether it may be changed while its agent runs
Parameters = dict[str, tuple[Any, bool]]


def read_parameters(fabric: Fabric) -> Parameters:
    """Return the settings of all agents that list them, by name."""
    session = fabric.session
    begin = len(session.fabric) + 1
    found: Parameters = {}
    for mail in session.ask(session.key("*", "*", "@settings"), timeout=SHORT):
        agent = mail.key[begin:].removesuffix("/@settings")
        with suppress(*NONSENSE):
            for row in read_settings(mail):
                name, value = row.get("name"), row.get("value")
                if isinstance(name, str) and isinstance(value, PLAIN):
                    unit = row.get("unit")
                    shown = f"{value} {unit}" if unit else value
                    found[f"{agent}.{name}"] = shown, bool(row.get("adjustable"))
        if len(found) > LISTED:
            break
    return dict(sorted(found.items()))


def write_parameters(fabric: Fabric, values: Values) -> None:
    """Change settings: those of one agent all at once, or none of them.

    Raises RemsError with the sentence of the agent that refuses.
    """
    known = read_parameters(fabric)
    can = [name for name, (_, adjustable) in known.items() if adjustable]
    by_agent: dict[str, Values] = {}
    for name, value in values.items():
        if name not in can:
            shown = f"{printable(name)!r:.80}"
            why = "cannot be changed while its agent runs"
            raise WireError(
                f"{shown} {why if name in known else 'is no parameter here'}; these "
                f"can be changed: {', '.join(can) or 'none'}."
                f"{nearest(name, can)} (R0513)"
            )
        agent, _, setting = name.partition(".")
        by_agent.setdefault(agent, {})[setting] = value
    for agent, given in by_agent.items():
        fabric.call(agent, "adjust", (), given)


def read_names(words: dict[str, Any]) -> set[str]:
    """Return the names of parameters in a message; none means all. Raises WireError."""
    names = words.get("parameterNames", [])
    fits = isinstance(names, list) and len(names) <= NAMES
    if not fits or not all(isinstance(name, str) for name in names):
        raise WireError(
            f"parameterNames is no list of at most {NAMES} names, such as "
            "robot/sim.track. (R1003)"
        )
    return set(names)


def read_values(words: dict[str, Any]) -> Values:
    """Return names and values of a message that sets parameters. Raises WireError."""
    rows = words.get("parameters")
    fits = isinstance(rows, list) and len(rows) <= NAMES
    if not fits or not all(
        isinstance(row, dict)
        and isinstance(row.get("name"), str)
        and isinstance(row.get("value"), PLAIN)
        for row in rows or []
    ):
        raise WireError(
            'parameters is no list such as [{"name": "robot/sim.track", "value": '
            '"112.6 mm"}]. (R1003)'
        )
    return {row["name"]: row["value"] for row in rows or []}


def pack_rows(found: Parameters, names: set[str]) -> list[dict[str, Any]]:
    """Return the parameters of these names for a message; all, if no name is given."""
    return [
        {"name": name, "value": value}
        for name, (value, _) in found.items()
        if not names or name in names
    ]
