"""Faults: what goes wrong with the packets of a line, in one direction.

A difference in speed between the two ends is one of them.
"""

from dataclasses import dataclass, field
from random import Random

#: Bits of a byte on the line: low start bit, eight bits, lowest first, high stop bit.
BITS = 10


@dataclass
class Faults:
    """Fractions (0 to 1) of the packets that are damaged; may change at any time.

    lose: the packet is lost.  drop: it loses a byte.  corrupt: one bit is flipped.
    late: s that every packet takes longer.  done: number of packets that were damaged.
    """

    lose: float = 0.0
    drop: float = 0.0
    corrupt: float = 0.0
    late: float = 0.0
    seed: int = 1
    done: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        self.random = Random(self.seed)

    def clear(self) -> None:
        """End all faults."""
        self.lose = self.drop = self.corrupt = self.late = 0.0

    def damage(self, packet: bytes) -> bytes:
        """Return what arrives of a packet; b"" if nothing does."""
        if not packet:
            return packet
        came = self._damage(packet)
        self.done += came != packet
        return came

    def _damage(self, packet: bytes) -> bytes:
        if self._happens(self.lose):
            return b""
        at = self.random.randrange(len(packet))
        if self._happens(self.drop):
            return packet[:at] + packet[at + 1 :]
        if self._happens(self.corrupt):
            wrong = packet[at] ^ 1 << self.random.randrange(8)
            return packet[:at] + bytes([wrong]) + packet[at + 1 :]
        return packet

    def _happens(self, share: float) -> bool:
        return share > 0 and self.random.random() < share


def resampled(portion: bytes, sent: int, heard: int) -> bytes:
    """Return the bytes that a receiver at `heard` bits per second reads.

    sent: bits per second of the sender. The receiver waits for the line to fall, then
    samples it in the middle of each of its own bits. Between portions the line is high.
    """
    levels: list[int] = []
    for byte in portion:
        levels += [0, *(byte >> bit & 1 for bit in range(8)), 1]
    step = sent / heard  # one bit of the receiver, in bits of the sender
    found = bytearray()
    at = _falls(levels, 0)
    while at >= 0:
        middles = (at + (1.5 + bit) * step for bit in range(8))
        looks = [levels[m] if m < len(levels) else 1 for m in map(int, middles)]
        found.append(sum(level << bit for bit, level in enumerate(looks)))
        at = _falls(levels, max(at + 1, int(at + (BITS - 0.5) * step)))
    return bytes(found)


def _falls(levels: list[int], begin: int) -> int:
    """Return where the line falls next, from high to low; -1 if it never does."""
    for at in range(begin, len(levels)):
        if not levels[at] and (at == 0 or levels[at - 1]):
            return at
    return -1
