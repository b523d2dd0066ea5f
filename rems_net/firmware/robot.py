"""Robot: emulated Woodbots of one process: core, modelled hardware, real link.

Each robot has a thread for the loop of its link. One more thread runs the motors of all
robots of the process, so no link can delay them.
"""

import os
import platform
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from ctypes import addressof, byref, create_string_buffer, memmove, string_at
from hashlib import blake2b
from itertools import count
from pathlib import Path
from typing import Any

from rems_net.agents.host.lifeline import Lifeline
from rems_net.drivers.hardware.periodic import Periodic
from rems_net.errors import ExperimentError, RemsError
from rems_net.firmware import library
from rems_net.firmware.hardware import ASKED, ModelledHardware
from rems_net.firmware.link import ZenohLink
from rems_net.router.message import read

#: ms. Longest wait of the link's loop for a message.
WAIT = 20
#: Bytes. Alignment of a struct in C.
ALIGNED = 64
#: s that leaving may take.
GRACE = 3.0
#: Exit statuses.
DONE, WRONG = 0, 2
#: Number of a robot in its process.
_numbers = count()


class EmulatedRobot:
    """A Woodbot in this process. `start`, then `drive` every MOTORS_PERIOD ms; `end`.

    settings: as settings.h names them: `{"name": "woodbot-7", "router": "tcp/..."}`.
    user, password: for a router that has users.
    pulsed: as for ModelledHardware.
    Raises ExperimentError for a wrong setting.
    """

    def __init__(
        self,
        settings: Mapping[str, str],
        user: str = "",
        password: str = "",
        pulsed: Callable[[float, int, int], None] | None = None,
    ):
        self._core = core = library.load()
        self._stored = b""
        self._restart = False
        self._ending = threading.Event()
        #: Held while the core drives: it must not restart meanwhile.
        self._driving = threading.Lock()
        self._number = next(_numbers)
        self._model = ModelledHardware(core, self._number, pulsed)
        own = ("load", "store", "identity", "restart")
        self._functions = {
            name: kind(getattr(self if name in own else self._model, name))
            for name, kind in library.HARDWARE.items()
        }
        self.hardware = library.Hardware(None, *self._functions.values())
        self._settle(settings)
        self._memory, self._bot = _room(core.woodbot_size())
        self.link = ZenohLink(core, self._bot, user, password)
        self._thread = threading.Thread(
            target=self._run, name=settings["name"], daemon=True
        )

    def _settle(self, settings: Mapping[str, str]) -> None:
        """Store the settings, as the console would do it."""
        memory, place = _room(library.size_of(self._core, "settings"))
        self._core.settings_default(place)
        for name, value in settings.items():
            wrong = self._core.settings_set(place, name.encode(), value.encode())
            if wrong:
                raise ExperimentError(f"{name} is {value!r}: {wrong.decode()}. (R0715)")
        self._core.settings_store(place, byref(self.hardware))
        del memory

    def start(self) -> None:
        """Start the core, in its stopped state; then its link searches for a router."""
        self._core.woodbot_start(
            self._bot, byref(self.hardware), byref(self.link.struct)
        )
        self._thread.start()

    def drive(self) -> None:
        """Run the motors' loop once."""
        if self._driving.acquire(blocking=False):
            try:
                self._core.woodbot_drive(self._bot)
            finally:
                self._driving.release()

    def leave(self) -> None:
        """Begin to end: the link's loop stops after its current round."""
        self._ending.set()

    def end(self) -> None:
        """Leave the fabric."""
        self.leave()
        self._thread.join()
        self.link.close()

    def _run(self) -> None:
        while not self._ending.is_set():
            self._core.woodbot_run(self._bot, WAIT)
            if self._restart:
                self._restart = False
                self.link.close()
                with self._driving:
                    self._core.woodbot_start(
                        self._bot, byref(self.hardware), byref(self.link.struct)
                    )

    # -- what of hardware.h is this process's ------------------------------------------

    def load(self, _: Any, place: int, room: int) -> int:
        size = min(len(self._stored), room)
        memmove(place, self._stored, size)
        return size

    def store(self, _: Any, place: int, size: int) -> bool:
        self._stored = string_at(place, size)
        return True

    def identity(self, _: Any) -> int:
        of = f"{platform.node()} {os.getpid()} {self._number}".encode()
        return int.from_bytes(blake2b(of, digest_size=6).digest())

    def restart(self, _: Any) -> None:
        self._model.reset, self._restart = ASKED, True


@contextmanager
def running(robots: Sequence[EmulatedRobot]) -> Iterator[None]:
    """Run robots until the end of the block, with one thread for all their motors."""
    ended = threading.Event()

    def drive() -> None:
        periodic = Periodic(library.MOTORS_PERIOD / 1000)
        while periodic.wait(ended):
            for robot in robots:
                robot.drive()

    motors = threading.Thread(target=drive, name="motors", daemon=True)
    for robot in robots:
        robot.start()
    motors.start()
    try:
        yield
    finally:
        for robot in robots:
            robot.leave()
        for robot in robots:
            robot.end()
        ended.set()
        motors.join()


def _room(size: int) -> tuple[Any, int]:
    """Return memory for a struct of C, and an aligned address in it."""
    memory = create_string_buffer(size + ALIGNED)
    return memory, -(-addressof(memory) // ALIGNED) * ALIGNED


def main(lifeline: Lifeline) -> int:
    """Run the robots until standard input ends; return the exit status."""
    told = read(lifeline.words())
    gone = threading.Event()
    lifeline.on_end(gone.set, GRACE)
    folder, user = told["servos"], (told["user"], told["password"])
    try:
        robots = []
        for settings in told["robots"]:
            path = f"{folder}/{settings['name']}.servos"
            log = log_into(path) if folder else None
            robots.append(EmulatedRobot(settings, *user, pulsed=log))
    except (RemsError, OSError) as error:
        print(error, flush=True)
        return WRONG
    sys.setswitchinterval(0.001)  # so that the motors' thread need not wait for others
    with running(robots):
        gone.wait()
    return DONE


def log_into(path: str) -> Callable[[float, int, int], None]:
    """Return a function that logs each change of a robot's pulses into a file."""
    file = Path(path).open("w", buffering=1, encoding="ascii")  # noqa: SIM115

    def write(time: float, left: int, right: int) -> None:
        with suppress(OSError):  # a full disk does not stop the robot
            file.write(f"{time:.6f} {left} {right}\n")

    return write
