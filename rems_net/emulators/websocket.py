"""WebSocketPort: a port of this computer for WebSocket clients, used as a line.

Several clients share it, but a line carries bytes. So each portion is one packet, with
its client, its kind and its data.
"""

import errno
import selectors
import socket
import struct
import time
from collections import deque
from contextlib import suppress
from typing import Any, NamedTuple, Self

from rems_net.drivers.hardware.websocket import WebSocket
from rems_net.errors import FabricError

#: Kinds of packets: a client asks to connect, or is accepted; text; bytes; a client has
#: gone; the device has started anew and has no clients.
OPEN, TEXT, BINARY, GONE, RESET = range(1, 6)
HEAD = struct.Struct(">BBH")
#: Bytes. Largest portion of one read.
PORTION = 4096


class Packet(NamedTuple):
    """Data of a client, or for a client."""

    client: int
    kind: int
    data: bytes = b""

    def pack(self) -> bytes:
        """Return its bytes on the line."""
        return HEAD.pack(self.client, self.kind, len(self.data)) + self.data

    @classmethod
    def unpack(cls, portion: bytes) -> Self | None:
        """Return the packet in a portion; None if it was damaged on its way."""
        if len(portion) < HEAD.size:
            return None
        client, kind, size = HEAD.unpack_from(portion)
        data = portion[HEAD.size :]
        return cls(client, kind, data) if size == len(data) else None


class WebSocketPort:
    """Server at `host`:`port` (0: any free port) for at most `most` clients.

    When unplugged, it is like a robot out of Wi-Fi range: connections stay, but nothing
    comes through. Raises FabricError if the port is taken.
    """

    baud = None

    def __init__(self, host: str = "127.0.0.1", port: int = 0, most: int = 5):
        try:
            self._server = socket.create_server((host, port))
        except OSError as error:
            why = (error.strerror or "").partition(" (while ")[0].rstrip(".")
            if error.errno == errno.EADDRINUSE:  # Windows has a long sentence for it
                why = "this port is in use"
            raise FabricError(
                f"cannot listen at {host}:{port}: {why}. Give another port, such as "
                "--port 8182; those below 1024 are the system's. (R0715)"
            ) from None
        self._server.setblocking(False)
        self.most = most
        self.port: int = self._server.getsockname()[1]
        #: Address that a program connects to.
        self.where = f"ws://{host}:{self.port}"
        self._plugged = True
        self._clients: dict[int, WebSocket] = {}
        self._links: dict[int, socket.socket] = {}
        self._requests: dict[int, Any] = {}
        self._came: deque[bytes] = deque()
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._server, selectors.EVENT_READ, None)

    def plug(self) -> None:
        """Be in range again: data that waited comes through."""
        self._plugged = True

    def unplug(self) -> None:
        """Be out of range."""
        self._plugged = False

    def receive(self, seconds: float) -> bytes:
        """Return the next packet, after at most so many seconds; b"" if none came."""
        if not self._plugged:
            time.sleep(seconds)
            return b""
        if not self._came:
            for key, _ in self._selector.select(seconds):
                if key.data is None:
                    self._welcome()
                else:
                    self._hear(key.data)
        return self._came.popleft() if self._came else b""

    def send(self, portion: bytes) -> None:
        """Send a packet to its client; drop it if that client is gone."""
        packet = Packet.unpack(portion)
        if packet is None or not self._plugged:
            return
        if packet.kind == RESET:
            self._reset()
        elif (client := self._clients.get(packet.client)) is not None:
            try:
                self._say(client, packet)
            except OSError:
                self._drop(packet.client)

    def close(self) -> None:
        """Close all connections, and the port."""
        for number in list(self._clients):
            self._drop(number)
        self._selector.close()
        self._server.close()

    def _say(self, client: WebSocket, packet: Packet) -> None:
        request = self._requests.pop(packet.client, None)
        if packet.kind == OPEN and request is not None:
            protocol: Any = client.protocol
            protocol.send_response(protocol.accept(request))
            client.flush()
        elif client.open and packet.kind in (TEXT, BINARY):
            client.send(packet.data, text=packet.kind == TEXT)

    def _welcome(self) -> None:
        with suppress(OSError):
            link, _ = self._server.accept()
            link.settimeout(1.0)
            free = [n for n in range(self.most) if n not in self._clients]
            if not free:
                link.close()
                return
            self._clients[free[0]] = WebSocket.accept(link)
            self._links[free[0]] = link
            self._selector.register(link, selectors.EVENT_READ, free[0])

    def _hear(self, number: int) -> None:
        client = self._clients[number]
        try:
            others = client.feed(client.link.recv(PORTION))
        except OSError:
            self._drop(number)
            return
        for event in others:
            if hasattr(event, "headers"):
                self._requests[number] = event
                self._came.append(Packet(number, OPEN).pack())
        while client.came:
            message = client.came.popleft()
            kind = TEXT if message.text else BINARY
            self._came.append(Packet(number, kind, message.data).pack())
        if client.protocol.state.name in ("CLOSING", "CLOSED"):
            self._drop(number)

    def _drop(self, number: int, *, politely: bool = True) -> None:
        """Close a client's socket, and report to the device that it has gone."""
        client = self._clients.pop(number)
        self._requests.pop(number, None)
        self._selector.unregister(self._links.pop(number))
        if politely:
            client.close()
        else:
            client.link.close()
        self._came.append(Packet(number, GONE).pack())

    def _reset(self) -> None:
        """Break all connections, as a device does that starts anew."""
        for number in list(self._clients):
            self._drop(number, politely=False)
        self._came.clear()
