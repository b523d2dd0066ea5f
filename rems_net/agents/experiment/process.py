"""Host processes on this machine: started, listened to, and always ended."""

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import IO, Any

from rems_net.agents.protocol.limits import OVER, OVER_SAID
from rems_net.events import Event, read_line
from rems_net.interrupts import without_ctrl_c
from rems_net.maths.numerics import environment
from rems_net.router.message import pack

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
