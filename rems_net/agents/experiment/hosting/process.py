"""Process: a program that runs agents, or any other that ends with this one."""

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import IO, Any

from rems_net.agents.protocol.limits import OVER, OVER_SAID
from rems_net.events import Event, read_line
from rems_net.maths.numerics import environment
from rems_net.router.message import pack
from rems_net.system.interrupts import APART, ending, without_ctrl_c

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
        with without_ctrl_c():
            self._process = subprocess.Popen(
                [*self._command],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                creationflags=APART,
                process_group=0,
                env=environment(os.environ, native=self._native) | PRINTS,
            )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        if spec is not None:
            payload = pack(dict(spec))
            with suppress(OSError):  # it died at once, which is reported later
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
        return ending(status)

    @property
    def status(self) -> int | None:
        """Its exit status, once it has ended."""
        return self._process.poll() if self._process else None

    def leave(self) -> None:
        """Close its standard input, so that it closes its agents and ends."""
        if self._process is not None and self._process.stdin is not None:
            with suppress(OSError):  # it died with its input unread
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
