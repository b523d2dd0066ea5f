"""Hosts: the processes that a run, or a machine, starts for its agents."""

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from secrets import randbits
from typing import IO, Any

from rems_net.agents.agent import Agent
from rems_net.agents.experiment.show import Reports, Show
from rems_net.agents.experiment.source.values import values
from rems_net.agents.protocol.limits import OVER, OVER_SAID, backoff
from rems_net.agents.protocol.plan import Plan, written
from rems_net.errors import AgentError, uncoded
from rems_net.events import Event, read_line
from rems_net.interrupts import without_ctrl_c
from rems_net.maths.numerics import environment
from rems_net.router.files import PROCESS, check_files
from rems_net.router.message import pack
from rems_net.router.settings import Link

#: s. A run ends within this time, also after errors.
END = 2.0
#: s. Time between two checks of processes that nothing else watches.
LOOK = 0.05
#: the command of a host process
HOST = (sys.executable, "-m", "rems_net.agents.host")
#: On Windows a pipe takes only Western letters by default: others would end a run.
PRINTS = {"PYTHONIOENCODING": "utf-8:backslashreplace"}


class HostProcess:
    """One process that runs agents.

    say: called with its name and each event of it.  command: its command line; the
    program must end with its standard input.
    native: whether it uses all features of this processor. Then the last digits of
    recordings differ from those of other processors.

    The process reads its plans from its standard input, which stays open: if this
    process dies in any way, the host reads the end of its input and stops.
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
        """Start it, and send `spec` (plain data) if there is one."""
        # A terminal's signals are for the run. Ctrl+Z, or closing the window, would
        # take the driver away from a moving robot. A process group of its own is
        # enough; with a session for each host, Linux would divide the cores by session
        # (autogroup): 1.7 times as many task switches per tick.
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
            with suppress(BrokenPipeError):  # it died at once, which is reported later
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
        """Return how it died, if it did, such as `was killed by signal 9`."""
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
        """Close its standard input, so that it closes its agents and ends."""
        if self._process is not None and self._process.stdin is not None:
            with suppress(BrokenPipeError):  # it died with its input unread
                self._process.stdin.close()

    def kill(self) -> None:
        """End it by force, if it has not ended."""
        if self._process is not None:
            self._process.kill()

    def end(self) -> None:
        """Wait for its end, and for the last lines that it printed."""
        process = self._process
        if process is None:
            return
        process.wait()
        self.leave()
        if self._reader is not None:
            self._reader.join(1.0)
        elif process.stdout is not None:
            process.stdout.close()  # Ctrl+C came before the reader was started


def restarts(plans: Mapping[str, Sequence[Plan]]) -> dict[str, int]:
    """Return how often each host may be started again: the maximum over its agents."""
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
        #: the number by which each host proves to the clock that this run started it
        self.tickets = {name: 1 + randbits(62) for name in plans}
        self._dead: dict[str, int] = {}
        #: the spec that each host was started with
        self._specs: dict[str, dict[str, Any]] = {}
        self._lock = threading.Lock()
        #: for programs that look at the run, once it has a session
        self.reports: Reports | None = None
        #: the last STOP that was shown
        self._stop = ""
        self._failed: dict[str, str] = {}  # why a host on an open fabric has failed

    def start(self, link: Link, *, own: bool = True, free: bool = False) -> None:
        """Start one process for each host. own: the clock is in this process, too.

        free: the hosts join an open fabric, whose clock waits for no host.

        Raises FabricError for too few file handles.
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
        """Start a crashed host's process again; ignore a host of another machine."""
        crashed = self.processes.get(name)
        if crashed is not None:
            crashed.kill()
            crashed.end()
            self._dead.pop(name, None)
            self._specs[name]["restarts"] += 1
            self._start(name)

    def words(self, name: str) -> dict[str, Any]:
        """Return the plans of a host, and the arguments and values of its script."""
        plans = self.plans[name]
        return {
            "argv": [os.fsencode(word) for word in sys.argv],
            "values": values(plans),
            "folder": str(plans[0].folder),
            "out": str(plans[0].out),
            **written(plans, self.agents, self._dt),
        }

    def look(self) -> None:
        """Raise AgentError for the first process that died, with its exit status.

        Raises it once for each process.
        """
        for name, process in self.processes.items():
            if death := process.death():
                self._dead[name] = self._dead.get(name, 0) + 1
                # At the first look, its last lines may still be on their way.
                if self._dead[name] == 2:
                    raise AgentError(name, f"{death} (R0522)")

    def wait(self) -> None:
        """Wait until every process has ended by itself; start crashed ones again.

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
                        raise AgentError(name, self._reported(name, death))
                    continue
                count += 1
                why = uncoded(self._reported(name, death)).removeprefix("was ")
                text = (
                    f"{name} crashed ({why}); started again, {count} of {allowed[name]}"
                )
                self.say(name, Event("info", 0, name, "crashed", text))
                pause.wait(backoff(count))
                self.start_again(name)
            pause.wait(LOOK)

    def lives(self, name: str) -> bool:
        """Return whether the process of this host runs, seen on the fabric or not."""
        return name in self.processes and self.processes[name].death() is None

    def leave(self) -> None:
        """Let every process close its agents and send its farewell; then end it."""
        for process in self.processes.values():
            process.leave()
        self.end(END)

    def end(self, patience: float) -> None:
        """Wait at most `patience` seconds for all of them to end, then kill them."""
        timer = threading.Timer(patience, self._kill)
        timer.start()
        for process in self.processes.values():
            process.end()
        timer.cancel()

    def _kill(self) -> None:
        for process in self.processes.values():
            process.kill()

    def _reported(self, name: str, death: str) -> str:
        """Return why a process ended, as it has reported, or else how it ended."""
        self.processes[name].end()  # its last message may still be on its way
        said = self._failed.pop(name, "").removeprefix(f"{name}: ")
        return said or f"{death} (R0522)"

    def say(self, source: str, event: Event) -> None:
        """Pass on the reports of a process, one event at a time."""
        with self._lock:
            if event.kind == "failed" and self._specs[source]["free"]:
                self._failed[source] = event.text  # shown once, by wait()
                return
            if event.kind == "stop":  # each process receives it
                if event.text == self._stop:
                    return
                self._stop = event.text
            self.show.say(source, event)
            if self.reports is not None:
                self.reports.put(replace(event, agent=event.agent or source))
