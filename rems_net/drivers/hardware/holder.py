"""Port holder: the process that holds a robot's port, and stops a robot without a host.

A Create 2 obeys its last command until it receives another. If the process that drives
it is killed or frozen, nothing inside that process can send one. So a small process of
its own opens the port, and lives longer than its host:

    host  --frames over a loopback socket-->  holder  --bytes-->  robot

The holder writes the payload of each WRITE frame to the port, and sends back all that
it reads there. It knows no robot's protocol: the host gives it the bytes that `halt`
this robot. The holder writes them as soon as the host has sent nothing for `max_age`,
and when the host is gone. It confirms each WRITE, so that the host can end a holder
that hangs, and halt the robot itself. `held.py` starts it, and is the host's end of the
socket.
"""

import json
import os
import signal
import socket
import sys
from collections.abc import Callable
from contextlib import suppress
from math import inf
from threading import Event, RLock, Thread, Timer
from typing import Any

from rems_net.agents.wall import wall
from rems_net.drivers.hardware.frames import ARM, CHUNK, STAMP, Frames, Kind

#: s. Between two halts to a robot whose host is silent: one may be damaged on its way
AGAIN = 0.1
#: s. Longest sleep of the guard: after a laptop's sleep it checks this soon
LOOK = 0.05
#: halts, and s between them, when the host is gone
TRIES, PAUSE = 3, 0.02
#: s. The process ends this soon after its host: the next run needs the port
LEAVE = 0.9
#: s. A socket that accepts no bytes for this long counts as broken
SENDING = 0.25


class SerialPort:
    """A serial port."""

    def __init__(self, name: str, baud: int, write_timeout: float):
        import serial

        self._line = serial.Serial(
            name, baud, timeout=None, write_timeout=write_timeout, exclusive=True
        )

    def read(self) -> bytes | None:
        """Return bytes, as soon as there are some; None after `leave`."""
        return self._line.read(max(1, self._line.in_waiting)) or None

    def write(self, data: bytes) -> None:
        """Write all bytes. Raises OSError."""
        self._line.write(data)

    def set_baud(self, baud: int) -> None:
        """Set the bits per second."""
        self._line.baudrate = baud

    def leave(self) -> None:
        """Have `read` return, and discard bytes that were not sent yet."""
        with suppress(Exception):  # termios.error, which is no OSError
            self._line.reset_output_buffer()
        self._line.cancel_read()

    def close(self) -> None:
        """Close the port."""
        self._line.close()


class SocketPort:
    """A network connection to a robot."""

    def __init__(self, host: str, port: int, seconds: float):
        self._link = socket.create_connection((host, port), timeout=seconds)
        self._link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._link.settimeout(SENDING)

    def read(self) -> bytes | None:
        """Return bytes; None if there are none within SENDING, b"" at the end."""
        try:
            return self._link.recv(CHUNK)
        except TimeoutError:
            return None

    def write(self, data: bytes) -> None:
        """Write all bytes. Raises OSError."""
        self._link.sendall(data)

    def set_baud(self, baud: int) -> None:
        """Do nothing: a network has its own speed."""

    def leave(self) -> None:
        """Send the remaining bytes and an end: the other side closes, `read` ends."""
        with suppress(OSError):
            self._link.shutdown(socket.SHUT_WR)

    def close(self) -> None:
        """Close the connection."""
        self._link.close()


#: One thread reads it, another one does the rest.
Port = SerialPort | SocketPort
KINDS: dict[str, Callable[..., Port]] = {"serial": SerialPort, "socket": SocketPort}


class Holder:
    """Server of one host: obeys its frames, and stops its robot if there are none."""

    def __init__(self, host: Frames):
        self.host = host
        #: acquired while the port is written, opened or closed
        self.busy = RLock()
        self.port: Port | None = None
        self.reader: Thread | None = None
        self.halt = self.farewell = b""
        self.max_age, self.fed = inf, 0.0

    def serve(self) -> None:
        """Obey until the host is gone; then stop the robot, and close the port."""
        Thread(target=self._guard, daemon=True).start()
        try:
            while True:
                self._obey(*self.host.receive())
        except (EOFError, OSError):
            pass  # the host has ended, or was killed
        finally:
            self._part()

    @property
    def late(self) -> float:
        """Seconds since the robot should stand; 0 or less while it may drive."""
        return wall() - self.fed - self.max_age if self.port else -inf

    def _obey(self, kind: Kind, payload: bytes) -> None:
        if kind is Kind.OPEN:
            self._open(json.loads(payload))
        elif kind is Kind.ARM:
            self.max_age, size = ARM.unpack_from(payload)
            both = payload[ARM.size :]
            self.halt, self.farewell, self.fed = both[:size], both[size:], wall()
        elif kind is Kind.WRITE:
            self._write(STAMP.unpack_from(payload)[0], payload[STAMP.size :])
            self.host.send(Kind.WROTE)
        elif kind is Kind.BAUD:
            self._act(lambda port: port.set_baud(int(payload)))
        elif kind is Kind.CLOSE:
            self._close()

    def _write(self, sent: float, data: bytes) -> None:
        """Write the host's bytes, if they are not from before the computer's sleep."""
        with self.busy:
            if self.late > 0:
                self._put(self.halt)
            if wall() - sent <= self.max_age:
                self.fed = sent
                self._put(data)

    def _guard(self) -> None:
        """Stop the robot as soon as its host is silent, and again until it is not."""
        while True:
            late = self.late
            Event().wait(AGAIN if late > 0 else min(LOOK, max(0.0, -late) + 0.001))
            with self.busy:
                if self.late > 0:
                    self._put(self.halt)

    def _part(self) -> None:
        """Stop the robot whose host is gone, and close the port."""
        timer = Timer(LEAVE, os._exit, (1,))
        timer.daemon = True
        timer.start()
        for data in (*[self.halt] * TRIES, self.farewell):
            if data:
                self._put(data)
                Event().wait(PAUSE)
        self._close()

    def _open(self, given: dict[str, Any]) -> None:
        self._close()
        try:
            port = KINDS[given.pop("kind")](**given)
        except Exception as error:
            self.host.send(Kind.REFUSED, _reason(error))
            return
        with self.busy:
            self.port = port
        self.host.send(Kind.OPENED)
        self.reader = Thread(target=self._read, args=(port,), daemon=True)
        self.reader.start()

    def _put(self, data: bytes) -> None:
        """Write to the port, if it is open."""
        self._act(lambda port: port.write(data))

    def _act(self, do: Callable[[Port], None]) -> None:
        """Do something with the port, if it is open, and report if it breaks."""
        with self.busy:
            port = self.port
            if port is not None:
                try:
                    do(port)
                except Exception as error:
                    self._fail(port, error)

    def _read(self, port: Port) -> None:
        """Send the host all bytes from the port, but not to a host that is frozen."""
        while self.port is port:
            try:
                data = port.read()
            except Exception as error:
                self._fail(port, error)
                return
            if data is not None and self.late <= 0:
                with suppress(OSError):  # the host is gone: `serve` ends
                    self.host.send(Kind.DATA, data)
            if data == b"":
                return

    def _fail(self, port: Port, error: Exception) -> None:
        """Close a port that broke, and report that once."""
        if self.port is port:
            self.port = None
            with suppress(OSError):
                self.host.send(Kind.BROKEN, _reason(error))
            with suppress(Exception):
                port.close()

    def _close(self) -> None:
        """Close the port, after its reader has stopped."""
        with self.busy:
            port, self.port = self.port, None
            self.max_age, self.halt, self.farewell = inf, b"", b""
        if port is not None:
            port.leave()
            if self.reader is not None:
                self.reader.join(2 * SENDING)
            with suppress(Exception):
                port.close()


def _reason(error: Exception) -> bytes:
    """Return the system's number of an error, or null, and its text, as JSON."""
    number = getattr(error, "errno", None)
    if number is None and len(error.args) == 2:  # termios.error, which is no OSError
        number = error.args[0]
    text = getattr(error, "strerror", None) or str(error)
    return json.dumps([number, text]).encode()


def main() -> None:
    """Serve the host at the loopback port of the command line."""
    # A shutdown ends the host and us; the host must stop its robot first, and needs us.
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):  # Windows has no SIGHUP
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    token = sys.stdin.buffer.read()
    with socket.create_connection(("127.0.0.1", int(sys.argv[1]))) as link:
        host = Frames(link)
        host.send(Kind.TOKEN, token)
        Holder(host).serve()


if __name__ == "__main__":
    main()
