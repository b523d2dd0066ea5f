"""Hardware: the functions of hardware.h over a modelled Woodbot (posix/body.c).

Servos with a dead band drive it over the floor of a round arena. Its sensors have the
noise and the update rates of those on the board.
"""

import math
import random
import threading
import time
from collections.abc import Callable
from ctypes import CDLL, byref
from typing import Any

from rems_net.agents.wall import wall
from rems_net.firmware import library

#: us between two readings: of both lidars, the gyroscope and the compass.
LIDAR, GYRO, COMPASS = 33_000, 9_600, 10_000
#: Standard deviations: ratio to the distance, rad/s, ratio to the field.
LIDAR_NOISE, GYRO_NOISE, COMPASS_NOISE = 0.04, 0.0035, 0.01
#: Units of the compass. Strength of the field here.
FIELD = 750.0
#: Numbers from hardware.h.
NEW, OLD = 0, 1
POWER, ASKED = 0, 1


class ModelledHardware:
    """A Woodbot in the middle of its arena. Two threads call it, as in hardware.h.

    seed: of its sensors' noise.
    pulsed: called in the motors' thread when the servos' pulses change, with the
    monotonic time [s] and the pulses of the left and right servo [us].
    """

    def __init__(
        self,
        core: CDLL,
        seed: int,
        pulsed: Callable[[float, int, int], None] | None = None,
    ):
        self._core, self._pulsed = core, pulsed
        self._random = random.Random(seed)
        self._begun = wall()
        self._next = {"lidar0": 0, "lidar1": 0, "gyro": 0, "compass": 0}
        self._lock = threading.Lock()
        #: Cause of its start, as hardware.h numbers it.
        self.reset = POWER
        self.body = library.Body()
        core.body_default(byref(self.body))

    # -- both tasks -------------------------------------------------

    def now(self, _: Any = None) -> int:
        return 1 + int(1e6 * (wall() - self._begun))

    # -- the motors' task -------------------------------------------

    def servo(self, _: Any, wheel: int, pulse: int) -> None:
        servo = self.body.servo[wheel]
        if pulse == servo.pulse:
            return
        with self._lock:
            self._core.body_advance(byref(self.body), self.now())
            servo.pulse = pulse
        if self._pulsed is not None:
            pulses = (int(one.pulse) for one in self.body.servo)
            self._pulsed(time.monotonic(), *pulses)

    def feed(self, _: Any) -> None:
        """Do nothing: a process that hangs is seen by its user, without a watchdog."""

    # -- the link's task --------------------------------------------

    def _due(self, part: str, period: int) -> bool:
        """Return whether a part has a new reading; then advance the body to now."""
        now = self.now()
        if now < self._next[part]:
            return False
        self._next[part] = now + period
        with self._lock:
            self._core.body_advance(byref(self.body), now)
        return True

    def lidar(self, _: Any, which: int, metres: Any) -> int:
        if not self._due(f"lidar{which}", LIDAR):
            return OLD
        seen = self._core.body_lidar(byref(self.body), which)
        metres[0] = seen * (1 + self._random.gauss(0, LIDAR_NOISE))
        return NEW

    def gyro(self, _: Any, rate: Any) -> int:
        if not self._due("gyro", GYRO):
            return OLD
        turning = self._core.body_turning(byref(self.body))
        rate[0] = turning + self._random.gauss(0, GYRO_NOISE)
        return NEW

    def compass(self, _: Any, ahead: Any, left: Any) -> int:
        if not self._due("compass", COMPASS):
            return OLD
        heading = self.body.heading
        for place, part in ((ahead, math.sin(heading)), (left, math.cos(heading))):
            place[0] = FIELD * (part + self._random.gauss(0, COMPASS_NOISE))
        return NEW

    def lights(self, _: Any, lights: Any) -> None:
        """Do nothing: nobody looks at them."""

    def read(self, _: Any, place: int, room: int) -> int:
        """Read nothing: nobody types at its console."""
        return 0

    def write(self, _: Any, place: int, size: int) -> int:
        return size

    def started_by(self, _: Any) -> int:
        return self.reset
