"""Fleet: emulated Woodbots in a few processes, started and always ended."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Self

from rems_net.agents.experiment.process import HostProcess
from rems_net.errors import AgentError
from rems_net.firmware import build

#: robots that share a process, and its crash
TOGETHER = 5
#: seconds that a process may take to leave the fabric
LEAVING = 5.0


class Fleet:
    """Woodbots on one router. `with Fleet(...) as fleet:`; nothing is left behind.

    robots: the settings of each, as settings.h names them.
    tell: gets a robot's name and a line about it, in a thread of its own.
    user, password: at a router that has users.
    together: how many share a process, and its crash.
    servos: a folder for a file of each robot, `<name>.servos`, with a line for each
    change of its pulses: monotonic time [s], left and right [us].
    """

    def __init__(
        self,
        robots: Sequence[dict[str, str]],
        tell: Callable[[str, str], None],
        *,
        user: str = "",
        password: str = "",
        together: int = TOGETHER,
        servos: Path | None = None,
    ):
        self._tell = tell
        log = str(servos or "")
        self._told = {"user": user, "password": password, "servos": log}
        self._crews = [
            [*robots[i : i + together]] for i in range(0, len(robots), together)
        ]
        self._processes: dict[str, HostProcess] = {}
        self._lock = threading.Lock()
        #: those who are on the fabric
        self.present: set[str] = set()
        #: how each process that ended by itself did so, by the names of its robots
        self.dead: dict[str, str] = {}

    def __enter__(self) -> Self:
        build.library()  # once, before all processes want it
        try:
            for crew in self._crews:
                first, last = crew[0]["name"], crew[-1]["name"]
                name = first if first == last else f"{first} to {last}"
                process = HostProcess(name, self._listen, module="rems_net.firmware")
                self._processes[name] = process
                process.start({"robots": crew, **self._told})
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._processes.values():
            process.leave()
        for process in self._processes.values():
            killer = threading.Timer(LEAVING, process.kill)
            killer.start()
            process.end()
            killer.cancel()

    @property
    def pids(self) -> list[int]:
        """Of its processes, in the order of their robots."""
        return [process.pid for process in self._processes.values()]

    def _listen(self, process: str, line: str) -> None:
        sign, _, name = line.partition(" ")
        with self._lock:
            if sign == "+":
                self.present.add(name)
                self._tell(name, "is on the fabric")
            elif sign == "-":
                self.present.discard(name)
                self._tell(name, "lost its router; it stands, and looks for it")
            else:
                self._tell(process, line.removeprefix("! "))

    def look(self) -> None:
        """Tell of the processes that have ended. Raises AgentError if all have."""
        for name, process in self._processes.items():
            if name not in self.dead and (death := process.death()) is not None:
                self.dead[name] = death
                process.end()  # its last lines
                self._tell(name, f"ended: the process {death}")
        if len(self.dead) == len(self._processes):
            raise AgentError("rems emulate", "all robots have ended")
