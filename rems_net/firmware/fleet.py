"""Fleet: emulated Woodbots in a few processes, started, watched and always ended."""

import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Self

from rems_net.agents.experiment.hosting.process import HostProcess
from rems_net.errors import AgentError, ExperimentError
from rems_net.events import Event
from rems_net.firmware import build
from rems_net.router.mail import Mailbox, Presence
from rems_net.router.session import Session

#: Robots that share a process, and its crash.
TOGETHER = 5
#: s that a process may take to leave the fabric.
LEAVING = 5.0
#: us. Dead bands of the servos of posix/body.c, as a calibration finds them.
CALIBRATED = {"left_dead_band": "45", "right_dead_band": "45"}
LIBRARY: tuple[str, ...] = (sys.executable, "-m", "rems_net.firmware")


class Fleet:
    """Woodbots on one fabric, in `with Fleet(...) as fleet:`; all end with the block.

    session: on that fabric, open for as long.  names: of the robots.
    tell: callback for a robot's name and a line about it.
    source: which agent commands them, such as `input/keys`; "" allows any.
    program: the posix port, one process for each robot; None for the library.
    together: how many robots share a process, and its crash, with the library.
    servos: a folder for a file of each robot, `<name>.servos`, with a line for each
    change of its pulses: monotonic time [s], left and right [us].
    Raises ExperimentError for a name that is taken.
    """

    def __init__(
        self,
        session: Session,
        names: Sequence[str],
        tell: Callable[[str, str], None],
        *,
        source: str = "",
        program: Path | None = None,
        together: int = TOGETHER,
        servos: Path | None = None,
    ):
        self._session, self._tell = session, tell
        self._program, self._servos = program, servos
        together = 1 if program else together
        where = {"router": session.link.endpoint, "fabric": session.fabric}
        common = where | {"source": source} | CALIBRATED
        robots = [{"name": name} | common for name in names]
        self._crews = [
            robots[i : i + together] for i in range(0, len(robots), together)
        ]
        self._keys = {session.key("robot", name, "@alive"): name for name in names}
        self._seen = Mailbox()
        self._processes: dict[str, HostProcess] = {}
        self._lock = threading.Lock()
        self._present: set[str] = set()
        #: How each process ended that did so by itself, by the names of its robots.
        self.dead: dict[str, str] = {}

    def __enter__(self) -> Self:
        if self._program is None:
            build.library()  # once, before all processes need it
        here = self._session.key("robot", "*", "@alive")
        there = self._session.who(here)
        if taken := [name for key, name in self._keys.items() if key in there]:
            raise ExperimentError(
                f"There is a robot/{taken[0]} already, on "
                f"{self._session.fabric!r}; give this one another: --name NAME (R0715)"
            )
        self._session.watch_presence(here, self._seen)
        try:
            for crew in self._crews:
                first, last = crew[0]["name"], crew[-1]["name"]
                self._begin(first if first == last else f"{first} to {last}", crew)
        except BaseException:
            self.__exit__()
            raise
        return self

    def _begin(self, name: str, crew: list[dict[str, str]]) -> None:
        link, servos = self._session.link, str(self._servos or "")
        user = {"user": link.user, "password": link.password}
        command, spec = LIBRARY, {"robots": crew, "servos": servos, **user}
        if self._program is not None:
            settings = [f"{key}={value}" for key, value in crew[0].items() if value]
            command = (str(self._program), "--control", "-")
            command += tuple(word for one in settings for word in ("--set", one))
            if servos:
                command += ("--servos", str(Path(servos) / f"{name}.servos"))
        process = HostProcess(name, self._say, command=command)
        self._processes[name] = process
        process.start(None if self._program else spec)

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
        """Process IDs, in the order of the robots."""
        return [process.pid for process in self._processes.values()]

    def _say(self, process: str, event: Event) -> None:
        with self._lock:
            self._tell(process, str(event))

    def look(self, seconds: float = 0.0) -> set[str]:
        """Report robots that came or went; wait up to `seconds` if nothing is new.

        Returns the names on the fabric. Raises AgentError if all processes have ended.
        """
        seen = self._seen.get(seconds)
        while isinstance(seen, Presence):
            if (name := self._keys.get(seen.key)) and seen.alive != (
                name in self._present
            ):
                self._present ^= {name}
                told = "is on the fabric" if seen.alive else "is out of sight"
                self._say(name, Event("info", 0, name, "sight", told))
            seen = self._seen.get(0) if not self._seen.empty() else None
        for name, process in self._processes.items():
            if name not in self.dead and (death := process.death()) is not None:
                self.dead[name] = death
                process.end()  # so that its last lines arrive
                text = f"ended: the process {death}"
                self._say(name, Event("error", 0, name, "ended", text))
        if len(self.dead) == len(self._processes):
            raise AgentError("rems board emulate", "all robots have ended (R0715)")
        return self._present
