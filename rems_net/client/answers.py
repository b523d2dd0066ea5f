"""Readers of answers: each one returns the content, and refuses what is malformed."""

import json
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from rems_net.agents.agent import PHASES
from rems_net.agents.verbs import outcome
from rems_net.defdict import Schema
from rems_net.errors import AgentError, RemsError, WireError
from rems_net.router.asking import printable
from rems_net.router.mail import Mail
from rems_net.router.message import read

#: errors that reading bytes from an unknown program may raise
NONSENSE = (RemsError, ValueError, TypeError, KeyError, AttributeError, RecursionError)
#: characters of a person's name that are shown
LONGEST = 100
#: columns of a roster in JSON, and their types
ROW: dict[str, type | tuple[type, ...]] = {
    "agent": str,
    "kind": str,
    "host": str,
    "rate": (int, float),
    "seen": (int, float),
    "tick": int,
}


def read_told(mail: Mail) -> Any:
    """Return a port, a field, or the clock's tick or roster, from its JSON."""
    _check(mail.key.isprintable() and "*" not in mail.key, "at no key")
    chunks = mail.key.split("/")
    if chunks[1:] == ["clock", "roster"]:
        return read_rows(mail)
    told = _json(mail)
    _check(isinstance(told, Mapping), "no map")
    if chunks[1:] == ["clock", "tick"]:
        _check(all(k.isprintable() and _number(v) for k, v in told.items()), "no tick")
        return told
    _check(len(chunks) > 3, "no port")
    _check(isinstance(told["tick"], int) and _number(told["time"]), "no tick")
    for path, value in told["values"].items():
        _check(path.isprintable() and value["unit"].isprintable(), "no field")
        _check("value" in value, "no value")
    return told


def read_rows(mail: Mail) -> list[dict[str, Any]]:
    """Return a row for each agent."""
    rows: list[dict[str, Any]] = _json(mail)
    _check(isinstance(rows, list), "no list")
    for row in rows:
        _check(all(isinstance(row[k], kind) for k, kind in ROW.items()), "no row")
        _check(all(math.isfinite(row[k]) for k in ("rate", "seen", "tick")), "no row")
        texts = row["agent"], row["host"]
        _check(all(t.isprintable() for t in texts) and row["kind"] in PHASES, "no row")
    return rows


class Awaited(NamedTuple):
    """The agents for which a run waits before its first tick."""

    agents: list[str]


def read_begun(mail: Mail) -> list[dict[str, Any]] | Awaited:
    """Return the rows; or Awaited if agents that are needed to begin are missing."""
    told = _json(mail)
    if not isinstance(told, Mapping):
        return read_rows(mail)
    agents = told["awaited"]
    _check(isinstance(agents, list), "no list")
    _check(all(isinstance(a, str) and a.isprintable() for a in agents), "no agents")
    return Awaited(agents)


def read_schemas(mail: Mail) -> dict[str, Schema]:
    """Return the schemas of an agent's ports, by name."""
    found = {port: Schema.from_wire(wire) for port, wire in read(mail.payload).items()}
    _check(all(isinstance(port, str) for port in found), "no port")
    return found


def read_holder(mail: Mail) -> str:
    """Read the name of a person who drives. Raises ValueError for no text."""
    return printable(mail.payload.decode())[:LONGEST]


def read_flag(mail: Mail, name: str) -> bool:
    """Return the flag of this name in a receipt."""
    said = read(mail.payload)[name]
    _check(type(said) is bool, "no receipt")
    return bool(said)


def read_result(mail: Mail, agent: str) -> Any:
    """Return what a verb of an agent returned; an AgentError for what it raised."""
    try:
        return outcome(agent, mail.payload)
    except AgentError as error:
        return error


def _json(mail: Mail) -> Any:
    try:
        return json.loads(mail.payload)
    except (ValueError, RecursionError):
        raise WireError(f"its {len(mail.payload)} bytes are no JSON (R0621)") from None


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and math.isfinite(value)


def _check(fits: object, what: str) -> None:
    if not fits:
        raise WireError(f"it is {what} (R0621)")
