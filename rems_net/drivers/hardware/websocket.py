"""WebSocket: either end of a WebSocket, as a line of messages of any bytes.

It uses only the protocol part of `websockets`. The connections of that library decode
every text as UTF-8, and close if that fails; small devices send bytes as text.
"""

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

#: bytes of the longest message that is accepted
LONGEST = 4096
#: opcodes of frames
TEXT, BINARY = 1, 2
#: close code of a connection that ends as intended
NORMAL = 1000
#: s. Sending a message may block this long.
SENDING = 0.25
EXTRA = "hardware"


class Message(NamedTuple):
    """A message that came: its bytes, and whether its frame was a text frame."""

    text: bool
    data: bytes


def framed(data: bytes) -> bytes:
    """Return one binary message of a client as the bytes of its frame."""
    frames = load("websockets.frames", EXTRA)
    made: bytes = frames.Frame(frames.Opcode.BINARY, data).serialize(mask=True)
    return made


class WebSocket:
    """A socket with the WebSocket protocol, for one user and without a thread.

    A message in several frames is not put together: devices send none.
    """

    def __init__(self, link: "Link", protocol: "speaking.Protocol"):
        self.link, self.protocol = link, protocol
        self.came: deque[Message] = deque()

    @classmethod
    def connect(
        cls,
        url: str,
        seconds: float,
        reach: "Callable[[tuple[str, int], float], Link]",
    ) -> Self:
        """Connect to a server. Raises OSError if there is none, or no WebSocket.

        reach: connects to (host, port) within the given seconds.
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
        """Return the server's end for a connected client; `feed` its request first."""
        library = load("websockets.server", EXTRA)
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return cls(link, library.ServerProtocol(max_size=LONGEST))

    @property
    def open(self) -> bool:
        """Whether messages can be sent."""
        return self.protocol.state.name == "OPEN"

    def send(self, data: bytes, text: bool = False) -> None:
        """Send one message. Raises OSError if the connection is closed or blocked."""
        if not self.open:
            raise ConnectionError("the other side has closed the connection")
        (self.protocol.send_text if text else self.protocol.send_binary)(data)
        self.flush()

    def receive(self, seconds: float) -> Message:
        """Return the next message. Raises TimeoutError if none comes in `seconds`.

        Raises ConnectionError once the other side has closed the connection.
        """
        until = wall() + seconds
        while not self.came:
            self._take_in(until - wall())
        return self.came.popleft()

    def flush(self) -> None:
        """Send the bytes that the protocol has ready."""
        self.link.settimeout(SENDING)
        try:
            for data in self.protocol.data_to_send():
                if data:
                    self.link.sendall(data)
                else:
                    self.link.shutdown(socket.SHUT_WR)
        except TimeoutError:
            # Half a frame is sent: later bytes would be taken for the rest of it.
            raise ConnectionError("the other side takes nothing more") from None

    def close(self) -> None:
        """Send a close frame and close the socket, without waiting for an answer.

        Earlier messages are sent first. A system that closes a socket with unread
        bytes drops its unsent ones, so we read until nothing is left.
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
        """Read once, for `seconds` at most, and send the protocol's replies."""
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
        """Take in bytes that were read, b"" for the end; return events but messages."""
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
