"""Ports: what a fabric's agents publish, as channels for viewers, in CDR."""

from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from typing import Any

from rems_net.agents.agent import PHASES
from rems_net.client import Fabric
from rems_net.dashboard.feed import AT_ONCE
from rems_net.defdict import Batch, Schema
from rems_net.defdict.wire.cdr import cdr
from rems_net.defdict.wire.ros2msg import ros2msg, type_name
from rems_net.errors import RemsError, WireError
from rems_net.recordings.mcap.derived import POSES, TF, Poses, has_pose
from rems_net.router.keys import is_name
from rems_net.router.mail import Mail, Mailbox, Presence
from rems_net.router.publisher import Watch

#: number of the channel /tf, with the pose of each robot whose state has x, y and
#: heading; those of ports are greater
FRAMES = 1
#: channels; further ports are left out
MOST = 8192
#: agents of a kind. A crowd that makes them more is left out: each value of it would
#: be a message.
MANY = 100
#: bytes. Larger values are left out.
LARGEST = 1 << 20
#: time [ns] and message of a value
Value = tuple[int, bytes]


class Port:
    """One port of one agent; subscribed to while a viewer looks."""

    def __init__(self, number: int, agent: str, name: str, schema: Schema):
        self.id, self.agent, self.schema = number, agent, schema
        self.key = f"{agent}/{name}"
        self.transcode: Callable[[bytes], bytes] = cdr(schema).transcode
        self.watch: Watch | None = None
        about = type_name(name, schema), ros2msg(name, schema)
        #: its channel, as viewers receive it
        self.channel = _channel(number, self.key, *about)


def _channel(number: int, key: str, name: str, text: str) -> dict[str, Any]:
    """Return a channel for viewers, by the name and the text of its type."""
    found = {"id": number, "topic": f"/{key}", "encoding": "cdr", "schemaName": name}
    return found | {"schemaEncoding": "ros2msg", "schema": text}


class Ports:
    """Channels of the agents that are there, and their newest values.

    All methods belong to one thread. ask: calls a function in another thread.
    """

    def __init__(
        self, fabric: Fabric, ask: Callable[[Callable[[], Any]], Future[Any]]
    ) -> None:
        self.fabric, self._ask = fabric, ask
        self._box = Mailbox()
        self._ended: list[tuple[str, Future[dict[str, Schema]]]] = []
        #: by kind, agents of crowds, and the question who is in them
        self._crowds: dict[str, set[str]] = {}
        self._asked: dict[str, Future[list[dict[str, Any]]]] = {}
        self._by_key: dict[str, Port] = {}
        self._next = FRAMES + 1
        #: agents that are there, and that have gone
        self.agents: set[str] = set()
        self.gone: set[str] = set()
        self.channels = {FRAMES: _channel(FRAMES, POSES, *TF)}
        #: channels that viewers want, and numbers of those with the pose of a robot
        self._wanted: set[int] = set()
        self._posed: dict[int, Port] = {}
        self._poses = Poses({})
        #: grows when channels come or go
        self.version = 0
        self.latest: dict[int, Value] = {}
        #: the fabric's time [ns]
        self.time = 0
        session = fabric.session
        self._general = [
            session.watch_presence(session.key("*", "*", "@alive"), self._box),
            session.watch(session.key("clock", "tick"), self._box),
        ]

    def close(self) -> None:
        """Subscribe to nothing."""
        for watch in self._general:
            watch.close()
        for port in self._by_key.values():
            if port.watch is not None:
                port.watch.close()

    def want(self, wanted: set[int]) -> None:
        """Subscribe to these channels, and to no others."""
        self._wanted = wanted
        self._subscribe()

    def _subscribe(self) -> None:
        session = self.fabric.session
        wanted = self._wanted.union(self._posed if FRAMES in self._wanted else ())
        for port in self._by_key.values():
            if port.id in wanted and port.watch is None:
                key = session.key(port.key)
                port.watch = session.watch(key, self._box)
                session.ask_at_once(key, self._box.put)  # a paused fabric puts nothing
            elif port.id not in wanted and port.watch is not None:
                port.watch.close()
                port.watch = None
                self.latest.pop(port.id, None)

    def drain(self) -> dict[int, Value]:
        """Read all letters; return the newest value of each that has changed."""
        newest: dict[str, Mail] = {}
        for letter in self._box.letters(AT_ONCE):
            if type(letter) is Mail:
                newest[letter.key] = letter
            elif type(letter) is Presence:
                self._meet(letter)
        self._learn()
        changed: dict[int, Value] = {}
        begin = len(self.fabric.session.fabric) + 1
        for key, mail in newest.items():
            port = self._by_key.get(key[begin:])
            with suppress(RemsError):  # it cannot be read, or is too large
                if port is not None and port.watch is not None:
                    changed[port.id] = self._value(port, mail)
                elif key.endswith("/clock/tick"):
                    self.time = self._time(mail)
        self.latest |= changed
        if FRAMES in self._wanted and self._posed.keys() & changed:
            self._add_frames(changed)
        return changed

    def _add_frames(self, changed: dict[int, Value]) -> None:
        """Add the newest poses of all robots."""
        known = self._posed.keys() & self.latest.keys()
        states = {self._posed[one].key: self.latest[one][1] for one in known}
        t = max(self.latest[one][0] for one in known)
        changed[FRAMES] = self.latest[FRAMES] = t, self._poses(Batch(states), t)

    def _value(self, port: Port, mail: Mail) -> Value:
        digest = mail.schema.rpartition("@")[2]
        if mail.size > LARGEST or digest not in ("", port.schema.digest):
            raise WireError("It is too large, or of another type. (R1003)")
        t = self._time(mail)
        self.time = max(self.time, t)
        return t, port.transcode(mail.payload)

    def _time(self, mail: Mail) -> int:
        """Return the time [ns] of a value; if it has none, the newest known one."""
        stamp = mail.stamp()
        known = stamp.n >= 0 and stamp.t >= 0
        return round(stamp.t * 1e9) if known else self.time

    def _meet(self, presence: Presence) -> None:
        """Ask an agent that came for its types; forget one that went."""
        _, kind, name, *_ = presence.key.split("/")
        if kind in PHASES and name == "*":  # a crowd, or one of several
            for agent in self._crowds.pop(kind, ()):
                self._leave(agent)
            self._asked[kind] = self._ask(self.fabric.agents)
        elif kind in PHASES and is_name(name):
            agent = f"{kind}/{name}"
            (self._come if presence.alive else self._leave)(agent)

    def _come(self, agent: str) -> None:
        self._forget(agent)
        self.agents.add(agent)
        self.gone.discard(agent)
        self._ended.append((agent, self._ask(lambda: self.fabric.schemas(agent))))

    def _leave(self, agent: str) -> None:
        self._forget(agent)
        self.agents.discard(agent)
        self.gone.add(agent)

    def _meet_crowds(self) -> None:
        """Take in the agents of crowds whose names have come."""
        for kind, asked in list(self._asked.items()):
            if asked.done():
                del self._asked[kind]
                with suppress(RemsError, CancelledError):
                    rows = (row for row in asked.result() if row["kind"] == kind)
                    every = {row["agent"] for row in rows}
                    some = every - self.agents if len(every) <= MANY else set()
                    self._crowds[kind] = some
                    for agent in sorted(some):
                        self._come(agent)

    def _forget(self, agent: str) -> None:
        gone = [one for one in self._by_key.values() if one.agent == agent]
        for port in gone:
            del self.channels[port.id], self._by_key[port.key]
            self.latest.pop(port.id, None)
            if port.watch is not None:
                port.watch.close()
        if gone:
            self._meet_poses()
            self.version += 1

    def _learn(self) -> None:
        """Make channels of the types that have come."""
        self._meet_crowds()
        waiting = []
        for agent, asked in self._ended:
            if not asked.done():
                waiting.append((agent, asked))
            elif agent in self.agents and not asked.cancelled():
                with suppress(RemsError):
                    self._make(agent, asked.result())
        self._ended = waiting

    def _make(self, agent: str, schemas: dict[str, Schema]) -> None:
        for name, schema in schemas.items():
            if len(self.channels) < MOST and f"{agent}/{name}" not in self._by_key:
                port = Port(self._next, agent, name, schema)
                self._next += 1
                self.channels[port.id], self._by_key[port.key] = port.channel, port
                self.version += 1
        self._meet_poses()

    def _meet_poses(self) -> None:
        """Look for the ports with poses, and subscribe if a viewer wants them."""
        ports = self._by_key.values()
        posed = [one for one in ports if has_pose(one.key, one.schema)]
        self._poses = Poses({one.key: one.schema for one in posed})
        self._posed = {one.id: one for one in posed}
        self._subscribe()
