"""An emulated device in a terminal: it is said how it is, and told what goes wrong."""

from __future__ import annotations

import os
import sys
import threading
from contextlib import suppress
from textwrap import fill

from rems_net.cli.words import warn
from rems_net.emulators.known import Emulated, emulated
from rems_net.errors import RemsError

#: seconds between two lines of how it is, at least
LOOK = 1.0


def emulate(name: str, port: str) -> int:
    """Emulate a device until Ctrl+C, or until it fails. Returns the exit status."""
    with suppress(KeyboardInterrupt), emulated(name, port) as device:
        print(f"{name} at {device.where}; Ctrl+C ends it", flush=True)
        can = f"rems: type what is to happen: {', '.join(device.words)}"
        print(fill(can, 79, break_on_hyphens=False), file=sys.stderr, flush=True)
        # Waits for a line for as long as it takes, and ends with this process.
        threading.Thread(target=_listen, args=(device,), daemon=True).start()
        _show(device)
    return 0


def _listen(device: Emulated) -> None:
    """Tell the device what is typed."""
    rest = b""
    # Not sys.stdin, whose lock a thread that still waits would keep at the end.
    while came := os.read(0, 4096):
        *lines, rest = (rest + came).split(b"\n")
        for line in lines:
            try:
                if line.strip():
                    device.tell(line.decode(errors="replace"))
            except RemsError as error:
                warn(error)


def _show(device: Emulated) -> None:
    """Print how it is, whenever that has changed, until it has failed."""
    before = ""
    pause = threading.Event()
    while device.failure is None:
        now = device.status()
        if now != before:
            print(now, flush=True)
        before = now
        pause.wait(LOOK)
