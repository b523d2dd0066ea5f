"""How `rems list`, `get` and `watch` ask a running fabric."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable
from typing import Any

from rems_net.errors import ExperimentError, FabricError, nearest
from rems_net.router.keys import KINDS
from rems_net.router.session import Session

#: seconds until a fabric that does not answer has no clock
PATIENCE = 2.0


def roster(session: Session) -> list[dict[str, Any]]:
    """Who is there. Raises FabricError where a router runs, but no experiment."""
    key = session.key("clock", "roster")
    deadline = time.monotonic() + PATIENCE
    # Right after joining, a question may find nobody for some milliseconds.
    while time.monotonic() < deadline:
        for mail in session.ask(f"{key}?format=json", timeout=PATIENCE):
            found: list[dict[str, Any]] = json.loads(mail.payload)
            return found
    raise FabricError(
        f"A router answers at {session.link.endpoint}, but no experiment runs there. "
        "Start one with `rems run` or `rems demo --pace 1`."
    )


def values(session: Session, key: str) -> dict[str, Any]:
    """What lives at a key or glob, as JSON, by full key; empty for nothing."""
    answers = session.ask(f"{key}?format=json", timeout=PATIENCE)
    found = {mail.key: json.loads(mail.payload) for mail in answers}
    return dict(sorted(found.items()))


def nothing_at(session: Session, key: str) -> ExperimentError:
    """The error for a key at which nothing lives, with the nearest one that does."""
    fabric = f"{session.fabric}/"
    ports = values(session, f"{fabric}**")
    short = key.removeprefix(fabric)
    every = {port.removeprefix(fabric): _paths(found) for port, found in ports.items()}
    inside = sorted(port for port in every if port.startswith(f"{short}/"))
    every |= {f"{port}/{path}": [] for port in every for path in every[port]}
    if inside:
        hint = f" Did you mean '{short}/*' ({', '.join(inside[:4])})?"
    else:
        hint = nearest(short, sorted(every)) or f" Agents are: {_agents(every)}."
    return ExperimentError(f"Nothing lives at {short!r}.{hint}")


def _paths(found: Any) -> list[str]:
    return (
        list(found["values"]) if isinstance(found, dict) and "values" in found else []
    )


def _agents(keys: Iterable[str]) -> str:
    agents = sorted(
        {"/".join(k.split("/")[:2]) for k in keys if k.split("/")[0] in KINDS}
    )
    return ", ".join(agents[:8]) or "none"
