"""Console: commands for a robot on its serial line, and its answers."""

import time
from collections.abc import Sequence

from rems_net.cable import improv
from rems_net.cable.improv import Command, Kind
from rems_net.cable.port import BAUDS, Line
from rems_net.cable.splitter import Piece, Splitter
from rems_net.errors import FabricError, WireError

#: s that an answer may take.
ANSWER_TIMEOUT = 5.0
#: s that a robot may take to join a network; it gives up after 25 s.
JOINING = 30.0


class RefusedError(FabricError):
    """Refusal by the robot; the message is the robot's own sentence."""


class Console:
    """Console of a robot at a line."""

    def __init__(self, line: Line):
        self._line = line
        self._splitter = Splitter()
        self._waiting: list[Piece] = []

    def find(self, name: str, seconds: float = 8.0) -> None:
        """Wait for the robot to answer, since boards restart when a port is opened.

        name: of the port, for the error message. Raises FabricError without an answer.
        """
        until = time.monotonic() + seconds
        bauds = [self._line.baudrate, *(b for b in BAUDS if b != self._line.baudrate)]
        while time.monotonic() < until:
            for baud in bauds:
                self._line.baudrate = baud
                self.write(improv.command(Command.STATE))
                try:
                    self._answered(1.0)
                    return
                except (TimeoutError, RefusedError):
                    continue
        raise FabricError(
            f"no robot answers at {name}. Is it the Woodbot's port, is its firmware on "
            "it, and is it switched on? Press its reset button, and try again; for a "
            "first firmware see docs/firmware.md. (R0701)"
        )

    def ask(self, command: str) -> list[str]:
        """Return the lines of the answer to one line of text.

        Raises RefusedError with the robot's sentence, or TimeoutError without an
        answer.
        """
        self._waiting.clear()
        self.write(b"\n" + command.encode() + b"\n")
        lines: list[str] = []
        until = time.monotonic() + ANSWER_TIMEOUT
        while True:
            piece = self._next(until, "text")
            text = piece.content.decode(errors="replace")
            if text == "ok":
                return lines
            if text.startswith("error: "):
                why = text.removeprefix("error: ")
                raise RefusedError(f"{why} (R0706)")
            lines.append(text)

    def set(self, name: str, value: str) -> None:
        """Set one of the robot's settings. Raises RefusedError."""
        if any(ord(c) < 32 for c in value):
            raise RefusedError(
                "a value has no line ends or other control characters (R0706)"
            )
        try:
            self.ask(f"set {name} {value}")
        except RefusedError as error:
            raise RefusedError(
                f"the robot does not take this {name}: {error}"
            ) from None

    def info(self) -> Sequence[str]:
        """Return firmware, version, chip, name."""
        return self._results(Command.INFO)[0]

    def scan(self) -> list[tuple[str, int, bool]]:
        """Return the networks in range: name, strength [dBm], whether it needs a
        password; the strongest first.
        """
        rows = self._results(Command.SCAN, many=True)
        found = [(r[0], _number(r[1]), r[2] != "NO") for r in rows if len(r) > 2]
        return sorted(found, key=lambda row: (-row[1], row[0]))

    def join(self, ssid: str, password: str) -> str:
        """Make the robot join a network; return its sentence about it.

        Raises RefusedError with the reason.
        """
        self._waiting.clear()
        self.write(improv.command(Command.WIFI, ssid, password))
        said = ""
        until = time.monotonic() + JOINING
        while True:
            piece = self._next(until)
            if piece.kind == "text":
                text = piece.content.decode(errors="replace")
                if text.startswith("wifi: "):
                    said = text.removeprefix("wifi: ")
                continue
            kind, data = improv.read(piece.content)
            if kind is Kind.ERROR and data[:1] != b"\0":
                raise RefusedError(said or improv.error(data[0]))
            if kind is Kind.RESULT and data[:1] == bytes([Command.WIFI]):
                return said

    def write(self, portion: bytes) -> None:
        """Write to the line. Raises FabricError if it is gone."""
        try:
            self._line.write(portion)
        except OSError as error:  # pyserial's errors are OSErrors, too
            raise FabricError(
                f"the cable was pulled out, or: {error} (R0701)"
            ) from None

    def _next(self, until: float, kind: str = "") -> Piece:
        """Return the next piece of this kind; others are dropped."""
        while True:
            while self._waiting:
                piece = self._waiting.pop(0)
                if piece.kind == kind or (not kind and piece.kind != "frame"):
                    return piece
            if time.monotonic() > until:
                raise TimeoutError(
                    "the robot does not answer; press its reset button, and "
                    "try again (R0701)"
                )
            try:
                portion = self._line.read(max(1, self._line.in_waiting))
            except OSError as error:
                raise FabricError(
                    f"the cable was pulled out, or: {error} (R0701)"
                ) from None
            self._waiting += self._splitter.feed(portion)

    def _packet(self, until: float) -> tuple[Kind, bytes]:
        """Return the next undamaged packet; ignore an error packet with code 0."""
        while True:
            piece = self._next(until, "packet")
            try:
                kind, data = improv.read(piece.content)
            except WireError:
                continue
            if kind is not Kind.ERROR:
                return kind, data
            if data[:1] != b"\0":
                raise RefusedError(f"{improv.error(data[0])} (R0706)")

    def _answered(self, seconds: float) -> None:
        """Wait for a state packet: ready, joining, or joined."""
        until = time.monotonic() + seconds
        while True:
            kind, data = self._packet(until)
            if kind is Kind.STATE and data[:1] in (b"\2", b"\3", b"\4"):
                return

    def _results(self, command: Command, many: bool = False) -> list[Sequence[str]]:
        self._waiting.clear()
        self.write(improv.command(command))
        found: list[Sequence[str]] = []
        until = time.monotonic() + (JOINING if many else ANSWER_TIMEOUT)
        while True:
            kind, data = self._packet(until)
            if kind is not Kind.RESULT:
                continue
            of, texts = improv.texts(data)
            if of == command:
                found.append(texts)
                if not (many and texts):  # an empty one ends many
                    return found


def _number(text: str) -> int:
    return int(text) if text.lstrip("-").isdecimal() else 0
