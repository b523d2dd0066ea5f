"""Commands from outside the run: remember each one until its robot obeys it.

A robot publishes the command that it obeys, which may be older than the newest one
sent. A program that sets two fields one after the other would lose the first, so a
command is remembered until the robot obeys it or a newer one.
"""

from typing import TYPE_CHECKING

from rems_net.client.answers import read_flag
from rems_net.defdict import DefDict
from rems_net.errors import FabricError, WireError
from rems_net.events import warn
from rems_net.router.mail import Mail
from rems_net.router.message import read

if TYPE_CHECKING:
    from rems_net.client.client import Client


class Put:
    """A command that was put, and the robot's tick when it arrived."""

    def __init__(self, value: DefDict):
        self.value = value
        #: tick of the robot when the command arrived; the robot obeys it at the next
        #: tick
        self.came: int | None = None

    def hear(self, mail: Mail) -> None:
        """Note the tick of the robot's answer to a question sent after the command."""
        try:
            n = mail.stamp().n
        except WireError:
            return
        if self.came is None and n >= 0:
            self.came = n


class Commands:
    """The commands that this client has put."""

    def __init__(self, client: "Client"):
        self._client = client
        self._last: dict[str, Put] = {}
        #: number of messages about STOP; None before the subscription
        self._heard: int | None = None
        #: robot -> number of messages about STOP when the robot was last asked
        self._asked: dict[str, int] = {}
        #: robots of which a warning was given that they are stopped
        self._told: set[str] = set()

    def put(self, robot: str, port: str, value: DefDict) -> None:
        """Put and remember a command; warn if STOP keeps the robot from obeying."""
        session, schema = self._client.session, value.schema
        key = session.key(robot, port)
        put = self._last[key] = Put(value)
        session.put(key, value.encode(), f"{schema.name}@{schema.digest}")
        # A robot takes its mail in order: when it answers this, it has the value.
        session.ask_at_once(key, put.hear)
        self.tell_if_stopped(robot)

    def newest(self, robot: str, port: str, now: DefDict, n: int) -> DefDict:
        """Return the newest command: `now`, of tick n, or a newer one put here."""
        key = self._client.session.key(robot, port)
        put = self._last.get(key)
        # without a tick in the answer, the value counts as current
        if put is None or n < 0:
            return now
        if put.came is None:
            put.came = n
        if n > put.came:
            del self._last[key]
            return now
        return put.value.copy()

    def tell_if_stopped(self, robot: str) -> None:
        """Warn once that a robot is stopped; ask the robot again after news of STOP."""
        if self._heard is None:
            self._heard = 0
            session = self._client.session
            session.watch_at_once(session.key("stop"), self._hear)
            session.watch_at_once(session.key("clock", "stops"), self._hear_clock)
        heard = self._heard
        if self._asked.get(robot) == heard:
            return
        self._asked[robot] = heard
        if robot not in self._told and self._is_stopped(robot):
            self._told.add(robot)
            warn(
                "stop",
                f"{robot} is stopped: it stands still, and obeys no command, until it "
                "is released. Type: rems stop --release",
            )

    def _hear(self, mail: Mail) -> None:
        self._heard = (self._heard or 0) + 1

    def _hear_clock(self, mail: Mail) -> None:
        """Read `[run, stops]`: an odd count holds STOP, an even one releases it."""
        try:
            _, stops = read(mail.payload)
            released = stops % 2 == 0
        except (WireError, TypeError, ValueError):
            return
        if released:
            self._told.clear()
        else:
            self._hear(mail)

    def _is_stopped(self, robot: str) -> bool:
        try:
            return self._client.ask(
                f"{robot}/@stopped", lambda m: read_flag(m, "stopped")
            )
        except FabricError:
            return False  # it has gone, or is a program without STOP
