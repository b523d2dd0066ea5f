"""The keeper of a rig: ends all its processes when whoever built it is gone.

`python -m tests.reliability.rig.keeper MARK FOLDER` waits until its standard input
closes, which happens whether its parent leaves in order or is killed, and then kills
every process that has MARK in its environment, frozen ones and children of children,
too, and removes FOLDER.
"""

import os
import shutil
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path

#: seconds after which it gives up; a process in the kernel's hands can't be killed
KILL_TIMEOUT = 10.0
LOOK = 0.02


def marked(mark: str) -> list[int]:
    """The processes that have `mark` in their environment, but for this one."""
    found = []
    for folder in Path("/proc").iterdir():
        if not folder.name.isdigit() or int(folder.name) == os.getpid():
            continue
        try:
            environment = (folder / "environ").read_bytes()
            status = (folder / "stat").read_text("utf-8").rpartition(") ")[2][0]
        except OSError:  # it has ended, or is another user's
            continue
        if mark.encode() in environment.split(b"\0") and status not in "ZX":
            found.append(int(folder.name))
    return found


def main() -> int:
    for sign in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(sign, signal.SIG_IGN)
    while os.read(0, 4096):
        pass
    deadline = time.monotonic() + KILL_TIMEOUT
    # Twice nobody: a process may have been started while the first look was taken.
    nobody = 0
    while nobody < 2 and time.monotonic() < deadline:
        found = marked(sys.argv[1])
        nobody = 0 if found else nobody + 1
        for pid in found:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        time.sleep(LOOK)
    for folder in sys.argv[2:]:
        shutil.rmtree(folder, ignore_errors=True)
    return 0 if nobody == 2 else 1


if __name__ == "__main__":
    sys.exit(main())
