"""STOP from outside: STOP is put first; then every robot is asked whether it stands.

The robots that must answer are those of the clock's roster and those in sight: the
liveliness token of a frozen host goes away while its robot drives on. No robot waits
for the clock, which may be frozen or gone.
"""

import math
import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from threading import Event
from typing import Any

from rems_net.agents.about.standing import SENT, Standing, read_standing
from rems_net.agents.protocol.limits import HOLDER
from rems_net.agents.protocol.shapes import text
from rems_net.client.answers import NONSENSE, read_flag, read_rows, read_told
from rems_net.client.client import Client, Gathered
from rems_net.errors import DeniedError, FabricError, NoRouterError, WireError, some
from rems_net.events import warn
from rems_net.router.asking import Asking, Refusal, printable
from rems_net.router.find import fabrics
from rems_net.router.gate.identity import check_member
from rems_net.router.gate.stops import who_stopped
from rems_net.router.gate.users import OWNER
from rems_net.router.keys import agent_of, is_name
from rems_net.router.mail import Mail
from rems_net.router.message import machine, pack, read
from rems_net.router.session import Session

#: s. A robot that has not answered by then is named in a warning.
SOON = 0.25
#: s. No robot is asked after this time.
LAST = 1.0
#: s. Length of the first round of questions. Each further round is twice as long, for
#: slow networks.
ROUND = 0.05
PAUSE = 0.01


@dataclass(frozen=True, slots=True)
class Receipt:
    """The answer of a robot to STOP. `tick` is -1 if the robot has not answered.

    robot: `robot/sim`     standing: what is known of its standing still
    tick, time: its newest tick, and that one's time [s of fabric time]
    machine: of a robot that has not answered; "" if unknown
    lost: seconds since the router lost it; 0.0 if it did not
    """

    robot: str
    standing: Standing = SENT
    tick: int = -1
    time: float = 0.0
    machine: str = ""
    lost: float = 0.0

    @property
    def stands(self) -> bool:
        """Whether it surely stands."""
        return self.standing.is_sure

    def __str__(self) -> str:
        if self.tick < 0:
            where = f" on {self.machine}" if self.machine else ""
            seen = f", last seen {self.lost:.0f} s ago," if self.lost else ""
            back = "it may drive on until it is back"
            return f"{self.robot}{where}{seen} has not answered: {back}"
        if self.standing.kind == "lost":
            return f"{self.robot} {self.standing}"
        verb = "stands" * self.stands or "may move"
        when = f"tick {self.tick} ({self.time:.2f} s)"
        return f"{self.robot} {verb} at {when}: {self.standing}"


def fabrics_to_stop(session: Session, *, release: bool = False) -> list[str]:
    """Return the fabrics at this router, also those whose robots were lost.

    release: those on which the router keeps a STOP, too
    """
    found = set(fabrics(session))
    for mail in session.ask(f"*/stop/{'@holds' if release else '@lost'}", timeout=SOON):
        if is_name(fabric := mail.key.partition("/")[0]):
            found.add(fabric)
    return sorted(found)


def stop_each(session: Session, fabrics: list[str]) -> None:
    """Put STOP on each of these fabrics, without waiting."""
    for name in fabrics:
        session.put(session.on(name).key("stop"), pack(True))


def stop(client: Client) -> list[Receipt]:
    """Stop every robot; return a receipt of each in the roster or in sight, by name.

    Robots that the router has lost are among them: they will stand when they are back.
    Returns when all stand, or after LAST seconds. Raises NoRouterError if the
    connection to the router was lost meanwhile.
    """
    key = client.session.key
    begun = time.monotonic()
    said: dict[str, Receipt] = {}
    named_them = False
    length = ROUND
    with client.session.asking(key("clock", "roster?format=json"), None, LAST) as asked:
        roster = _Roster(asked)
        while True:
            # A router that has just restarted may have lost the previous STOP.
            client.session.put(key("stop"), pack(True))
            roster.look({a for a in client.alive() if a.startswith("robot/")})
            ends = begun + (LAST if named_them else SOON)
            missing = roster.robots.keys() - said.keys()
            moving = {a for a in said if not said[a].stands}
            round_ends = min(time.monotonic() + length, ends)
            said |= _ask(client, missing | moving, round_ends)
            roster.look()
            silent = sorted(roster.robots.keys() - said.keys())
            if (
                roster.robots
                and not silent
                and all(said[a].stands for a in roster.robots)
                and (roster.answered or not client.is_there("clock"))
            ):
                break
            now = time.monotonic()
            if now > begun + LAST:
                break
            if now > begun + SOON and not named_them:
                named_them = True
                if silent:
                    text = f"{some(silent, 5)} has not answered within {SOON:g} s"
                    warn("silent", text)
            length *= 2
            Event().wait(PAUSE)
    if not client.session.connected:
        raise NoRouterError(
            f"The router at {client.session.link.endpoint} went away while robots "
            "were asked whether they stand. Type once more: rems stop (R0618)"
        )
    if not roster.answered and client.is_there("clock"):
        warn(
            "silent",
            "the clock does not answer: a robot that is frozen or cut off may be "
            "missing here. Look at the robots",
        )
    kept = who_stopped(client.session)
    lost = dict(kept.lost if kept is not None else ())
    return [
        said.get(a) or Receipt(a, machine=roster.robots.get(a, ""), lost=lost.get(a, 0))
        for a in sorted(roster.robots.keys() | lost.keys())
    ]


class _Roster:
    """The robots that must answer: those of the clock's roster, and those in sight.

    asked: the question for the roster. Any program can answer it: a wrong answer can
    add robots that do not exist, but cannot hide one.
    """

    def __init__(self, asked: Asking):
        self._asked = asked
        #: robot -> its machine; "" if only its token is known
        self.robots: dict[str, str] = {}
        self.answered = False

    def look(self, in_sight: Iterable[str] = ()) -> None:
        """Add the robots of the answers that have come, and the robots in sight."""
        for robot in in_sight:
            self.robots.setdefault(robot, "")
        for came in self._asked.come():
            if isinstance(came, Refusal):
                continue
            with suppress(*NONSENSE):
                for row in read_rows(came):
                    if row["kind"] == "robot":
                        self.robots[row["agent"]] = row["host"].rpartition(":")[0]
                self.answered = True


def _ask(client: Client, missing: set[str], until: float) -> dict[str, Receipt]:
    """Return the receipts that come until then, or until no robot is missing."""
    gathered = Gathered(_read_receipt)
    asked = client.session.key("robot", "*", "@stopped")
    with client.session.asking(asked, None, LAST) as asking:
        alone, missing = not missing, set(missing)
        while (missing or alone) and gathered.take(asking, until) is not None:
            missing -= {receipt.robot for receipt in gathered.values.values()}
    return {receipt.robot: receipt for receipt in gathered.values.values()}


def _read_receipt(mail: Mail) -> Receipt:
    plain: Any = read(mail.payload)
    tick, when, stopped = plain["tick"], plain["time"], plain["stopped"]
    if type(tick) is not int or tick < 0 or type(stopped) is not bool:
        raise WireError("it is no receipt (R0621)")
    if type(when) not in (int, float) or not math.isfinite(when):
        raise WireError("it is no receipt (R0621)")
    standing = read_standing(plain)
    if not stopped and standing.kind != "lost":
        standing = SENT  # STOP has not come there yet
    return Receipt(printable(agent_of(mail.key)), standing, tick, float(when))


def standings(
    session: Session, robot: str = "*", *, holds: bool = True, timeout: float = SOON
) -> list[Receipt]:
    """Return what is known of the robots, by name: which of them stand after STOP.

    holds: whether STOP holds. If not, only robots that are out of reach are returned.
    """
    key = session.key("robot", robot, "@stopped") + "?lost" * (not holds)
    found: dict[str, Receipt] = {}
    for mail in session.ask(key, timeout=timeout):
        with suppress(*NONSENSE):
            receipt = _read_receipt(mail)
            if holds or receipt.standing.kind == "lost":
                found.setdefault(receipt.robot, receipt)
    return [found[name] for name in sorted(found)]


def stop_that_holds(session: Session) -> str:
    """Return a sentence about the STOP that holds on this fabric; "" if none does."""
    if (said := who_stopped(session)) is not None:
        return said.on(session.fabric)
    tick = session.key("clock", "tick?format=json")
    for mail in session.ask(tick, timeout=SOON, first=True):
        with suppress(*NONSENSE):
            if int(read_told(mail)["stops"]) % 2:
                until = "robots must stand until `rems stop --release`"
                return f"STOP holds on {session.fabric!r}: {until}"
    return ""


def take(client: Client, robot: str) -> str:
    """Take a robot back from the run that drives it by a lease; it stands then.

    robot: `robot/wood`. Returns the name of that run; "" if no run had it. Raises
    DeniedError if the fabric does not belong to this user, FabricError if there is no
    such robot.
    """
    session = client.session
    try:
        check_member(session)
    except DeniedError:
        raise DeniedError(
            f"{robot} is on {session.fabric!r}, whose robots only a teacher takes back "
            f"from a run, by: rems stop {robot}. To stop every robot, type: rems stop"
            " (R0609)"
        ) from None
    user = session.link.user or "somebody"
    by = f"{'the teacher' if user == OWNER else user} on {machine()}"
    taker = pack((1, ascii(by)[1:-1][:HOLDER]))
    return client.ask(f"{robot}/@lease/take", _read_holder, payload=taker)


def _read_holder(mail: Mail) -> str:
    return text(read(mail.payload), "the run that had it", HOLDER)


def release(client: Client) -> list[str] | bool:
    """Let the robots obey again; return those that the clock has released, by name.

    Without a clock, ask the router that holds the STOP, and return whether it held one.
    Raises FabricError if neither a clock nor a router holds a STOP.
    """
    if client.is_there("clock"):
        released: Any = client.call("clock", "release", (), {})
        return [str(a) for a in released] if isinstance(released, list) else []
    with client.session.asking(client.session.key("stop", "@release")) as asking:
        gathered = Gathered(lambda mail: read_flag(mail, "released"))
        if gathered.take(asking, time.monotonic() + LAST) is not None:
            return any(gathered.values.values())
    raise FabricError(
        f"At {client.session.link.endpoint}: no clock and no router keeps a STOP. "
        "Start one that does: rems router serve (R0618)"
    )
