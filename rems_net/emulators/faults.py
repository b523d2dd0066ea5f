"""Faults: what goes wrong with the packets of a line, one way."""

from dataclasses import dataclass, field
from random import Random


@dataclass
class Faults:
    """Shares (0 to 1) of the packets that something happens to; changed at any time.

    lose: all of it.  drop: one of its bytes.  corrupt: one bit of it is another.
    late: seconds that every packet takes longer.  done: to how many something happened.
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
        """From now on nothing goes wrong."""
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
