"""Harmless: while a user's code is tried, it changes no file and opens no device.

The interpreter reports each action before the code does it (PEP 578), and a hook can
refuse it. The actions of a library's C code are not reported.
"""

import os
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any, ClassVar, Self

from rems_net.agents.background.overdue import agent_of
from rems_net.agents.diagnosis import no_keyboard, where
from rems_net.errors import ExperimentError

#: Audit events that change the paths they are called with.
CHANGES = {"os.mkdir", "os.remove", "os.rename", "os.rmdir", "os.link", "os.symlink"}
CHANGES |= {"os.truncate", "os.chmod", "shutil.rmtree", "sqlite3.connect"}
CONNECTS = {"socket.bind", "socket.connect", "socket.sendto"}
WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
#: Prefixes of devices, and those of Linux and macOS that are harmless.
DEVICES = ("/dev/", "\\\\.\\")
NO_DEVICES = {"/dev/null", "/dev/zero", "/dev/random", "/dev/urandom"}


class RefusedError(ExperimentError, PermissionError):
    """Error in a user's code that would change something."""


class Harmless:
    """Refuses agents to write outside its `folder`, and to open devices, connections.

    folder: exists while the block runs.  refused: by the key of an agent, the first
    action that was refused.
    """

    _now: "ClassVar[Harmless | None]" = None
    _hooked = False

    def __enter__(self) -> Self:
        if not Harmless._hooked:  # a hook cannot be removed
            Harmless._hooked = True
            sys.addaudithook(_hook)
        self.refused: dict[str, str] = {}
        self._made = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self.folder = Path(self._made.name).resolve()
        self._before, tempfile.tempdir = tempfile.tempdir, str(self.folder)
        Harmless._now = self
        return self

    def __exit__(self, *_: object) -> None:
        Harmless._now = None
        tempfile.tempdir = self._before
        self._made.cleanup()

    def look(self, event: str, words: tuple[Any, ...]) -> None:
        """Raise RefusedError for an action that is not allowed now."""
        why = self._why(event, words)
        if not why:
            return
        agent = agent_of(sys._getframe())
        if agent is None and not threading.current_thread().name.startswith("job"):
            return
        self.refused.setdefault("" if agent is None else agent.key, why)
        stood = where(threading.current_thread())
        raise RefusedError(
            f"it {why} ({stood}) before it is open; do that in open(self). (R0430)"
        )

    def _why(self, event: str, words: tuple[Any, ...]) -> str:
        """Return the action that is refused; "" if there is none."""
        if event in CONNECTS:
            return "would open a connection"
        if event == "open":  # path or descriptor, mode, flags
            if str(words[0]).startswith(DEVICES) and words[0] not in NO_DEVICES:
                return f"would open {words[0]}"
            words = words[:1] if words[2] & WRITES else ()
        for word in words:
            if isinstance(word, str | bytes) and not self._may(os.fsdecode(word)):
                return f"would write {os.fsdecode(word)}"
        return ""

    def _may(self, path: str) -> bool:
        full = Path(os.path.realpath(path))
        free = "__pycache__" in full.parts or path in (":memory:", *NO_DEVICES)
        return free or full.is_relative_to(self.folder)


def _hook(event: str, words: tuple[Any, ...]) -> None:
    now = Harmless._now
    if now is None:
        return
    if event == "open" or event in CHANGES or event in CONNECTS:
        now.look(event, words)
    elif event == "builtins.input":
        no_keyboard()
