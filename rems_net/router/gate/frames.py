"""Reader of the batches that a client sends to a shared router.

A batch contains transport messages; a frame among them contains network messages, and a
fragment a piece of one. An unreadable batch is refused: it might contain a key.
"""

from rems_net.router.gate.messages import (
    INTEREST,
    KINDS,
    Known,
    beginning,
    message,
)
from rems_net.router.gate.wire import EXTENDED, NAME, GateError, extensions, number

#: messages of a batch, to bound the time of reading it. A batch has 64 KB, and a
#: robot's state some 40 bytes.
MESSAGES = 8192
#: frames of a batch. Zenoh writes one for each change of priority.
FRAMES = 64

# Kinds of transport messages, and extensions of frames and fragments.
_CLOSE, _KEEP_ALIVE, _FRAME, _FRAGMENT = 0x03, 0x04, 0x05, 0x06
_QOS, _FIRST, _DROP = 0x31, 0x02, 0x03
_OF_FRAME = {_QOS: None}


class Reader:
    """Reader of one client's batches.

    known: the client's declarations.  has_closed: whether it has sent a Close.
    """

    def __init__(self, *, marks: bool = True):
        """Store whether the client marks the first fragment of a message.

        Zenoh does since 1.1, and declares it as it joins. Without marks the beginning
        of a message is not certain, so no fragment is let through.
        """
        self._marks = marks
        self.known = Known()
        self.has_closed = False

    def feed(self, batch: bytes | memoryview) -> str | None:
        """Return why the router must not get this batch, or None."""
        try:
            self._read(bytes(batch))
        except GateError as refused:
            return str(refused)
        except IndexError:
            return "sent a message that is cut off"
        except UnicodeDecodeError:
            return "sent a key that is no text"
        return None

    def _read(self, data: bytes) -> None:
        at, size, framed = 0, len(data), False
        frames = messages = 0
        while at < size:
            header = data[at]
            kind = header & KINDS
            if framed and kind >= INTEREST:
                at = message(data, at, self.known)
                messages += 1
            elif kind == _FRAGMENT:
                self._fragment(data, at)
                return
            else:
                framed = kind == _FRAME
                at = _transport(data, at)
                self.has_closed |= kind == _CLOSE
                frames += 1
            if messages > MESSAGES or frames > FRAMES:
                raise GateError("sent too many messages in one batch")
        if at > size:
            raise IndexError

    def _fragment(self, data: bytes, at: int) -> None:
        """Read the key in the first fragment of a message; the others have none."""
        if not self._marks:
            raise GateError("sent a message in fragments, as Zenoh did before 1.1")
        header = data[at]
        _, at = number(data, at + 1)
        marks = set()
        while header & EXTENDED:
            header = data[at]
            name = header & NAME
            at += 1
            if name == _QOS:
                _, at = number(data, at)
            elif name not in (_FIRST, _DROP):
                raise GateError(f"sent a fragment with 0x{name:02x}")
            marks.add(name)
        if _FIRST in marks:
            beginning(data, at, self.known.wild)


def _transport(data: bytes, at: int) -> int:
    """Read the header of a frame, or a message about the link."""
    header = data[at]
    if header & KINDS == _FRAME:
        _, at = number(data, at + 1)
        return extensions(data, at, header, _OF_FRAME)
    if header == _KEEP_ALIVE:
        return at + 1
    if header & KINDS == _CLOSE and header < EXTENDED:
        return at + 2
    raise GateError(f"sent a transport message 0x{header:02x} of an unknown kind")
