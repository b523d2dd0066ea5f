"""Hosts: the processes that a run, or a machine, starts for its agents."""

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from secrets import randbits
from typing import IO, Any

from rems_net.agents.agent import Agent
from rems_net.agents.experiment.show import Show
from rems_net.agents.experiment.source.values import values
from rems_net.agents.protocol.limits import OVER, OVER_SAID, backoff
from rems_net.agents.protocol.plan import Plan, written
from rems_net.errors import AgentError
from rems_net.events import Event, read_line
from rems_net.interrupts import without_ctrl_c
from rems_net.maths.numerics import environment
from rems_net.router.files import PROCESS, check_files
from rems_net.router.message import pack
from rems_net.router.settings import Link

#: seconds a run may take to end, whatever happened
END = 2.0
#: seconds between looks at processes that nobody else watches
LOOK = 0.05
#: what a host process runs
HOST = (sys.executable, "-m", "rems_net.agents.host")
#: On Windows a pipe would take Western letters only, and a print of others end a run.
PRINTS = {"PYTHONIOENCODING": "utf-8:backslashreplace"}


class HostProcess:
    """One process that runs agents; `say` gets its name and each event of it.

    command: what it runs, which ends with its standard input.
    native: whether it uses all that this processor has, at the price of recordings
    that differ in their last digits from those of others.

    What it shall run goes through its standard input, which stays open: when this
    process dies, whatever the way, the host reads its end and stops.
    """

    def __init__(
        self,
        name: str,
        say: Callable[[str, Event], None],
        *,
        command: Sequence[str] = HOST,
        native: bool = False,
    ):
        self.name, self._say = name, say
        self._command, self._native = command, native
        self._process: subprocess.Popen[bytes] | None = None
        self._reader: threading.Thread | None = None

    def start(self, spec: Mapping[str, Any] | None) -> None:
        """Start it with `spec`, plain data, if it wants any."""
        # A terminal's signals are for the run. Ctrl+Z, or a window that is closed,
        # would take a driver away from a robot that drives. A group of its own is
        # enough; with a session of its own for each host, Linux would share out the
        # cores by session (autogroup): 1.7 times as many switches a tick.
        apart = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
        apart |= getattr(subprocess, "CREATE_NO_WINDOW", 0)
        with without_ctrl_c():
            self._process = subprocess.Popen(
                [*self._command],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                creationflags=apart,
                process_group=0,
                env=environment(os.environ, native=self._native) | PRINTS,
            )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        if spec is not None:
            payload = pack(dict(spec))
            with suppress(BrokenPipeError):  # it died at once, which is told
                self._process.stdin.write(len(payload).to_bytes(4, "little") + payload)
                self._process.stdin.flush()
        self._reader = threading.Thread(
            target=self._listen, args=(self._process.stdout,), daemon=True
        )
        self._reader.start()

    def _listen(self, pipe: IO[bytes]) -> None:
        with pipe:
            for line in pipe:
                text = line.decode(errors="replace").rstrip()
                for event in read_line(text, self.name):
                    event.log()
                    self._say(self.name, event)

    @property
    def pid(self) -> int:
        return self._process.pid if self._process else 0

    def death(self) -> str | None:
        """How it died, if it did: `was killed by signal 9`, `exited with status 1`."""
        status = self.status
        if status is None:
            return None
        if status == OVER:
            return OVER_SAID
        if status < 0:
            return f"was killed by signal {-status}"
        return f"exited with status {status}"

    @property
    def status(self) -> int | None:
        """Its exit status, once it has ended."""
        return self._process.poll() if self._process else None

    def leave(self) -> None:
        """Tell it that nobody needs it any more: it closes its agents."""
        if self._process is not None and self._process.stdin is not None:
            with suppress(BrokenPipeError):  # it died with its input unread
                self._process.stdin.close()

    def kill(self) -> None:
        """End it by force, if it has not ended."""
        if self._process is not None:
            self._process.kill()

    def end(self) -> None:
        """Wait for its end, and for the last lines it printed."""
        process = self._process
        if process is None:
            return
        process.wait()
        self.leave()
        if self._reader is not None:
            self._reader.join(1.0)
        elif process.stdout is not None:
            process.stdout.close()  # Ctrl+C came before anybody read it


def restarts(plans: Mapping[str, Sequence[Plan]]) -> dict[str, int]:
    """How often each host may be started again: as its agents say, the most of them."""
    return {host: max(p.restart for p in some) for host, some in plans.items()}


class Hosts:
    """The host processes that this process has started."""

    def __init__(
        self,
        plans: Mapping[str, Sequence[Plan]],
        agents: Mapping[str, Agent],
        show: Show,
        dt: float,
        *,
        native: bool = False,
    ):
        self.plans, self.agents, self.show = plans, agents, show
        self._dt, self._native = dt, native
        self.processes: dict[str, HostProcess] = {}
        #: what each proves itself with to the clock
        self.tickets = {name: 1 + randbits(62) for name in plans}
        self._dead: dict[str, int] = {}
        #: what each was started with
        self._specs: dict[str, dict[str, Any]] = {}
        self._lock = threading.Lock()
        #: the last STOP that was shown
        self._stop = ""

    def start(self, link: Link, *, own: bool = True, free: bool = False) -> None:
        """Start one process for each host. own: the clock is in this process, too.

        free: they come to an open fabric, whose clock waits for nobody.

        Raises FabricError for too few files.
        """
        check_files(PROCESS * len(self.plans))
        for name in self.plans:
            self._specs[name] = {
                "endpoint": link.endpoint,
                "fabric": link.fabric,
                "user": link.user,
                "password": link.password,
                "host": name,
                "free": free,
                "brought": False,
                "restarts": 0,
                "ticket": self.tickets[name] if own else 0,
                # bytes, since a folder's name need not be UTF-8
                "path": [os.fsencode(entry) for entry in sys.path],
                **self.words(name),
            }
            self._start(name)

    def _start(self, name: str) -> None:
        self.processes[name] = HostProcess(name, self.say, native=self._native)
        self.processes[name].start(self._specs[name])

    def start_again(self, name: str) -> None:
        """Start the process of a host that crashed; of another machine's, nothing."""
        crashed = self.processes.get(name)
        if crashed is not None:
            crashed.kill()
            crashed.end()
            self._dead.pop(name, None)
            self._specs[name]["restarts"] += 1
            self._start(name)

    def words(self, name: str) -> dict[str, Any]:
        """What a host is told of its agents, and of the script that they are from."""
        plans = self.plans[name]
        return {
            "argv": [os.fsencode(word) for word in sys.argv],
            "values": values(plans),
            "folder": str(plans[0].folder),
            "out": str(plans[0].out),
            **written(plans, self.agents, self._dt),
        }

    def look(self) -> None:
        """Blame the first process that died, with what the system says of its death.

        Raises AgentError, once for each.
        """
        for name, process in self.processes.items():
            if death := process.death():
                self._dead[name] = self._dead.get(name, 0) + 1
                # At the first look its own last words may still be on their way.
                if self._dead[name] == 2:
                    raise AgentError(name, death)

    def wait(self) -> None:
        """Wait until every process has ended by itself; start again what crashed.

        Raises AgentError for one that failed, and is not to be started again.
        """
        allowed, pause = restarts(self.plans), threading.Event()
        left = list(self.processes)
        while left:
            for name in list(left):
                process, count = self.processes[name], self._specs[name]["restarts"]
                death = process.death()
                if death is None:
                    continue
                if process.status in (0, OVER) or count >= allowed[name]:
                    left.remove(name)
                    if process.status:
                        raise AgentError(name, death)
                    continue
                count += 1
                text = (
                    f"{name} crashed ({death.removeprefix('was ')}); started again, "
                    f"{count} of {allowed[name]}"
                )
                self.say(name, Event("info", 0, name, "crashed", text))
                pause.wait(backoff(count))
                self.start_again(name)
            pause.wait(LOOK)

    def lives(self, name: str) -> bool:
        """Whether the process of this host runs: seen on the fabric or not."""
        return name in self.processes and self.processes[name].death() is None

    def leave(self) -> None:
        """Let every process close its agents and say farewell, then end it."""
        for process in self.processes.values():
            process.leave()
        self.end(END)

    def end(self, patience: float) -> None:
        """Wait for their ends, for `patience` seconds in all, then make them."""
        timer = threading.Timer(patience, self._kill)
        timer.start()
        for process in self.processes.values():
            process.end()
        timer.cancel()

    def _kill(self) -> None:
        for process in self.processes.values():
            process.kill()

    def say(self, source: str, event: Event) -> None:
        """Pass on what a process reports: one event at a time."""
        with self._lock:
            if event.kind == "stop":  # each process receives it
                if event.text == self._stop:
                    return
                self._stop = event.text
            self.show.say(source, event)
