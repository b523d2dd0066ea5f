"""Feed: the newest values of a fabric, for all pages together."""

from collections import deque
from collections.abc import Callable, Set
from contextlib import suppress
from typing import Any, NamedTuple

from rems_net.agents.agent import PHASES
from rems_net.dashboard.protocol import LARGEST, Value, read_report
from rems_net.errors import WireError
from rems_net.packing import pack
from rems_net.router.asking import printable
from rems_net.router.keys import is_name
from rems_net.router.mail import Mail, Mailbox, Presence
from rems_net.router.message import read
from rems_net.router.publisher import Watch
from rems_net.router.session import Session

#: channels; values of further ones are dropped
MOST = 8192
#: letters that are read for one display frame; the rest waits for the next one
AT_ONCE = 20_000
#: reports of a run that are kept
EVENTS = 200
#: what is added to the key of a command that no agent of the run has put
OUTSIDE = " (outside)"


class Channel(NamedTuple):
    """One port: its number in frames, its key without the fabric, and its schema."""

    id: int
    key: str
    #: `<schema name>@<digest>`; "" if the writer named none
    schema: str


class Feed:
    """The newest values, by channel. All methods belong to one thread.

    learn: called once for each new channel
    """

    def __init__(self, session: Session, learn: Callable[[Channel, bytes], None]):
        self._session, self._learn = session, learn
        self._box = Mailbox()
        #: agent -> port or "*", and its subscription
        self._watches: dict[str, tuple[str, Watch]] = {}
        self._wanted: set[str] = set()
        self._general: list[Watch] = []
        self.channels: list[Channel] = []
        self._numbers: dict[tuple[str, str], int] = {}
        self._known: dict[str, tuple[str, Channel]] = {}
        self.latest: dict[int, Value] = {}
        #: keys of the present agents, `robot/sim`; a crowd is `robot/*`
        self.agents: set[str] = set()
        #: the last reports of the run, each with its number
        self.events: deque[dict[str, Any]] = deque(maxlen=EVENTS)
        self.told = 0
        #: number of the run, from its ticks; 0 if none has come
        self.run = 0

    @property
    def is_open(self) -> bool:
        """Whether anything is subscribed to."""
        return bool(self._general)

    def open(self) -> None:
        """Subscribe: a page looks."""
        if self._general:
            return
        key, box = self._session.key, self._box
        self._general = [
            self._session.watch(key("clock", "tick"), box),
            self._session.watch(key("clock", "@event"), box),
            self._session.watch_presence(key("*", "*", "@alive"), box),
        ]

    def close(self) -> None:
        """Subscribe to nothing, and forget all: no page looks."""
        for watch in self._general:
            watch.close()
        for _, watch in self._watches.values():
            watch.close()
        self._general.clear()
        self._watches.clear()
        self.agents.clear()
        self._wanted.clear()
        self.forget()
        while not self._box.empty():
            self._box.get(0)

    def forget(self) -> None:
        """Forget the channels of a run that is over."""
        self.channels = []
        self._numbers.clear()
        self._known.clear()
        self.latest.clear()
        self.events.clear()
        self.run = 0

    def drain(self) -> dict[int, Value]:
        """Read all letters; return the newest value of each channel that has changed.

        `run` changes if the values are those of another run: the caller then forgets.
        """
        newest: dict[str, Mail] = {}
        for letter in self._box.letters(AT_ONCE):
            if type(letter) is Mail:
                if letter.key.endswith("/command"):
                    newest[self._of_command(letter)] = letter
                elif letter.key.endswith("/@event"):
                    self._report(letter)
                else:
                    newest[letter.key] = letter
            elif type(letter) is Presence:
                self._meet(letter)
        changed: dict[int, Value] = {}
        for key, mail in newest.items():
            self._take(key, mail, changed)
        return changed

    def _report(self, mail: Mail) -> None:
        """Keep an event of the run, if it is one."""
        with suppress(WireError):
            if mail.size <= LARGEST:
                self.events.append(read_report(mail.payload))
                self.told += 1

    def _of_command(self, mail: Mail) -> str:
        """Return the key of a command, apart if an outsider has put it.

        A robot publishes at this key the command that it obeys, with its badge.
        """
        with suppress(WireError):
            if mail.stamp().badge:
                return mail.key
        return mail.key + OUTSIDE

    def _take(self, key: str, mail: Mail, changed: dict[int, Value]) -> None:
        known = self._known.get(key)
        schema = mail.schema
        if known is None or known[0] != schema:
            channel = self._channel(key, mail)
            if channel is None:
                return
            known = self._known[key] = (schema, channel)
        channel = known[1]
        if channel.key == "clock/tick":
            with suppress(WireError):
                beat = read(mail.payload)
                if type(beat) is list and len(beat) == 7 and type(beat[0]) is int:
                    self.run = beat[0]
        stamp = mail.attachment
        payload = mail.payload if mail.size <= LARGEST else pack({"bytes": mail.size})
        if len(stamp) <= 64:
            changed[channel.id] = self.latest[channel.id] = (stamp, payload)

    def _channel(self, key: str, mail: Mail) -> Channel | None:
        """Return the channel of a key and a schema; None if there are too many."""
        short = key.removeprefix(f"{self._session.fabric}/")
        schema = mail.schema if len(mail.schema) < 256 else ""
        if mail.size > LARGEST:
            schema = "large"
        number = self._numbers.get((short, schema))
        if number is not None:
            return self.channels[number]
        if len(self.channels) >= MOST or not short.isprintable():
            return None
        channel = Channel(len(self.channels), short, printable(schema))
        self._numbers[short, schema] = channel.id
        self.channels.append(channel)
        self._learn(channel, mail.payload if mail.size <= LARGEST else b"")
        return channel

    def _meet(self, presence: Presence) -> None:
        """Subscribe to an agent that came, and no more to one that went."""
        _, kind, name, *_ = presence.key.split("/")
        agent = f"{kind}/{name}"
        if kind not in PHASES or not (name == "*" or is_name(name)):
            return
        if not presence.alive:
            self.agents.discard(agent)
            _, watch = self._watches.pop(agent, ("", None))
            if watch is not None:
                watch.close()
            return
        self.agents.add(agent)
        self._subscribe(agent)

    def want(self, agents: Set[str]) -> None:
        """Subscribe to all ports of these agents; of other robots to `state` only."""
        changed = agents ^ self._wanted
        self._wanted = set(agents)
        for agent in sorted(self.agents):
            if agent in changed or agent.endswith("/*"):
                self._subscribe(agent)

    def _subscribe(self, agent: str) -> None:
        """Subscribe to what is wanted of an agent, and ask for its values once."""
        kind, _, name = agent.partition("/")
        wanted = agent in self._wanted
        if name == "*":  # one of its members, which are no present agents
            wanted = any(
                one.startswith(f"{kind}/") for one in self._wanted - self.agents
            )
        whole = wanted or kind == "world"
        port = "*" if whole else "state" if kind == "robot" else ""
        old, watch = self._watches.pop(agent, ("", None))
        if port == old and watch is not None:
            self._watches[agent] = old, watch
            return
        if watch is not None:
            watch.close()
        if port and len(self._watches) < MOST:
            # A crowd publishes all its values in one message, unless its own keys are
            # subscribed to; that would cost twenty times as much.
            key = self._session.key(kind, "@crowd" if name == "*" else name, port)
            self._watches[agent] = port, self._session.watch(key, self._box)
            self.ask(agent, port)

    def ask(self, agent: str, port: str = "*") -> None:
        """Ask an agent for its values: a fabric that is paused puts nothing."""
        if not agent.endswith("/*"):
            self._session.ask_at_once(self._session.key(agent, port), self._box.put)
