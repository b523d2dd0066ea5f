"""Commands: what was put to robots from outside, and whether they obey it.

A robot shows what it obeys, which is not yet what it was told last. So what is put is
remembered until the robot has obeyed it, or something newer: of two fields that are set
one after the other none is lost.
"""

from __future__ import annotations

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
    """A value that was put, and when its robot had it."""

    def __init__(self, value: DefDict):
        self.value = value
        #: the robot's tick when it came; it obeys at the next
        self.came: int | None = None

    def hear(self, mail: Mail) -> None:
        """The robot's answer to a question that was asked after the value was put."""
        try:
            n = mail.stamp().n
        except WireError:
            return
        if self.came is None and n >= 0:
            self.came = n


class Commands:
    """What this client has told robots."""

    def __init__(self, client: Client):
        self._client = client
        self._last: dict[str, Put] = {}
        #: how often anything was heard of STOP, once it is listened for
        self._heard: int | None = None
        #: robot -> what was heard when it was asked whether it is stopped
        self._asked: dict[str, int] = {}
        #: the robots of which it was told that they are stopped
        self._told: set[str] = set()

    def put(self, robot: str, port: str, value: DefDict) -> None:
        """Put it, remember it, and tell where STOP keeps the robot from obeying."""
        session, schema = self._client.session, value.schema
        key = session.key(robot, port)
        put = self._last[key] = Put(value)
        session.put(key, value.encode(), f"{schema.name}@{schema.digest}")
        # A robot takes its mail in order: who answers this has the value.
        session.ask_at_once(key, put.hear)
        self.tell_if_stopped(robot)

    def newest(self, robot: str, port: str, now: DefDict, n: int) -> DefDict:
        """What the robot was told last: `now`, its value at tick n, or what was put."""
        key = self._client.session.key(robot, port)
        put = self._last.get(key)
        if put is None or n < 0:  # whoever names no tick is taken at his word
            return now
        if put.came is None:
            put.came = n
        if n > put.came:
            del self._last[key]
            return now
        return put.value.copy()

    # -- STOP --------------------------------------------------------------------

    def tell_if_stopped(self, robot: str) -> None:
        """Tell, once, that a robot obeys nothing. It is asked after news of STOP."""
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
                f"{robot} is stopped: it stands still, whatever it is told, until it "
                "is released. Type: rems stop --release",
            )

    def _hear(self, mail: Mail) -> None:
        self._heard = (self._heard or 0) + 1

    def _hear_clock(self, mail: Mail) -> None:
        """`[run, stops]`: odd means that STOP holds, even that it was released."""
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
            return False  # it is gone, or some other program that knows no STOP
