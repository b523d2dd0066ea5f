"""Hardware: a stand-in until posix/model.c is there."""

from __future__ import annotations

import math
import random
import time
from typing import Any

from rems_net.firmware import library


class Modelled:
    def __init__(self) -> None:
        self.begun = time.monotonic_ns()
        self.pulse = [0, 0]
        self.at = self.begun
        self.x = self.y = self.heading = 0.0
        functions = {
            name: kind(getattr(self, name))
            for name, kind in library.HARDWARE.items()
            if hasattr(self, name)
        }
        self.struct = library.Hardware(**functions)
        self.keep = functions

    def now(self, _: Any) -> int:
        return (time.monotonic_ns() - self.begun) // 1000 + 1

    def speeds(self) -> list[float]:
        out = []
        for p in self.pulse:
            off = p - 1500 if p else 0
            out.append(max(-7.3, min(7.3, off / 500 * 7.3)))
        return out

    def servo(self, _: Any, wheel: int, pulse: int) -> None:
        now = time.monotonic_ns()
        dt, self.at = (now - self.at) / 1e9, now
        left, right = self.speeds()
        right = -right
        v = 0.02 * (left + right) / 2
        self.heading += dt * 0.02 * (right - left) / 0.1126
        self.x += dt * v * math.cos(self.heading)
        self.y += dt * v * math.sin(self.heading)
        self.pulse[wheel] = pulse

    def feed(self, _: Any) -> None: ...
    def lidar(self, _: Any, which: int, metres: Any) -> int:
        metres[0] = 0.4 + random.gauss(0, 0.01)
        return 0

    def gyro(self, _: Any, rate: Any) -> int:
        rate[0] = 0.0
        return 0

    def compass(self, _: Any, a: Any, b: Any) -> int:
        a[0], b[0] = math.sin(self.heading), math.cos(self.heading)
        return 0

    def lights(self, _: Any, lights: Any) -> None: ...
    def read(self, _: Any, at: int, room: int) -> int:
        return 0

    def write(self, _: Any, at: int, size: int) -> int:
        return size

    def started_by(self, _: Any) -> int:
        return 0
