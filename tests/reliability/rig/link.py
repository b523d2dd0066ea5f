"""Link: what happens to packets on their way from one machine to another."""

import random
from dataclasses import dataclass

#: seconds of traffic that wait for a link with a rate; what is more is dropped
QUEUE = 0.2


@dataclass(slots=True)
class Link:
    """One direction between two machines.

    delay, jitter: seconds; each packet takes delay +/- jitter, evenly spread, and
    never overtakes the one before it (as on one radio channel)
    loss: share of packets that is lost, 0 to 1
    rate: bits per second; 0 for no limit
    cut: nothing comes through, not even what is on its way
    multicast: what is for everybody comes through, too; many networks filter it
    """

    delay: float = 0.0
    jitter: float = 0.0
    loss: float = 0.0
    rate: float = 0.0
    cut: bool = False
    multicast: bool = True
    passed: int = 0
    lost: int = 0
    _free: float = 0.0
    _newest: float = 0.0

    def change(self, **what: float | bool) -> None:
        """Set some of delay, jitter, loss, rate, cut and multicast.

        Raises ValueError.
        """
        for name, value in what.items():
            if name.startswith("_") or name not in self.__slots__[:6]:
                raise ValueError(f"a link has no {name}")
            if value < 0 or (name == "loss" and value > 1):
                raise ValueError(f"{name} is {value}")
            setattr(self, name, value)
        if self.jitter > self.delay:
            raise ValueError(f"jitter {self.jitter} is above delay {self.delay}")

    def due(self, now: float, size: int) -> float | None:
        """Return when a packet of `size` bytes comes out; None if it is lost."""
        if self.cut or (self.loss and random.random() < self.loss):
            self.lost += 1
            return None
        out = now
        if self.rate:
            if self._free - now > QUEUE:
                self.lost += 1
                return None
            self._free = out = max(now, self._free) + 8 * size / self.rate
        out += self.delay
        if self.jitter:
            out += random.uniform(-self.jitter, self.jitter)
        self._newest = out = max(out, self._newest)
        return out
