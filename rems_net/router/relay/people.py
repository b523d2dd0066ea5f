"""People at a shared router: their laptops, since when, and what they run.

Each command of a student is a session of a second, and a run has several. So a person
counts as here from the first session until there was none for a while.
"""

import math
import time
from collections import OrderedDict
from dataclasses import dataclass, field
from itertools import islice
from threading import Lock
from typing import TYPE_CHECKING, NamedTuple

from rems_net.router.gate.access import MEMBERS, is_of_team
from rems_net.router.gate.users import OWNER, Users
from rems_net.router.keys import KINDS, is_name
from rems_net.router.relay.notices import Notices

if TYPE_CHECKING:
    from rems_net.router.relay.connection import Connection

#: s. A shorter session is a command: it does not bring back a laptop that was gone.
STAYS = 3.0
#: s. A laptop lost without a Close is reported after this time; a change of access
#: point takes less.
LOST = 10.0
#: s. A laptop without sessions for this time has left: students think, too.
AWAY = 900.0
#: laptops that are stored; fabrics of a team, with the last user who put STOP there
LAPTOPS, STOPS = 2000, 1000
#: s. A STOP on an unknown fabric is that of the fabric on which one comes within this.
PLACED = 1.0
#: s. A robot that lives has come back so long after its laptop.
REJOINS = 10.0
#: robots that are stored after their sessions were lost
ROBOTS = 1000
#: s. A user who asks more often gets the same answer.
FRESH = 0.2
#: agents of one laptop that are named
RUNS = 100

HERE = "is here"
BACK = "is back"
LEFT = f"has left: nothing came from there for {AWAY / 60:.0f} minutes"
GONE = "is gone without a farewell: it sleeps, has no Wi-Fi, or a program was killed"


class Person(NamedTuple):
    """A user at one laptop.

    laptop: its address; "" if the user has not come yet.  since: the time of day,
    `10:02:33`.  here: whether the laptop is here now.
    runs: keys of its agents and clocks, `team1/robot/sim`.
    """

    user: str
    team: str
    laptop: str
    since: str
    here: bool
    runs: list[str]


@dataclass
class _Laptop:
    since: str
    here: bool = True
    #: sessions with their beginning, by the monotonic clock [s]
    sessions: "dict[Connection, float]" = field(default_factory=dict)
    ended: float = 0.0
    is_lost: bool = False


class People:
    """Store of the people. The gate's thread calls it, and Zenoh's asks it.

    fabric: the class's own.
    """

    def __init__(self, users: Users | None, fabric: str, notices: Notices):
        self._fabric, self._notices = fabric, notices
        #: by user: the role, and the team; empty at a router without users
        self._users = {} if users is None else users.identities()
        #: by user: the time of the last answer, by the monotonic clock [s], and the
        #: answer
        self._shown: dict[str, tuple[float, list[Person]]] = {}
        self._laptops: OrderedDict[tuple[str, str], _Laptop] = OrderedDict()
        #: by team, then by its own fabrics: the last user who put STOP there; STOPs of
        #: users without a team, and on the class's fabric, are at ""
        self._stops: dict[str, OrderedDict[str, tuple[float, str]]] = {}
        #: STOPs on unknown fabrics: when, by whom, and their user
        self._unplaced: list[tuple[float, str, str]] = []
        #: robots whose sessions ended without a farewell, `team1/robot/sim`: when, by
        #: the monotonic clock [s], and on which laptop
        self._lost: OrderedDict[str, tuple[float, tuple[str, str]]] = OrderedDict()
        self._lock = Lock()

    def came(self, one: "Connection", now: float) -> None:
        """Note a session that was let in."""
        key = one.owner, one.host
        with self._lock:
            found = self._laptops.get(key)
            if found is None:
                found = self._laptops[key] = _Laptop(time.strftime("%H:%M:%S"))
                self._report(key, HERE)
            self._laptops.move_to_end(key)
            found.sessions[one] = now
            if len(self._laptops) > LAPTOPS:
                self._laptops.popitem(last=False)

    def left(self, one: "Connection", now: float) -> None:
        """Note the end of a session."""
        with self._lock:
            found = self._laptops.get((one.owner, one.host))
            if found is None or (begun := found.sessions.pop(one, None)) is None:
                return
            if not one.has_closed:
                self._lose(one, now)
            if not found.sessions:
                found.ended = now
                found.is_lost = now - begun > STAYS and not one.has_closed

    def _lose(self, one: "Connection", now: float) -> None:
        for robot in _robots(one):
            if self._may_run(one.owner, robot):
                self._lost[robot] = now, (one.owner, one.host)
                self._lost.move_to_end(robot)
        while len(self._lost) > ROBOTS:
            self._lost.popitem(last=False)

    def lost(self, now: float) -> dict[str, list[tuple[str, float]]]:
        """Return the robots that were lost, and seconds since then, by fabric.

        A robot that has come back, on any laptop, is not among them, nor one that did
        not come back with its laptop.
        """
        with self._lock:
            lost = {
                robot: now - at
                for robot, (at, laptop) in self._lost.items()
                if not self._is_back(laptop, at, now)
            }
            for laptop in self._laptops.values() if lost else ():
                for robot in set().union(*map(_robots, laptop.sessions)):
                    lost.pop(robot, None)
        found: dict[str, list[tuple[str, float]]] = {}
        for key in sorted(lost):
            fabric, _, robot = key.partition("/")
            found.setdefault(fabric, []).append((robot, lost[key]))
        return found

    def _is_back(self, laptop: tuple[str, str], at: float, now: float) -> bool:
        """Return whether a laptop has had a session since then for long enough."""
        found = self._laptops.get(laptop)
        sessions = found.sessions.values() if found is not None else ()
        return any(now - max(begun, at) > REJOINS for begun in sessions)

    def look(self, now: float) -> None:
        """Report laptops that have gone, and those that are back."""
        with self._lock:
            for key, one in self._laptops.items():
                if one.here and not one.sessions:
                    if now - one.ended > (LOST if one.is_lost else AWAY):
                        one.here = False
                        self._report(key, GONE if one.is_lost else LEFT)
                elif (
                    not one.here
                    and now - min(one.sessions.values(), default=now) > STAYS
                ):
                    one.here, one.since = True, time.strftime("%H:%M:%S")
                    self._report(key, BACK)

    def stopped(self, one: "Connection", fabric: str) -> None:
        """Note the user who put STOP, if the router lets it through.

        fabric: "" for an unknown one
        """
        author = time.monotonic(), self.describe(one.owner, one.host)
        if not fabric:
            with self._lock:
                self._unplaced = [
                    (at, by, owner)
                    for at, by, owner in self._unplaced[-STOPS:]
                    if at > author[0] - PLACED
                ] + [(*author, one.owner)]
        elif is_name(fabric) and self._may_stop(one.owner, fabric):
            of = "" if fabric == self._fabric else self._team(one.owner)
            with self._lock:  # a team that repeats STOP fills only its own space
                stops = self._stops.setdefault(of, OrderedDict())
                stops[fabric] = author
                stops.move_to_end(fabric)
                if len(stops) > STOPS:
                    stops.popitem(last=False)

    def who_stopped(self, fabric: str) -> str:
        """Return, and forget, the last author of a STOP there: user and laptop."""
        with self._lock:
            never = -math.inf, "somebody"
            found = [stops.pop(fabric, never) for stops in self._stops.values()]
            oldest = time.monotonic() - PLACED
            found += [
                (at, by)
                for at, by, owner in self._unplaced
                if at > oldest and self._may_stop(owner, fabric)
            ]
            return max(found, default=never)[1]

    def describe(self, owner: str, host: str) -> str:
        """Return the name of a user and a laptop: `anna (team1) on 192.168.1.33`."""
        if owner == host:  # a router without users
            return host
        if owner == OWNER:
            return "the teacher, on the router's machine"
        team = self._team(owner)
        return f"{owner} ({team}) on {host}" if team else f"{owner} on {host}"

    def seen_by(self, user: str) -> list[Person]:
        """Return the people that this user may see.

        A student sees the own team; a teacher, or another member, sees everybody; a
        guest sees the own laptops.
        """
        when, shown = self._shown.get(user, (0.0, []))
        if time.monotonic() - when > FRESH:
            shown = self._seen_by(user)
            self._shown[user] = time.monotonic(), shown
        return shown

    def _seen_by(self, user: str) -> list[Person]:
        role, own = self._users.get(user, ("", ""))
        seen = {
            name
            for name, (_, team) in self._users.items()
            if role == MEMBERS or name == user or (own and team == own)
        }
        with self._lock:
            here = sorted(key for key in self._laptops if key[0] in seen)
            found = [self._person(*key, self._laptops[key]) for key in here]
        missing = {n for n in seen if self._team(n)} - {one.user for one in found}
        away = [Person(n, self._team(n), "", "", False, []) for n in sorted(missing)]
        return found + away

    def _person(self, owner: str, host: str, one: _Laptop) -> Person:
        every = (token for session in one.sessions for token in session.tokens)
        tokens = islice(every, 2 * RUNS)  # some tokens of a run are no agent's
        runs = {_agent(token) for token in tokens if self._may_run(owner, token)}
        return Person(
            "" if owner == OWNER else owner,
            self._team(owner),
            host,
            one.since,
            one.here,
            sorted(runs - {""})[:RUNS],
        )

    def _report(self, key: tuple[str, str], line: str) -> None:
        if key[0] in self._users and key[0] != OWNER:
            self._notices.add(self.describe(*key), line, soon=True)

    def _team(self, owner: str) -> str:
        return self._users.get(owner, ("", ""))[1]

    def _may_run(self, owner: str, token: str) -> bool:
        """Return whether the router lets this user show a token; else it drops it."""
        if not self._users:
            return True
        role, team = self._users.get(owner, ("", ""))
        fabric = token.partition("/")[0]
        return role == MEMBERS or bool(team and is_of_team(team, fabric))

    def _may_stop(self, owner: str, fabric: str) -> bool:
        team = self._team(owner)
        return not team or fabric == self._fabric or is_of_team(team, fabric)


def _robots(one: "Connection") -> set[str]:
    """Return the robots of a session: `team1/robot/sim`."""
    return {robot for robot in map(_agent, one.tokens) if "/robot/" in robot}


def _agent(token: str) -> str:
    """Return `team1/robot/sim`, or `team1/clock`, for a token; "" for another one."""
    fabric, *agent = token.removesuffix("/@alive").split("/")
    kind, name = agent if len(agent) == 2 else ("", "")
    is_agent = kind in KINDS and (is_name(name) or name == "*")
    if token.endswith("/@alive") and is_name(fabric):
        return "/".join((fabric, *agent)) if is_agent or agent == ["clock"] else ""
    return ""
