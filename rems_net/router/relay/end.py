"""End: one socket of a connection, and the bytes that wait to be sent."""

import socket
import struct
from collections.abc import Callable
from contextlib import suppress
from selectors import EVENT_READ, EVENT_WRITE, BaseSelector

#: bytes read at a time: a whole batch
CHUNK = 65_536
#: option: close at once, without a waiting time in the system
_AT_ONCE = struct.pack("ii", 1, 0)


class End:
    """A socket that never blocks.

    Its owner sets `took`, which gets the bytes that come, `closed`, which is called at
    their end, and `sent`, which is called when all bytes are sent.
    """

    def __init__(self, sock: socket.socket, selector: BaseSelector, buffer: memoryview):
        sock.setblocking(False)
        with suppress(OSError):  # the other side may be gone
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket, self._selector, self._buffer = sock, selector, buffer
        self._wanted = 0
        self.pending = b""
        self.reading = self.broken = False
        self.owner: object = None
        self.took: Callable[[memoryview], None]
        self.closed: Callable[[], None]
        self.sent: Callable[[], None]

    def read(self, reading: bool) -> None:
        """Read from now on, or stop: then bytes wait at the sender."""
        self.reading = reading
        self._want()

    def send(self, data: bytes | memoryview) -> bool:
        """Send bytes, and keep those that do not fit. Return whether all are sent."""
        if self.pending:
            self.pending += data
            return False
        if self.broken:
            return True
        try:
            gone = self.socket.send(data)
        except BlockingIOError:
            gone = 0
        except OSError:  # bytes of the other side may still be readable
            self.broken = True
            return True
        if gone == len(data):
            return True
        self.pending = bytes(data[gone:])
        self._want()
        return False

    def wait_to_send(self, data: bytes) -> None:
        """Send bytes as soon as the socket is connected."""
        self.pending = data
        self._want()

    def ready(self, mask: int) -> None:
        """Send or read, as the socket is ready for it."""
        if mask & EVENT_WRITE and self.pending:
            try:
                self.pending = self.pending[self.socket.send(self.pending) :]
            except BlockingIOError:
                pass
            except OSError:
                self.broken, self.pending = True, b""
                self.closed()
                return
            if not self.pending:
                self._want()
                self.sent()
        if mask & EVENT_READ and self.reading:
            try:
                count = self.socket.recv_into(self._buffer)
            except BlockingIOError:
                return
            except OSError:
                count = 0
            if count:
                self.took(self._buffer[:count])
            else:
                self.closed()

    def finish(self) -> None:
        """Signal the other side that no more bytes come."""
        with suppress(OSError):
            self.socket.shutdown(socket.SHUT_WR)

    def close(self, *, at_once: bool = False) -> None:
        """Close the socket; a second call does nothing. at_once: drop unread bytes."""
        self.reading, self.pending = False, b""
        if self._wanted:
            self._want()
        if at_once:
            with suppress(OSError):
                self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _AT_ONCE)
        self.socket.close()

    def _want(self) -> None:
        wanted = self.reading * EVENT_READ | bool(self.pending) * EVENT_WRITE
        if wanted == self._wanted:
            return
        if not wanted:
            self._selector.unregister(self.socket)
        elif not self._wanted:
            self._selector.register(self.socket, wanted, self)
        else:
            self._selector.modify(self.socket, wanted, self)
        self._wanted = wanted
