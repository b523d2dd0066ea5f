"""Driving: a person's hand on one robot, until the hand lets go or goes away.

Only one person drives a robot: they have its lease, and the robot obeys commands with
the number of this lease only. Each command has the tick of the newest state that its
driver saw, so a robot ignores commands that were given to an old picture.
"""

import time
from collections.abc import Callable, Mapping, Set
from contextlib import suppress
from getpass import getuser
from secrets import randbelow
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from rems_net.defdict import DefDict, Schema
from rems_net.errors import FabricError, RemsError
from rems_net.router.asking import Refusal, printable
from rems_net.router.mail import Mail
from rems_net.router.message import (
    BADGES,
    UNSTAMPED,
    Stamp,
    machine,
    pack,
    pack_stamp,
    read,
)
from rems_net.teleop.keys import KEYBOARD, KEYS
from rems_net.teleop.stick import STICK, check_drivable

if TYPE_CHECKING:
    from rems_net.client.fabric import Fabric

#: s. Time for a robot to answer a claim of its lease.
CLAIM_TIMEOUT = 2.0
#: s. Time between two claims: a lease ends after 1 s without one.
RENEWAL = 0.25
#: s. A hand that holds its stick still reports it so often: a robot obeys a command for
#: 0.5 s.
PERIOD = 0.05
#: s. In a pause ticks do not grow old. Commands of a pause count as older by this, so
#: they move little when time goes on, if their sender is not there any more.
PAUSED = 0.3
#: A pause begins after so many times the time between two states, and so many s.
PERIODS, SILENT = 3, 0.1
#: s. At the end we wait this long for the robot to take its lease back.
FAREWELL = 0.3
#: characters of a holder's name; a board has room for this many
HOLDER = 100


def _user() -> str:
    try:
        return getuser()
    except (KeyError, OSError):  # a user without a name, as in containers
        return "somebody"


class Other(NamedTuple):
    """Another person: who they are, and in how many seconds the robot is handed over.

    drives: whether they have the robot now, and we wait; else they wait for us.
    """

    name: str
    left: float
    drives: bool


class Driving:
    """One person's hand on one robot, or on an input that a hand moves.

    Its caller calls `send` when the hand moves, at least every 0.25 s while it holds a
    motion, and `keep` as often while it does not. Nothing here has a thread of its own:
    a caller that hangs drives no robot.

    key: `robot/sim`, `input/stick`.  by: name of the person.
    """

    def __init__(self, fabric: "Fabric", key: str, by: str = ""):
        self.key, self._fabric = key, fabric
        user = by or fabric.session.link.user or _user()
        self._by = ascii(f"{user} on {machine()}")[1:-1][:HOLDER]
        self._badge = 1 + randbelow(BADGES - 1)
        #: whether it has the lease
        self.drives = False
        #: another person who drives, or wants to
        self.other: Other | None = None
        #: name of the person who took the robot; "" if nobody did
        self.taken = ""
        #: why the robot refuses; "" if it does not
        self.refused = ""
        #: tick and time of the newest state that came, and the state
        self.seen: Stamp = UNSTAMPED
        self._newest: Mail | None = None
        #: s of this machine: when the newest state came, and how long after another
        self._came = self._apart = 0.0
        self._resting = True

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def open(self) -> None:
        """Find the robot and ask for its lease, once.

        Raises FabricError if it is not there or may not be driven from here,
        ExperimentError if a stick cannot drive it. If another person drives it, `other`
        names them; `keep` asks again.
        """
        session = self._fabric.session
        schemas = self._fabric.schemas(self.key)
        self._command, self._state = self._ports(schemas)
        self._schema = schemas.get(self._state)
        full = session.key(self.key, "command")
        schema = self._command
        self._put: Callable[..., None] = session.putting(
            full, f"{schema.name}@{schema.digest}", block=False, remote=True
        )
        self._make = self._maker()
        self._watch = session.watch_at_once(
            session.key(self.key, self._state), self._hear
        )
        self._lease = session.key(self.key, "@lease", "drive")
        self._ask()
        if not (self.drives or self.other or self.refused):
            # a board, or an older rems_net, knows one kind of lease only
            self._lease = session.key(self.key, "@lease")
            self._ask()
        if self.refused:
            raise FabricError(f"{self.key}: {self.refused}")
        if not (self.drives or self.other):
            raise FabricError(
                f"{self.key} did not answer for {CLAIM_TIMEOUT:g} s; it is frozen or "
                f"cut off. Type: rems why {self.key} (R0602)"
            )

    def _ports(self, schemas: Mapping[str, Schema]) -> tuple[Schema, str]:
        """Return the schema of its command, and the port whose values are watched."""
        value = schemas.get("value")
        if self.key.startswith("input/") and value in (STICK, KEYBOARD):
            assert value is not None
            return value, "value"
        if not self.key.startswith("robot/") or "command" not in schemas:
            raise FabricError(
                f"{self.key} cannot be driven: expected a robot, or an input of type "
                "hand or keyboard. Type: rems list (R0620)"
            )
        return schemas["command"], "state"

    def _maker(self) -> Callable[[Mapping[str, float], Set[str]], DefDict]:
        """Return a function that makes the command of a stick, or of held keys."""
        if self._command == KEYBOARD:
            return lambda stick, held: KEYBOARD({name: name in held for name in KEYS})
        if self._command == STICK:
            return lambda stick, held: STICK(dict(stick))
        rule = check_drivable(self._command, self.key)
        convert = STICK.converter(self._command, (rule,), missing="default")
        return lambda stick, held: convert(STICK(dict(stick)))

    def _ask(self) -> None:
        session = self._fabric.session
        claim = pack((self._badge, self._by))
        with session.asking(self._lease, claim, CLAIM_TIMEOUT) as asking:
            came = asking.next(time.monotonic() + CLAIM_TIMEOUT)
        if isinstance(came, Refusal):
            self.refused = str(came)
        elif isinstance(came, Mail):
            self._granted(came)

    def keep(self) -> None:
        """Renew the lease, or ask for it again, without waiting for the answer."""
        if not self.taken:
            claim = pack((self._badge, self._by))
            session = self._fabric.session
            session.ask_at_once(self._lease, self._granted, CLAIM_TIMEOUT, claim)

    def send(
        self,
        stick: Mapping[str, float],
        held: Set[str] = frozenset(),
        seen: tuple[int, float] | None = None,
    ) -> None:
        """Publish what the hand does now.

        stick: percent of each axis, see `STICK`.  held: names of the keys that are held
        down, for a keyboard's input.  seen: tick and time [s] of the state that the
        person saw; without it, of the newest that came here. Nothing is published
        before a state has come. At rest it is published once.
        """
        value = self._make(stick, held)
        at_rest = value == self._command()
        newest = self.seen
        if newest.n < 0 or not self.drives or (at_rest and self._resting):
            return
        # Standing still is right, even for a person who saw an old picture.
        n, t = (newest.n, newest.t) if seen is None or at_rest else seen
        quiet = time.monotonic() - self._came
        if quiet > PERIODS * self._apart + SILENT and t > PAUSED and not at_rest:
            n, t = n - round(PAUSED * n / t), t - PAUSED
        if 0 <= n <= newest.n:
            self._resting = at_rest
            self._put(value.encode(), attachment=pack_stamp(n, t, self._badge))

    def state(self) -> DefDict | None:
        """Return the newest state that came, if one did."""
        newest, schema = self._newest, self._schema
        if newest is None or schema is None:
            return None
        try:
            return schema.decode(newest.payload)
        except RemsError:
            return None  # any program can publish anything there

    def rest(self) -> None:
        """Let go: publish the safe command, once."""
        self.send(STICK())

    def close(self) -> None:
        """Let go, and give the lease back."""
        session = self._fabric.session
        with suppress(RemsError):
            self.rest()
            claim = pack((self._badge, ""))
            session.ask(self._lease, claim, FAREWELL, first=True)
            self._watch.close()

    # -- in threads of the session -----------------------------------------------

    def _granted(self, mail: Mail) -> None:
        """Read the answer to a claim."""
        try:
            said: Any = read(mail.payload)
        except RemsError:
            return  # any program can answer anything
        other = None
        if isinstance(said, str):
            self.taken, self.drives = printable(said), False
        elif isinstance(said, list) and len(said) == 3:
            way, name, left = said
            if isinstance(name, str) and isinstance(left, float):
                other = Other(printable(name), left, way == "driven")
                self.drives = not other.drives
        elif isinstance(said, float):
            self.drives = True
        self.other = other

    def _hear(self, mail: Mail) -> None:
        with suppress(RemsError):
            stamp = mail.stamp()
            if stamp.n >= 0:
                now = time.monotonic()
                self._apart = now - self._came if self._came else 0.0
                self._came = now
                self._newest, self.seen = mail, stamp
