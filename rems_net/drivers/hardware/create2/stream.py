"""Stream: finds the frames that a Create 2 sends every 15 ms among the bytes read.

A frame is 19, the number of bytes, then each packet's number and data, and a byte that
makes the sum of all a multiple of 256.
"""

import struct
from collections.abc import Sequence

from rems_net.drivers.hardware.create2 import packets

HEADER = 19


def frame(numbers: Sequence[int], values: dict[str, int]) -> bytes:
    """Return the frame with these packets."""
    each = (bytes([number]) + packets.pack(number, values) for number in numbers)
    body = b"".join(each)
    whole = bytes([HEADER, len(body)]) + body
    return whole + bytes([-sum(whole) % 256])


class Stream:
    """Finder of frames with given packets, by all bytes that are the same in each.

    damaged: number of frames that were lost or wrong.  too_high: subtracted from the
    reported mode, see `waking.begin`.
    """

    def __init__(self, numbers: Sequence[int]):
        self.numbers = tuple(numbers)
        self.damaged = self.too_high = 0
        sizes = [1 + packets.form(number).size for number in self.numbers]
        self._body = sum(sizes)
        self.size = self._body + 3
        #: positions of the packets' numbers in a frame
        self._marks = [2 + sum(sizes[:i]) for i in range(len(sizes))]
        each = [packets.members(number) for number in self.numbers]
        self._names = [packets.PACKETS[one][0] for some in each for one in some]
        forms = ("".join(packets.PACKETS[one][1] for one in some) for some in each)
        self._form = struct.Struct(">" + "".join(f"x{form}" for form in forms))
        self._buffer = bytearray()
        self._skipped = 0

    @property
    def missing(self) -> int:
        """Bytes to read until a frame can be complete, at least 1."""
        return max(1, self.size - len(self._buffer))

    def feed(self, portion: bytes) -> list[dict[str, int]]:
        """Take in bytes; return the packets' values of each complete frame."""
        self._buffer += portion
        found = []
        while len(self._buffer) >= self.size:
            if self._whole():
                values = self._form.unpack_from(self._buffer, 2)
                found.append(dict(zip(self._names, values, strict=True)))
                if self.too_high:
                    found[-1]["mode"] = max(0, found[-1]["mode"] - self.too_high)
                # The skipped bytes were frames, too: damaged ones.
                self.damaged += -(-self._skipped // self.size)
                self._skipped = 0
                del self._buffer[: self.size]
            else:
                after = self._buffer.find(HEADER, 1)
                lost = after if after > 0 else len(self._buffer)
                self._skipped += lost
                del self._buffer[:lost]
        return found

    def _whole(self) -> bool:
        head = self._buffer
        if head[0] != HEADER or head[1] != self._body or sum(head[: self.size]) % 256:
            return False
        return bytes(head[at] for at in self._marks) == bytes(self.numbers)
