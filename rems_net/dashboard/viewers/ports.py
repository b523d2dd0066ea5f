"""Ports: what a fabric's agents publish, as channels for viewers, in CDR."""

from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from typing import Any

from rems_net.agents.agent import PHASES
from rems_net.client import Fabric
from rems_net.dashboard.feed import AT_ONCE
from rems_net.dashboard.viewers.frames import FRAMES, Frames
from rems_net.defdict import Schema
from rems_net.defdict.wire.cdr import cdr
from rems_net.defdict.wire.ros2msg import ros2msg, type_name
from rems_net.errors import RemsError, WireError
from rems_net.router.keys import is_name
from rems_net.router.mail import Mail, Mailbox, Presence
from rems_net.router.publisher import Watch

#: channels; further ports are left out
MOST = 8192
#: agents of a kind. A crowd that makes them more is left out: each value of it would
#: be a message.
MANY = 100
#: bytes. Larger values are left out.
LARGEST = 1 << 20
#: time [ns] and message of a value
Value = tuple[int, bytes]


class Channel:
    """One port of one agent, with its type; subscribed to while a viewer looks."""

    def __init__(self, number: int, agent: str, port: str, schema: Schema):
        self.id, self.agent, self.schema = number, agent, schema
        self.key = f"{agent}/{port}"
        self.digest = schema.digest
        self.transcode: Callable[[bytes], bytes] = cdr(schema).transcode
        self.watch: Watch | None = None
        self.told = {
            "id": number,
            "topic": f"/{self.key}",
            "encoding": "cdr",
            "schemaName": type_name(port, schema),
            "schemaEncoding": "ros2msg",
            "schema": ros2msg(port, schema),
        }


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
        self._by_key: dict[str, Channel] = {}
        self._next = FRAMES + 1
        #: agents that are there, and that have gone
        self.agents: set[str] = set()
        self.gone: set[str] = set()
        self._frames = Frames()
        self.channels: dict[int, Channel | Frames] = {FRAMES: self._frames}
        #: channels that viewers want, and numbers of those with the pose of a robot
        self._wanted: set[int] = set()
        self._posed: set[int] = set()
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
        for channel in self.channels.values():
            if channel.watch is not None:
                channel.watch.close()

    def want(self, wanted: set[int]) -> None:
        """Subscribe to these channels, and to no others."""
        self._wanted = wanted
        self._subscribe()

    def _subscribe(self) -> None:
        session = self.fabric.session
        wanted = self._wanted | (self._posed if FRAMES in self._wanted else set())
        for number, channel in self.channels.items():
            if number == FRAMES:
                continue
            if number in wanted and channel.watch is None:
                key = session.key(channel.key)
                channel.watch = session.watch(key, self._box)
                session.ask_at_once(key, self._box.put)  # a paused fabric puts nothing
            elif number not in wanted and channel.watch is not None:
                channel.watch.close()
                channel.watch = None
                self.latest.pop(number, None)

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
            channel = self._by_key.get(key[begin:])
            with suppress(RemsError):  # it cannot be read, or is too large
                if channel is not None and channel.watch is not None:
                    changed[channel.id] = self._value(channel, mail)
                elif key.endswith("/clock/tick"):
                    self.time = self._time(mail)
        self.latest |= changed
        if FRAMES in self._wanted and not self._posed.isdisjoint(changed):
            self._add_frames(changed)
        return changed

    def _add_frames(self, changed: dict[int, Value]) -> None:
        """Add the newest poses of all robots."""
        known = self._posed & self.latest.keys()
        states = {self.channels[one].key: self.latest[one][1] for one in known}
        t = max(self.latest[one][0] for one in known)
        value = t, self._frames.message(states, t)
        changed[FRAMES] = self.latest[FRAMES] = value

    def _value(self, channel: Channel, mail: Mail) -> Value:
        if mail.size > LARGEST or mail.schema.rpartition("@")[2] not in (
            "",
            channel.digest,
        ):
            raise WireError("It is too large, or of another type. (R1003)")
        t = self._time(mail)
        self.time = max(self.time, t)
        return t, channel.transcode(mail.payload)

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
        gone = [one for one in self.channels.values() if one.agent == agent]
        for channel in gone:
            del self.channels[channel.id], self._by_key[channel.key]
            self.latest.pop(channel.id, None)
            if channel.watch is not None:
                channel.watch.close()
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
        for port, schema in schemas.items():
            if len(self.channels) < MOST and f"{agent}/{port}" not in self._by_key:
                channel = Channel(self._next, agent, port, schema)
                self._next += 1
                self.channels[channel.id] = self._by_key[channel.key] = channel
                self.version += 1
        self._meet_poses()

    def _meet_poses(self) -> None:
        """Look for the ports with poses, and subscribe if a viewer wants them."""
        schemas = {key: one.schema for key, one in self._by_key.items()}
        posed = self._frames.meet(schemas)
        self._posed = {self._by_key[key].id for key in posed}
        self._subscribe()
