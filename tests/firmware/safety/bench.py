"""The motors on a bench: time is set, and pulses are read, from Python."""

import ctypes
from enum import IntEnum
from pathlib import Path

from rems_net.robots.woodbot import Woodbot
from tests.firmware.compiling import CORE, FIRMWARE, library

#: how old a command may be that is obeyed, and the period of the motors' task, us
MAX_AGE = round(Woodbot.max_age * 1e6)
PERIOD = 10_000
#: of a wheel, rad/s
TOP = float(Woodbot.parameters.schema().max_wheel_speed)
SOURCES = [
    *(CORE / "safety" / name for name in ("motors.c", "handover.c")),
    *(CORE / name for name in ("codec.c", "woodbot_schemas.c")),
    FIRMWARE / "test" / "bench_motors.c",
]


class Why(IntEnum):
    """Why the wheels stand; in the order of motors.h."""

    DRIVEN, STARTED, STOPPED, OLD, NO_TICK, LEFT, WRONG = range(7)


class Reading(ctypes.Structure):
    """What a step of the motors came to; the struct of bench_motors.c."""

    _fields_ = (
        *((name, ctypes.c_double) for name in ("left", "right", "x", "y", "heading")),
        ("tick", ctypes.c_uint64),
        ("since", ctypes.c_uint64),
        ("why", ctypes.c_uint32),
        ("expired", ctypes.c_uint32),
        ("pulses", ctypes.c_uint32 * 2),
        ("feeds", ctypes.c_uint32),
    )
    left: float
    right: float
    x: float
    y: float
    heading: float
    tick: int
    since: int
    why: int
    expired: int
    pulses: ctypes.Array[ctypes.c_uint32]
    feeds: int


class Servo(ctypes.Structure):
    """Settings of a wheel's servo; see motors.h."""

    _fields_ = (
        ("trim", ctypes.c_double),
        ("dead_band", ctypes.c_double),
        ("top_speed", ctypes.c_double),
        ("reversed", ctypes.c_bool),
    )
    trim: float
    dead_band: float
    top_speed: float
    reversed: bool


#: servos as they are mounted: the right one turns the other way
PLAIN = Servo(0.0, 45.0, TOP, False), Servo(0.0, 45.0, TOP, True)


class Bench:
    """The core's motors, and hardware that is a clock and two numbers. Times in us."""

    def __init__(self, made: Path):
        self._c = ctypes.CDLL(str(library(SOURCES, made)))
        double, time = ctypes.c_double, ctypes.c_uint64
        self._c.bench_tell.argtypes = [double, double, time, time]
        for name in ("start", "now", "tick"):
            getattr(self._c, f"bench_{name}").argtypes = [time]
        self._c.bench_set.restype = ctypes.c_bool
        self.now = 0

    def start(self, now: int) -> None:
        self.now = now
        self._c.bench_start(now)

    def wait(self, us: int) -> None:
        self.now += us
        self._c.bench_now(self.now)

    def tell(self, left: float, right: float, said: int, tick: int) -> None:
        self._c.bench_tell(left, right, said, tick)

    def tick(self, heard: int | None = None) -> None:
        self._c.bench_tick(self.now if heard is None else heard)

    def stop(self, why: Why) -> None:
        self._c.bench_stop(int(why))

    def release(self) -> None:
        self._c.bench_release()

    def reset(self) -> None:
        self._c.bench_reset()

    def set(self, left: Servo, right: Servo) -> bool:
        return bool(self._c.bench_set((Servo * 2)(left, right)))

    def step(self) -> Reading:
        reading = Reading()
        self._c.bench_step(ctypes.byref(reading))
        return reading

    # -- in short --------------------------------------------------------------

    def begin(self, now: int = 1_000_000) -> None:
        """Nothing was told yet, but what its servos are."""
        self.start(now)
        assert self.set(*PLAIN)

    def drive(self, left: float, right: float, tick: int = 1) -> Reading:
        """A command that is said, told and obeyed at once, if any is."""
        self.wait(1)
        self.tick()
        self.tell(left, right, self.now, tick)
        return self.step()


def stands(reading: Reading) -> bool:
    return list(reading.pulses) == [0, 0] and reading.left == reading.right == 0
