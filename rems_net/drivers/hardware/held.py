"""Held: a port that a process of its own holds (`holder.py`), seen from the host.

The robot at it stands still at most `max_age` after this process has sent something for
the last time: also if it is killed, frozen, or stopped by a debugger.
"""

import errno
import json
import secrets
import socket
import subprocess
import sys
from contextlib import suppress
from typing import Any, Self

from rems_net.agents.wall import wall
from rems_net.drivers.hardware.frames import ARM, STAMP, Frames, Kind
from rems_net.interrupts import without_ctrl_c

#: the program of the process
HOLDER = (sys.executable, "-m", "rems_net.drivers.hardware.holder")
#: s. A process may take so long to start, and a port to open
START, OPENING = 5.0, 5.0
#: s. Between two looks at a process that starts
LOOK = 0.1
#: s. A process that has not ended by then is killed; it ends by itself before
END = 1.5
#: s. The holder reads at once, unless it is frozen
SENDING = 0.25


class Held:
    """A port held by another process. One user, and no thread.

    The process starts with the first port, is kept while that is closed and opened
    anew, and ends by `end`.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        #: whether the other end has closed the connection
        self._ended = False
        self._frames: Frames | None = None
        self._process: subprocess.Popen[bytes] | None = None

    # -- its life ------------------------------------------------------------------

    def start(self) -> None:
        """Start the process, unless it runs. Raises OSError if it does not answer."""
        if self._frames is not None:
            return
        # Ctrl+C, a closed terminal and a killed group are for the host: the holder
        # has to live longer.
        apart = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
        apart |= getattr(subprocess, "CREATE_NO_WINDOW", 0)
        token = secrets.token_bytes(16)
        with socket.create_server(("127.0.0.1", 0)) as door:
            with without_ctrl_c():
                self._process = subprocess.Popen(
                    [*HOLDER, str(door.getsockname()[1])],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    creationflags=apart,
                    start_new_session=True,
                )
            assert self._process.stdin is not None
            with suppress(OSError), self._process.stdin as pipe:
                pipe.write(token)
            self._frames = self._meet(door, token)

    def open(self, kind: str, **given: Any) -> None:
        """Open the port as `holder.open_port` does. Raises its OSError."""
        self.start()
        self._send(Kind.OPEN, json.dumps({"kind": kind, **given}).encode())
        until = wall() + given.get("seconds", 0.0) + OPENING
        while (frame := self._receive(until - wall())) is not None:
            found, payload = frame
            if found is Kind.REFUSED:
                raise _error(payload)
            if found is Kind.OPENED:
                self._buffer.clear()
                self._ended = False
                return
        raise TimeoutError("the port did not open in time")

    def arm(self, max_age: float, halt: bytes, farewell: bytes = b"") -> None:
        """From now on, have the robot halted once nothing is written for `max_age` s.

        halt: bytes that stop the robot, whatever it received before. farewell: bytes
        that follow when this process is gone.
        """
        self._send(Kind.ARM, ARM.pack(max_age, len(halt)) + halt + farewell)

    def close(self) -> None:
        """Close the port; bytes that are not sent yet are thrown away."""
        with suppress(OSError):
            self._send(Kind.CLOSE)

    def end(self) -> None:
        """End the process; if the port is open still, it halts the robot first."""
        frames, self._frames = self._frames, None
        process, self._process = self._process, None
        if frames is not None:
            with suppress(OSError):
                frames.link.shutdown(socket.SHUT_WR)
        if process is not None:
            try:
                process.wait(END)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        if frames is not None:
            frames.link.close()

    def _meet(self, door: socket.socket, token: bytes) -> Frames:
        """Wait for the process at our door. Other programs do not know the token."""
        door.settimeout(LOOK)
        until, process = wall() + START, self._process
        while process and process.poll() is None and wall() < until:
            try:
                link, _ = door.accept()
                link.settimeout(START)
                frames = Frames(link)
                if secrets.compare_digest(frames.receive()[1], token):
                    return frames
                link.close()
            except (EOFError, TimeoutError):
                continue
        self.end()
        raise OSError("the process that holds the port did not start")

    # -- frames --------------------------------------------------------------------

    def _send(self, kind: Kind, payload: bytes = b"") -> None:
        if self._frames is None:
            raise OSError(errno.EPIPE, "the process that holds the port has ended")
        self._frames.link.settimeout(SENDING)
        try:
            self._frames.send(kind, payload)
        except OSError as error:
            raise self._lost() from error

    def _receive(self, seconds: float) -> tuple[Kind, bytes] | None:
        """Return the next frame; None if none comes so soon. Raises OSError."""
        if self._frames is None:
            raise OSError(errno.EPIPE, "the process that holds the port has ended")
        self._frames.link.settimeout(max(0.0, seconds))
        try:
            return self._frames.receive()
        except (BlockingIOError, TimeoutError):
            return None
        except (EOFError, OSError) as error:
            raise self._lost() from error

    def _lost(self) -> OSError:
        """End a process that is of no use; the next `open` starts another one."""
        self.end()
        return OSError(errno.EPIPE, "the process that holds the port has ended")

    def _take_in(self, seconds: float) -> bool:
        """Take in a frame; False if none comes so soon. Raises OSError of the port."""
        frame = self._receive(seconds)
        if frame is None:
            return False
        kind, payload = frame
        if kind is Kind.BROKEN:
            raise _error(payload)
        if kind is Kind.DATA:
            self._buffer += payload
            self._ended |= not payload
        return True

    def write(self, data: bytes) -> int:
        """Write bytes: this feeds the holder, too. Raises OSError."""
        self._send(Kind.WRITE, STAMP.pack(wall()) + data)
        return len(data)

    def _cut(self, size: int) -> bytes:
        portion = bytes(self._buffer[:size])
        del self._buffer[:size]
        return portion


class HeldSerial(Held):
    """A serial port, with the methods of pyserial's.

    timeout: seconds that `read` waits. write_timeout: seconds that the port may take to
    accept bytes.
    """

    def __init__(self, timeout: float, write_timeout: float | None):
        super().__init__()
        self.timeout, self.write_timeout = timeout, write_timeout
        self._baud = 0

    def reach(self, name: str, baud: int) -> None:
        """Open the port of this name. Raises OSError."""
        self.open("serial", name=name, baud=baud, write_timeout=self.write_timeout)
        self._baud = baud

    @property
    def baudrate(self) -> int:
        """Bits per second."""
        return self._baud

    @baudrate.setter
    def baudrate(self, baud: int) -> None:
        self._baud = baud
        self._send(Kind.BAUD, str(baud).encode())

    @property
    def in_waiting(self) -> int:
        """How many bytes `read` would return at once."""
        while self._take_in(0.0):
            pass
        return len(self._buffer)

    def read(self, size: int = 1) -> bytes:
        """Return `size` bytes, or fewer after `timeout`. Raises OSError."""
        until = wall() + self.timeout
        while len(self._buffer) < size and self._take_in(until - wall()):
            pass
        return self._cut(size)

    def read_until(self, end: bytes) -> bytes:
        """Return all up to `end`, or what came within `timeout`. Raises OSError."""
        until = wall() + self.timeout
        while end not in self._buffer and self._take_in(until - wall()):
            pass
        found = self._buffer.find(end)
        return self._cut(found + len(end) if found >= 0 else len(self._buffer))

    def reset_output_buffer(self) -> None:
        """Do nothing: `close` does it."""


class HeldSocket(Held):
    """A connection to a robot, with the methods of a socket that a WebSocket uses."""

    def reach(self, address: tuple[str, int], timeout: float) -> Self:
        """Connect as `socket.create_connection` does. Raises OSError."""
        self.open("socket", host=address[0], port=address[1], seconds=timeout)
        return self

    def settimeout(self, seconds: float) -> None:
        """Let `recv` wait so long."""
        self._timeout = seconds

    def recv(self, size: int) -> bytes:
        """Return what came, b"" at the end. Raises TimeoutError, and OSError."""
        until = wall() + self._timeout
        while not (self._buffer or self._ended):
            if not self._take_in(until - wall()):
                raise TimeoutError("nothing came in time")
        return self._cut(size)

    def sendall(self, data: bytes) -> None:
        """Write all of it. Raises OSError."""
        self.write(data)

    def shutdown(self, how: int) -> None:
        """Do nothing: `close` does it."""


class PortError(OSError):
    """An error of pyserial at a port that a holder has."""


def _error(payload: bytes) -> OSError:
    """Return the error of the holder as one of ours."""
    number, text = json.loads(payload)
    return OSError(number, text) if isinstance(number, int) else PortError(text)
