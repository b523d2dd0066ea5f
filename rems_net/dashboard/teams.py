"""Teams: all fabrics at a router at one glance, and STOP for some of them.

The session of the page decides what it sees: a teacher's sees every team, a student's
the own team and the class's fabric.
"""

import time
from collections.abc import Callable
from contextlib import suppress
from threading import Lock
from typing import Any

from rems_net.client import Fabric
from rems_net.client.people import people
from rems_net.client.stopping import fabrics_to_stop, standings, stop_each
from rems_net.dashboard.requests import SHORT, look_at
from rems_net.errors import FabricError, RemsError, WireError
from rems_net.router.find import fabrics, on_each
from rems_net.router.gate.access import MEMBERS, is_of_team
from rems_net.router.gate.identity import identity
from rems_net.router.keys import is_name
from rems_net.router.relay.people import Person
from rems_net.router.session import Session

#: s. All pages get the same answer for this time.
FRESH = 0.9
#: fabrics that one request stops or releases
MOST = 256
#: what a page names to stop every fabric
ALL = "all"
#: the parts of a fabric's state in its row
STATE = ("tick", "t", "clock", "stopped", "late", "stand", "unsure")


class Teams:
    """The fabrics that the session of a page may see. Each method may wait.

    session: returns the session of the page's server.
    """

    def __init__(self, session: Callable[[], Session]):
        self._session = session
        self._lock = Lock()
        self._seen: dict[str, Any] = {}
        self._at = -FRESH
        #: verb of a page's request -> method
        self.deeds: dict[str, Callable[[dict[str, Any]], Any]] = {
            "teams": lambda _: self.look(),
            "stop_teams": self._stop,
            "release_teams": self._release,
        }

    def look(self) -> dict[str, Any]:
        """Return a row for each fabric and each team, and whether it is a teacher's."""
        with self._lock:
            if time.monotonic() > self._at + FRESH:
                self._seen = _look(self._session())
                self._at = time.monotonic()
            return self._seen

    def put_stop(self, request: dict[str, Any]) -> None:
        """Put STOP on the fabrics that a page names, and wait for nothing."""
        if request.get("fabrics") == ALL:  # those that were seen, without a question
            names = [row["fabric"] for row in self._seen.get("rows", ())]
        else:
            names = _names(request)
        stop_each(self._session(), names)

    def _stop(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the receipts by fabric, or why there are none."""
        session = self._session()
        everywhere = request.get("fabrics") == ALL
        names = fabrics_to_stop(session) if everywhere else _names(request)
        stop_each(session, names)
        done = on_each(session, names, lambda s: [*map(str, Fabric(s).stop())])
        return self._told({name: said for name, said in done.items() if said != []})

    def _release(self, request: dict[str, Any]) -> dict[str, Any]:
        session, names = self._session(), request.get("fabrics")
        if names == ALL:
            names = fabrics_to_stop(session, release=True)
        else:
            names = _names(request)
        return self._told(on_each(session, names, lambda s: Fabric(s).release()))

    def _told(self, done: dict[str, Any]) -> dict[str, Any]:
        self._at = -FRESH
        return {k: str(v) if isinstance(v, RemsError) else v for k, v in done.items()}


def may_see(session: Session, fabric: str) -> bool:
    """Return whether the user of this session may look at a fabric."""
    known = identity(session)
    return known is None or known.may_see(fabric)


def _names(request: dict[str, Any]) -> list[str]:
    """Return the fabrics that a page names. Raises WireError."""
    names = request.get("fabrics")
    if not isinstance(names, list) or len(names) > MOST or not all(map(is_name, names)):
        raise WireError(f"Expected a list of at most {MOST} fabrics. (R1003)")
    return names


def _look(session: Session) -> dict[str, Any]:
    known = identity(session)
    there = fabrics(session)
    states = on_each(session, there, _state)
    everybody = _people(session) if known is not None else []
    teams = {one.team for one in everybody if one.team}
    idle = {t for t in teams if not any(is_of_team(t, name) for name in there)}
    rows = []
    for name in sorted({*there, *idle}):
        here, away = _students(everybody, name)
        row: dict[str, Any] = {"fabric": name, "here": here, "away": away}
        row["there"] = name in there
        state = states.get(name)
        if isinstance(state, FabricError):
            row["error"] = str(state)[:500]
        elif state is not None:
            row |= _row(state)
        rows.append(row)
    teacher = known is not None and known.role == MEMBERS
    return {"rows": rows, "teacher": teacher}


def _state(session: Session) -> dict[str, Any]:
    """Return the state of a fabric, and which of its robots surely stand."""
    state = look_at(session)
    found = standings(session, holds=state["stopped"], timeout=SHORT)
    unsure = [str(one) for one in found if not one.stands]
    stand = len(found) - len(unsure) if state["stopped"] else 0
    return state | {"stand": stand, "unsure": unsure}


def _row(state: dict[str, Any]) -> dict[str, Any]:
    kinds = [kind for _, kind, _ in state["agents"]]
    shown = {word: state[word] for word in STATE}
    return shown | {"robots": kinds.count("robot")}


def _people(session: Session) -> list[Person]:
    with suppress(FabricError):  # a router of another version does not list them
        return people(session)
    return []


def _students(everybody: list[Person], fabric: str) -> tuple[list[str], list[str]]:
    """Return the students of a fabric's team: those who are here, and the others."""
    team = [one for one in everybody if one.team and is_of_team(one.team, fabric)]
    here = {one.user for one in team if one.here}
    return sorted(here), sorted({one.user for one in team} - here)
