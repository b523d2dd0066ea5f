"""Splitter: what stands on a robot's serial line, told apart.

Three things share the line, in both directions. Lines of text, in UTF-8. Packets of
Improv Serial, which begin with `IMPROV` and say their length. Frames of the bridge,
between two bytes 0xC0, which no UTF-8 ever has.
"""

from typing import Literal, NamedTuple

#: what every packet of Improv begins with: its name and its version
START = b"IMPROV\x01"
#: bytes of a packet before its data; the last says how long that is
HEAD = 9
END = 0xC0
#: bytes of the longest line or frame that is kept
LONGEST = 4096


class Piece(NamedTuple):
    """One line without its end, one whole packet, or what is between two 0xC0."""

    kind: Literal["text", "packet", "frame"]
    content: bytes


class Splitter:
    """Takes bytes as they come, in any portions."""

    def __init__(self) -> None:
        self._kind: Literal["text", "packet", "frame"] = "text"
        self._held = bytearray()
        #: what a frame has interrupted
        self._line = bytearray()

    def feed(self, portion: bytes) -> list[Piece]:
        """What is complete with these bytes; what is too long is left out."""
        pieces: list[Piece] = []
        for byte in portion:
            if self._kind == "frame":
                self._frame(byte, pieces)
            elif self._kind == "packet":
                self._packet(byte, pieces)
            else:
                self._text(byte, pieces)
        return pieces

    def _text(self, byte: int, pieces: list[Piece]) -> None:
        if byte == END:
            self._kind = "frame"
            # A line goes on after the frame: it is kept apart, and put back.
            self._line, self._held = self._held, bytearray()
        elif byte in b"\r\n":
            if self._held:
                pieces.append(Piece("text", bytes(self._held)))
            self._held.clear()
        else:
            self._held.append(byte)
            if self._held.endswith(START):
                self._kind, self._held = "packet", bytearray(START)
            elif len(self._held) > LONGEST:
                self._held.clear()

    def _packet(self, byte: int, pieces: list[Piece]) -> None:
        held = self._held
        held.append(byte)
        if len(held) >= HEAD and len(held) == HEAD + held[HEAD - 1] + 1:
            pieces.append(Piece("packet", bytes(held)))
            self._kind = "text"
            held.clear()

    def _frame(self, byte: int, pieces: list[Piece]) -> None:
        if byte == END and not self._held:
            return  # the end of one frame, and the beginning of another
        if byte != END and len(self._held) < LONGEST:
            self._held.append(byte)
            return
        if byte == END:
            pieces.append(Piece("frame", bytes(self._held)))
        self._kind, self._held = "text", self._line
