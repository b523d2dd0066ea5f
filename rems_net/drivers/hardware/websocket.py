"""WebSocket: either end of one, as a line: messages are bytes, whatever they hold.

It stands on the protocol of `websockets` alone. The connections of that library decode
every text as UTF-8, and close where it is none; small devices send bytes as text.
"""

from __future__ import annotations

import socket
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from rems_net.agents.wall import wall
from rems_net.libraries import load

if TYPE_CHECKING:
    from websockets import protocol as speaking

    from rems_net.drivers.hardware.held import HeldSocket

    Link = socket.socket | HeldSocket

#: bytes of the longest message that is taken
LONGEST = 4096
#: what a frame says that it is
TEXT, BINARY = 1, 2
#: the code of a connection that has done its work
NORMAL = 1000
#: seconds that a message may wait for room on its way
SENDING = 0.25
EXTRA = "hardware"


class Message(NamedTuple):
    """What came: bytes, and whether they were said to be text."""

    text: bool
    data: bytes


def reach(address: tuple[str, int], timeout: float) -> socket.socket:
    """Connect to a server. Raises OSError."""
    link = socket.create_connection(address, timeout)
    link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return link


def framed(data: bytes) -> bytes:
    """Return the bytes of one binary message of a client, as they go over a line."""
    frames = load("websockets.frames", EXTRA)
    made: bytes = frames.Frame(frames.Opcode.BINARY, data).serialize(mask=True)
    return made


class WebSocket:
    """A socket, and the protocol that is spoken over it: one user, and no thread.

    A message that comes in several frames is not put together: devices send none.
    """

    def __init__(self, link: Link, protocol: speaking.Protocol):
        self.link, self.protocol = link, protocol
        self.came: deque[Message] = deque()

    @classmethod
    def connect(
        cls,
        url: str,
        seconds: float,
        reach: Callable[[tuple[str, int], float], Link] = reach,
    ) -> Self:
        """Reach a server. Raises OSError if there is none, or it speaks otherwise.

        reach: connects to (host, port) within so many seconds.
        """
        uri = load("websockets.uri", EXTRA).parse_uri(url)
        protocol = load("websockets.client", EXTRA).ClientProtocol(
            uri, max_size=LONGEST
        )
        if seconds <= 0:
            raise TimeoutError("no answer in time")
        until = wall() + seconds
        link = reach((uri.host, uri.port), seconds)
        made = cls(link, protocol)
        try:
            protocol.send_request(protocol.connect())
            made.flush()
            while protocol.state.name == "CONNECTING":
                made._take_in(until - wall())
                if protocol.handshake_exc is not None:
                    raise ConnectionError(
                        f"what answers there is no WebSocket: {protocol.handshake_exc}"
                    )
        except BaseException:
            link.close()
            raise
        return made

    @classmethod
    def accept(cls, link: socket.socket) -> Self:
        """Be the server of whoever has connected; `asked` is set by his request."""
        library = load("websockets.server", EXTRA)
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return cls(link, library.ServerProtocol(max_size=LONGEST))

    @property
    def open(self) -> bool:
        """Whether messages can be sent."""
        return self.protocol.state.name == "OPEN"

    def send(self, data: bytes, text: bool = False) -> None:
        """Send one message. Raises OSError where it cannot be."""
        if not self.open:
            raise ConnectionError("the other side has closed the connection")
        (self.protocol.send_text if text else self.protocol.send_binary)(data)
        self.flush()

    def receive(self, seconds: float) -> Message:
        """Return the next message; raises TimeoutError where none comes so long.

        Raises ConnectionError once the other side has closed the connection.
        """
        until = wall() + seconds
        while not self.came:
            self._take_in(until - wall())
        return self.came.popleft()

    def flush(self) -> None:
        """Write what the protocol has to say."""
        self.link.settimeout(SENDING)
        try:
            for data in self.protocol.data_to_send():
                if data:
                    self.link.sendall(data)
                else:
                    self.link.shutdown(socket.SHUT_WR)
        except TimeoutError:
            # Half a frame is on its way: what comes behind it would be read as its end.
            raise ConnectionError("the other side takes nothing more") from None

    def close(self) -> None:
        """Say goodbye, and give the socket back, without waiting for an answer.

        What was sent before goes first. A socket that is closed with bytes unread
        forgets what it has not sent yet, so these are read.
        """
        with suppress(OSError):
            if self.open:
                self.protocol.send_close(NORMAL)
                self.flush()
            self.link.shutdown(socket.SHUT_WR)
            self.link.settimeout(0.0)
            while self.link.recv(LONGEST):
                pass
        self.link.close()

    def _take_in(self, seconds: float) -> None:
        """Read once, waiting at most so long, and answer what the protocol answers."""
        if self.protocol.state.name == "CLOSED":
            raise ConnectionError("the other side has closed the connection")
        if seconds <= 0:
            raise TimeoutError("no answer in time")
        self.link.settimeout(seconds)
        try:
            data = self.link.recv(LONGEST)
        except TimeoutError:
            raise TimeoutError("no answer in time") from None
        self.feed(data)

    def feed(self, data: bytes) -> list[object]:
        """Take in what was read, b"" for the end; return what is no message."""
        if data:
            self.protocol.receive_data(data)
        else:
            self.protocol.receive_eof()
        others: list[object] = []
        event: Any
        for event in self.protocol.events_received():
            opcode = getattr(event, "opcode", None)
            if opcode in (TEXT, BINARY):
                self.came.append(Message(opcode == TEXT, bytes(event.data)))
            else:
                others.append(event)
        self.flush()
        return others
