"""Viewer: what one program of others is sent, and what it may do."""

import asyncio
import time
from collections.abc import Callable
from typing import Any

from rems_net.dashboard.pages import Visitor
from rems_net.dashboard.viewers import wire
from rems_net.dashboard.viewers.grip import Echo, Grip
from rems_net.dashboard.viewers.ports import Ports, Value
from rems_net.errors import WireError

#: channels at which a viewer publishes, and sentences that it is shown
CHANNELS = 100
#: messages a second; a viewer subscribes to many channels at once
RATE = 500
#: s. One sentence is shown so often, at most.
AGAIN = 2.0
#: sends a message to some connections, without waiting
Send = Callable[[list[Any], str | bytes], None]


class Viewer(Visitor):
    """One viewer."""

    def __init__(self, link: Any, send: Send, drive: Callable[[str], Grip]):
        super().__init__(link, RATE)
        self._send, self._drive = send, drive
        self.echo = Echo()
        #: its number of a subscription -> channel
        self.looks: dict[int, int] = {}
        #: subscriptions that wait for their first value
        self.first: set[int] = set()
        #: channels that it knows, and their version
        self.known: set[int] = set()
        self.version = -1
        #: its number of a channel -> the channel, and the agent that it drives there
        self.puts: dict[int, tuple[dict[str, Any], str]] = {}
        self.grips: dict[str, Grip] = {}
        #: names of parameters whose changes it is sent; the empty set means all
        self.follows: set[str] | None = None
        self._said: dict[str, float] = {}

    def say(self, sentence: str) -> None:
        """Show a sentence, but not again and again."""
        now = time.monotonic()
        if now > self._said.get(sentence, 0.0) + AGAIN:
            if len(self._said) > CHANNELS:
                self._said.clear()
            self._said[sentence] = now
            self.send(wire.pack_text("status", level=wire.ERROR, message=sentence))

    def send(self, message: str | bytes) -> None:
        """Send without waiting."""
        self._send([self.link], message)

    # -- what it sends ------------------------------------------------------------

    def obey(
        self, message: str | bytes, ports: Ports
    ) -> tuple[int, int, bytes] | dict[str, Any] | None:
        """Do what a message asks for, if that takes no time.

        Return a called service, the call and its arguments; or a message about
        parameters. Raises WireError.
        """
        if isinstance(message, bytes):
            what, numbers, rest = wire.read_binary(message)
            if what == "call":
                return numbers[0], numbers[1], rest
            self._put(numbers[0], rest)
            return None
        words = wire.read_text(message)
        match words.get("op"):
            case "subscribe":
                for row in wire.read_rows(words, "subscriptions"):
                    channel = row.get("channelId")
                    if channel in ports.channels:
                        self.looks[row["id"]] = channel
                        self.first.add(row["id"])
            case "unsubscribe":
                for number in _numbers(words, "subscriptionIds"):
                    self.looks.pop(number, None)
                    self.first.discard(number)
            case "advertise":
                for row in wire.read_rows(words, "channels"):
                    self._advertise(row)
            case "unadvertise":
                for number in _numbers(words, "channelIds"):
                    _, agent = self.puts.pop(number, ({}, ""))
                    if (grip := self.grips.pop(agent, None)) is not None:
                        grip.let_go()
            case op if op in wire.PARAMETERS:
                return words
            case op:
                raise WireError(f"This server does not know {op!r:.40}. (R1003)")
        return None

    def _advertise(self, row: dict[str, Any]) -> None:
        if len(self.puts) >= CHANNELS:
            raise WireError(f"A viewer drives at most {CHANNELS} robots. (R1004)")
        self.puts.pop(row["id"], None)
        self.puts[row["id"]] = row, wire.read_topic(row)

    def _put(self, number: int, message: bytes) -> None:
        """Drive by a published message."""
        if number not in self.puts:
            return  # it was shown why when it named the channel
        channel, agent = self.puts[number]
        grip = self.grips.get(agent)
        try:
            stick = wire.read_stick(channel, message)
        except WireError:
            if grip is not None:
                grip.rest()
            raise
        if grip is None:
            grip = self.grips[agent] = self._drive(agent)
        now = time.monotonic()
        if self.echo.is_new(now):
            grip.take(stick, now)
        elif not any(stick.values()):
            grip.rest()
        else:
            grip.hold(now)

    # -- what it is sent ----------------------------------------------------------

    def tell(self, ports: Ports) -> None:
        """Send the channels that came, and those that went."""
        if self.version == ports.version:
            return
        self.version = ports.version
        gone = self.known - ports.channels.keys()
        come = ports.channels.keys() - self.known
        self.known = set(ports.channels)
        self.looks = {s: c for s, c in self.looks.items() if c not in gone}
        self.first &= self.looks.keys()
        if gone:
            self.send(wire.pack_text("unadvertise", channelIds=sorted(gone)))
        if come:
            told = [ports.channels[number] for number in sorted(come)]
            self.send(wire.pack_text("advertise", channels=told))

    def show(self, changed: dict[int, Value], ports: Ports) -> None:
        """Send the values that have changed; if it is too slow, the newest later."""
        if self.is_full:
            self.first |= self.looks.keys()
            return
        messages = []
        for subscription, channel in self.looks.items():
            value = changed.get(channel)
            if value is None and subscription in self.first:
                value = ports.latest.get(channel)
            if value is not None:
                self.first.discard(subscription)
                messages.append(wire.pack_value(subscription, *value))
        for message in messages:
            self.send(message)
        if messages:
            self.send(wire.pack_time(ports.time))

    async def look(self, gone: set[str], now: float) -> None:
        """Let go for a viewer that is silent, or whose network is held up."""
        for agent, grip in [*self.grips.items()]:
            if agent in gone:
                grip.leave()
            grip.look(now)
            if grip.is_over(now):
                del self.grips[agent]
        if self.grips and (number := self.echo.beat(now)) is not None:
            pong = await self.link.ping(number.to_bytes(4, "big"))
            asyncio.ensure_future(pong).add_done_callback(
                lambda done: self._answered(number, done)
            )

    def _answered(self, number: int, pong: asyncio.Future[float]) -> None:
        if not pong.cancelled() and pong.exception() is None:
            self.echo.came(number, time.monotonic())

    def let_go(self) -> None:
        """Let go of all robots."""
        for grip in self.grips.values():
            grip.let_go()
        self.grips.clear()


def _numbers(words: dict[str, Any], name: str) -> list[int]:
    found = words.get(name)
    plain = found if isinstance(found, list) else []
    return [number for number in plain if type(number) is int]
