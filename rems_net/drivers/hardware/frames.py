"""Frames: messages between a driver and the process that holds its port."""

import socket
import struct
from enum import IntEnum
from threading import Lock

#: bytes of a read from a socket
CHUNK = 4096
#: head of a frame: its kind, and the length of its payload
HEAD = struct.Struct("<BI")
#: head of WRITE: the wall time at which it was sent, s
STAMP = struct.Struct("<d")
#: head of ARM: max_age, s, and the length of halt
ARM = struct.Struct("<dI")


class Kind(IntEnum):
    """The first byte of a frame; its length and payload follow."""

    TOKEN = 0  #: holder to host: the secret that it was started with
    OPEN = 1  #: to holder: JSON, its kind and its arguments
    OPENED = 2  #: to host: the port is open
    REFUSED = 3  #: to host: JSON, [errno, why] the port cannot be opened
    ARM = 4  #: to holder: max_age, the length of halt, halt, farewell
    WRITE = 5  #: to holder: when it was sent (wall(), s), bytes for the port
    BAUD = 6  #: to holder: text, bits per second
    CLOSE = 7  #: to holder: close the port; the host has stopped the robot
    DATA = 8  #: to host: bytes from the port; none: its other end has closed it
    BROKEN = 9  #: to host: JSON, [errno, why] the port is closed now
    WROTE = 10  #: to host: the bytes of a WRITE were written, or are too old


class Frames:
    """Whole frames over a socket. Any thread may send; one receives."""

    def __init__(self, link: socket.socket):
        self.link, self._buffer, self._sending = link, bytearray(), Lock()
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, kind: Kind, payload: bytes = b"") -> None:
        """Send one frame. Raises OSError."""
        with self._sending:
            self.link.sendall(HEAD.pack(kind, len(payload)) + payload)

    def receive(self) -> tuple[Kind, bytes]:
        """Return the next frame, within the timeout of the socket.

        Raises EOFError if the other end is gone, and OSError.
        """
        while True:
            if len(self._buffer) >= HEAD.size:
                kind, size = HEAD.unpack_from(self._buffer)
                end = HEAD.size + size
                if len(self._buffer) >= end:
                    payload = bytes(self._buffer[HEAD.size : end])
                    del self._buffer[:end]
                    return Kind(kind), payload
            data = self.link.recv(CHUNK)
            if not data:
                raise EOFError
            self._buffer += data
