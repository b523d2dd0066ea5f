"""Connection: one session of a robot, from the cable to a router and back."""

import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress

from rems_net.cable.frame import PAYLOAD, Frame, Kind

#: s until a frame is sent again; s until the robot counts as gone.
AGAIN, GIVE_UP = 0.2, 3.0
#: s that a router may take to answer, and to accept data.
OPENING, TAKING = 2.0, 2.0


class Connection:
    """A socket to a router; its data is sent in frames.

    send: writes a frame to the line; two threads may call it.
    ended: called once, in the connection's own thread, with the reason.
    Raises OSError if no router answers.
    """

    def __init__(
        self,
        number: int,
        router: tuple[str, int],
        send: Callable[[Frame], None],
        ended: Callable[[str], None],
    ):
        self.number = number
        self._send, self._ended = send, ended
        self._socket = socket.create_connection(router, OPENING)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.settimeout(TAKING)
        self._expected = 0
        self._acked = threading.Condition()
        self._waiting: int | None = None
        self._over = False
        self._thread = threading.Thread(target=self._from_router, daemon=True)
        self._thread.start()

    def hear(self, frame: Frame) -> bool:
        """Take in a frame of this connection; return False if it is closed."""
        if frame.kind is Kind.ACK:
            with self._acked:
                if frame.number == self._waiting:
                    self._waiting = None
                    self._acked.notify()
        elif frame.kind is Kind.CLOSE:
            self.close()
        elif frame.number == self._expected:
            try:
                self._socket.sendall(frame.payload)
            except OSError:  # the router accepts no more: recv in the other thread ends
                self.close()
                return False
            self._expected = (self._expected + 1) % 256
            self._send(Frame(Kind.ACK, self.number, frame.number))
        elif frame.number == (self._expected - 1) % 256:
            self._send(Frame(Kind.ACK, self.number, frame.number))
        return True

    def close(self) -> None:
        """Close the connection to the router; its thread ends soon."""
        with self._acked:
            self._over = True
            self._acked.notify()
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def wait(self) -> None:
        """Wait until its thread has ended."""
        self._thread.join()

    def _from_router(self) -> None:
        number, why = 0, "the router has closed it"
        try:
            while portion := self._receive():
                if not self._deliver(Frame(Kind.DATA, self.number, number, portion)):
                    why = "the robot does not answer"
                    break
                number = (number + 1) % 256
        except OSError as error:
            why = str(error)
        self._socket.close()
        if self._over:
            why = "the robot has closed it"
        self._ended(why)

    def _receive(self) -> bytes:
        while not self._over:
            with suppress(TimeoutError):
                return self._socket.recv(PAYLOAD)
        return b""

    def _deliver(self, frame: Frame) -> bool:
        """Send a frame until it is acknowledged; return False if it never is."""
        until = time.monotonic() + GIVE_UP
        with self._acked:
            self._waiting = frame.number
        while time.monotonic() < until:
            self._send(frame)
            with self._acked:
                if self._acked.wait_for(
                    lambda: self._waiting is None or self._over, AGAIN
                ):
                    return not self._over
        return False
