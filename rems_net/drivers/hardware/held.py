"""Held: a port in a process of its own (`holder.py`), seen from the host.

The robot stands still at most `max_age` after the host has last sent something, even if
the host is killed, frozen, or stopped by a debugger. The host guards the process, too:
if it ends, or confirms nothing for ANSWER s, the host ends it and halts the robot.
"""

import json
import secrets
import socket
import subprocess
import sys
from collections import deque
from contextlib import suppress
from math import inf
from typing import Any, Self

from rems_net.agents.wall import wall
from rems_net.drivers.hardware.frames import ARM, STAMP, Frames, Kind
from rems_net.system.interrupts import APART, without_ctrl_c

#: command line of the process
HOLDER = (sys.executable, "-m", "rems_net.drivers.hardware.holder")
#: s. Longest time for the process to start, and for a port to open. A virus scanner of
#: Windows makes a first start slow.
START, OPENING = 8.0, 5.0
#: s. Between two checks whether a starting process still runs.
LOOK = 0.1
#: s. A process that has not ended after this is killed; normally it ends earlier.
END = 1.5
#: s. The holder reads at once, if it is not frozen.
SENDING = 0.25
#: s. A holder that has not confirmed a write for longer hangs or is frozen.
ANSWER = 0.2
#: s. After a pause of this process, answers may be on their way for this long.
GRACE = 0.02
#: s. A process that is killed ends within this, even on a machine with far more work
#: than it can do, unless a call of the system hangs.
KILLED = 2.0


class Held:
    """A port that another process holds. One user, and no thread.

    The process starts with the first port, stays while that is closed and opened
    again, and ends by `end`.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        #: whether the other end has closed the connection
        self._ended = False
        self._frames: Frames | None = None
        self._process: subprocess.Popen[bytes] | None = None
        #: wall s, when each write was sent that is not confirmed yet, oldest first
        self._written: deque[float] = deque()
        #: bytes that halt the robot; none if the port is closed
        self._halt = b""

    def start(self) -> None:
        """Start the process if it does not run. Raises OSError without an answer."""
        if self._frames is not None:
            return
        # Ctrl+C, a closed terminal and a killed process group end the host: the
        # holder must live longer.
        token = secrets.token_bytes(16)
        with socket.create_server(("127.0.0.1", 0)) as door:
            with without_ctrl_c():
                self._process = subprocess.Popen(
                    [*HOLDER, str(door.getsockname()[1])],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    creationflags=APART,
                    start_new_session=True,
                )
            assert self._process.stdin is not None
            with suppress(OSError), self._process.stdin as pipe:
                pipe.write(token)
            self._frames = self._meet(door, token)

    def open(self, kind: str, **given: Any) -> None:
        """Open the port, by one of the holder's KINDS. Raises its OSError."""
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
        """Have the robot halted, from now on, if nothing is written for `max_age` s.

        halt: bytes that stop the robot, even after a broken command. farewell: bytes
        after these, if this process is gone.
        """
        self._send(Kind.ARM, ARM.pack(max_age, len(halt)) + halt + farewell)
        self._halt = halt

    def close(self) -> None:
        """Close the port, and discard bytes that were not sent yet."""
        self._halt = b""
        with suppress(OSError):
            self._send(Kind.CLOSE)

    def end(self) -> None:
        """End the process; if the port is still open, the process halts the robot."""
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
        """Wait until the process connects; it proves itself by the token."""
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

    def _send(self, kind: Kind, payload: bytes = b"") -> None:
        if self._frames is None:
            raise self._lost()
        self._frames.link.settimeout(SENDING)
        try:
            self._frames.send(kind, payload)
        except OSError as error:
            raise self._lost() from error

    def _receive(self, seconds: float) -> tuple[Kind, bytes] | None:
        """Return the next frame; None if none comes in time.

        Raises OSError if the process has ended, or does not confirm a write.
        """
        until = wall() + seconds
        while self._frames is not None:
            left, due = until - wall(), self._due - wall()
            self._frames.link.settimeout(max(0.0, min(left, due)) if due > 0 else GRACE)
            try:
                kind, payload = self._frames.receive()
            except (BlockingIOError, TimeoutError):
                if due <= 0:
                    raise self._lost(f"did not answer for {ANSWER:g} s") from None
                if wall() >= until:
                    return None
            except (EOFError, OSError) as error:
                raise self._lost() from error
            else:
                if kind is not Kind.WROTE:
                    return kind, payload
                if self._written:
                    self._written.popleft()
        raise self._lost()

    @property
    def _due(self) -> float:
        """Wall time at which the oldest write has to be confirmed, s."""
        return self._written[0] + ANSWER if self._written else inf

    def _lost(self, why: str = "has ended") -> OSError:
        """End a broken process, halt the robot, and return the error.

        `open` starts another process.
        """
        frames, self._frames = self._frames, None
        process, self._process = self._process, None
        halt, self._halt = self._halt, b""
        self._written.clear()
        if process is not None:
            process.kill()
            try:
                process.wait(KILLED)
            except subprocess.TimeoutExpired:
                why += (
                    ", and hangs in a call of the system that no program can end. The "
                    "robot may drive on: switch it off"
                )
        if frames is not None:
            frames.link.close()
        if halt:
            self.halt_alone(halt)
        return OSError(f"the process that holds the port {why}")

    def halt_alone(self, halt: bytes) -> None:
        """Halt the robot without the process; a socket's end halts it already."""

    def _take_in(self, seconds: float) -> bool:
        """Take in a frame; return False if none comes. Raises the port's OSError."""
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
        """Write bytes; each write also resets the holder's timer. Raises OSError."""
        if wall() > self._due:
            self._take_all()
        self._send(Kind.WRITE, STAMP.pack(wall()) + data)
        self._written.append(wall())
        return len(data)

    def _take_all(self) -> None:
        """Take in all frames that have come. Raises OSError."""
        while self._take_in(0.0):
            pass

    def _cut(self, size: int) -> bytes:
        portion = bytes(self._buffer[:size])
        del self._buffer[:size]
        return portion


class HeldSocket(Held):
    """A connection to a robot, with the methods of a socket that a WebSocket uses."""

    def reach(self, address: tuple[str, int], timeout: float) -> Self:
        """Connect as `socket.create_connection` does. Raises OSError."""
        self.open("socket", host=address[0], port=address[1], seconds=timeout)
        return self

    def settimeout(self, seconds: float) -> None:
        """Set how long `recv` waits, s."""
        self._timeout = seconds

    def recv(self, size: int) -> bytes:
        """Return bytes, b"" at the end. Raises TimeoutError, and OSError."""
        until = wall() + self._timeout
        while not (self._buffer or self._ended):
            if not self._take_in(until - wall()):
                raise TimeoutError("nothing came in time")
        return self._cut(size)

    def sendall(self, data: bytes) -> None:
        """Write all of it. Raises OSError."""
        self.write(data)

    def shutdown(self, how: int) -> None:
        """Do nothing: `close` closes both directions."""


class PortError(OSError):
    """An error of pyserial at the holder's port."""


def _error(payload: bytes) -> OSError:
    """Return the holder's error as an OSError of this process."""
    number, text = json.loads(payload)
    return OSError(number, text) if isinstance(number, int) else PortError(text)
