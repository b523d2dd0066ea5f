"""Splitter: separates the three kinds of data on a robot's serial line.

Lines of text, in UTF-8. Packets of Improv Serial, which begin with `IMPROV` and contain
their length. Frames of the bridge, between two bytes 0xC0, which never occur in UTF-8.
All three go in both directions.
"""

from typing import Literal, NamedTuple

#: Beginning of every Improv packet: its name and its version.
START = b"IMPROV\x01"
#: Bytes of a packet before its data; the last of them is the data's length.
HEAD = 9
END = 0xC0
#: Bytes. A longer line or frame is dropped.
LONGEST = 4096


class Piece(NamedTuple):
    """One line without its end, one whole packet, or the bytes between two 0xC0."""

    kind: Literal["text", "packet", "frame"]
    content: bytes


class Splitter:
    """Parser of a stream of bytes, in portions of any size."""

    def __init__(self) -> None:
        self._kind: Literal["text", "packet", "frame"] = "text"
        self._held = bytearray()
        #: Text that a frame has interrupted.
        self._line = bytearray()

    def feed(self, portion: bytes) -> list[Piece]:
        """Return the pieces that these bytes complete; too long ones are left out."""
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
            # A line continues after the frame: it is kept apart, and put back.
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
            return  # the end of one frame and the beginning of the next
        if byte != END and len(self._held) < LONGEST:
            self._held.append(byte)
            return
        if byte == END:
            pieces.append(Piece("frame", bytes(self._held)))
        self._kind, self._held = "text", self._line
