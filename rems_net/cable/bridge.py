"""Bridge: carries a robot's sessions from its USB cable to a router."""

import threading
from collections.abc import Callable

from rems_net.cable.connection import Connection
from rems_net.cable.frame import Frame, Kind, read
from rems_net.cable.port import Line
from rems_net.cable.splitter import Splitter
from rems_net.errors import WireError


class Bridge:
    """Bridge of one robot, for as long as its line lasts.

    line: the serial port, opened.  router: its host and port.
    tell: callback for events, and for lines of the console.
    """

    def __init__(
        self, line: Line, router: tuple[str, int], tell: Callable[[str], None]
    ):
        self._line, self._router, self._tell = line, router, tell
        self._writing = threading.Lock()
        self._connection: Connection | None = None
        self._last = 0
        self._told = ""

    def run(self) -> None:
        """Carry frames until the line breaks; then raise its OSError."""
        splitter = Splitter()
        try:
            while True:
                portion = self._line.read(max(1, self._line.in_waiting))
                for piece in splitter.feed(portion):
                    if piece.kind == "frame":
                        self._hear(piece.content)
                    elif piece.kind == "text":
                        self._tell(piece.content.decode(errors="replace"))
        finally:
            if self._connection is not None:
                self._connection.close()
                self._connection.wait()

    def _hear(self, content: bytes) -> None:
        try:
            frame = read(content)
        except WireError:
            return  # the robot sends it again
        here = self._connection
        if here is not None and here.number == frame.connection:
            if not here.hear(frame):
                self._send(Frame(Kind.CLOSE, frame.connection))
        elif frame.kind is Kind.DATA:
            # A connection begins with frame 0; a later frame is of an old connection.
            if frame.number == 0 and frame.connection != self._last:
                self._open(frame)
            else:
                self._send(Frame(Kind.CLOSE, frame.connection))

    def _open(self, frame: Frame) -> None:
        if self._connection is not None:
            self._connection.close()
            self._connection.wait()
        number = self._last = frame.connection
        try:
            self._connection = Connection(
                number, self._router, self._send, lambda why: self._ended(number, why)
            )
        except OSError as error:
            self._say(f"no router at {self._router[0]}:{self._router[1]}: {error}")
            self._send(Frame(Kind.CLOSE, number))
            return
        self._say("the robot's session goes through")
        self._connection.hear(frame)

    def _ended(self, number: int, why: str) -> None:
        """Report the end of a session; called in the connection's own thread."""
        self._say(f"a session is over: {why}")
        try:
            self._send(Frame(Kind.CLOSE, number))
        except OSError:
            return  # the line is gone, too: `run` raises its error

    def _say(self, text: str) -> None:
        """Report an event; skip it if it is the same as the last one."""
        if text != self._told:
            self._tell(text)
        self._told = text

    def _send(self, frame: Frame) -> None:
        with self._writing:
            self._line.write(frame.to_line())
