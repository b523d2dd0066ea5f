"""The supervisor on a bench: its link answers as Python says, and tells its calls."""

import ctypes
from enum import IntEnum
from pathlib import Path
from typing import NamedTuple

from tests.firmware.compiling import CORE, FIRMWARE, library

SOURCES = [CORE / "safety" / "supervisor.c", FIRMWARE / "test" / "bench_supervisor.c"]
#: us; of supervisor.h: a session that lasted so long was a good one
HELD = 2_000_000


class Phase(IntEnum):
    NETWORK, OPENING, DECLARING, OPEN, CLOSING, WAITING = range(6)


class Cause(IntEnum):
    (
        NONE,
        NO_NETWORK,
        NOT_OPENED,
        NOT_DECLARED,
        PUT,
        NO_ROUTER,
        DEAF,
        SILENT,
        SETTINGS,
    ) = range(9)


class World(NamedTuple):
    """What the link answers. `declares` 2: a put of the declarations fails."""

    network: bool = True
    opens: bool = True
    up: bool = True
    declares: int = 1


class State(ctypes.Structure):
    """What the supervisor is left with; the struct of bench_supervisor.c."""

    _fields_ = (
        *(
            (name, ctypes.c_uint32)
            for name in ("phase", "cause", "locator", "attempt", "session", "opened")
        ),
        ("until", ctypes.c_uint64),
    )
    phase: int
    cause: int
    locator: int
    attempt: int
    session: int
    opened: int
    until: int


class Supervisor:
    def __init__(self, made: Path):
        self._c = ctypes.CDLL(str(library(SOURCES, made)))
        self._c.bench_size.restype = ctypes.c_size_t
        time = ctypes.c_uint64
        self._c.bench_step.argtypes = [time, ctypes.c_char_p, ctypes.c_void_p]
        self._c.bench_fail.argtypes = [ctypes.c_int, time]
        self._calls = ctypes.create_string_buffer(16)

    def start(self, locators: int) -> None:
        self._c.bench_locators(locators)
        self._c.bench_start()

    def locators(self, count: int) -> None:
        self._c.bench_locators(count)

    def save(self) -> ctypes.Array[ctypes.c_char]:
        saved = ctypes.create_string_buffer(self._c.bench_size())
        self._c.bench_save(saved)
        return saved

    def load(self, saved: ctypes.Array[ctypes.c_char]) -> None:
        self._c.bench_load(saved)

    def fail(self, cause: Cause, now: int) -> None:
        self._c.bench_fail(int(cause), now)

    def step(self, world: World, now: int) -> tuple[str, State]:
        """The calls of a step: `a`, `b`, `c` open there, declare, gone, `x`: close."""
        state = State()
        network = 2 if world.network else 1
        self._c.bench_world(network, world.opens, world.up, world.declares)
        self._c.bench_step(now, self._calls, ctypes.byref(state))
        return self._calls.value.decode(), state
