"""`python -m rems_net.agents.host`: what a host process runs.

Its standard input says what to run; the input's end says that the parent is gone.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from rems_net.agents.host.host import Host
from rems_net.agents.host.seat import Orphaned
from rems_net.errors import RemsError
from rems_net.router.message import read
from rems_net.router.session import Session
from rems_net.router.settings import Link

#: seconds to wait for the router, which is there, but may be busy
PATIENCE = 10.0
#: seconds an orphan has to close its agents
GRACE = 2.0
#: the exit status of a host whose parent is gone or whose agent failed
FAILED = 1


def read_spec() -> dict[str, Any]:
    """The parent's words: four bytes of length, then msgpack."""
    length = int.from_bytes(_read_exactly(4), "little")
    spec: dict[str, Any] = read(_read_exactly(length))
    return spec


def _read_exactly(count: int) -> bytes:
    data = b""
    while len(data) < count:
        # Not sys.stdin: its buffer would swallow what the orphan watch waits for.
        more = os.read(sys.stdin.fileno(), count - len(data))
        if not more:
            sys.exit("A host is started by `rems run`, not by hand.")
        data += more
    return data


def orphan_watch(gone: Callable[[], None], seconds: float) -> None:
    """In a host: call `gone` when the parent dies, and exit `seconds` later anyway."""

    def wait() -> None:
        while os.read(sys.stdin.fileno(), 4096):
            pass
        gone()
        timer = threading.Timer(seconds, os._exit, args=(FAILED,))
        timer.daemon = True
        timer.start()

    threading.Thread(target=wait, daemon=True).start()


def main() -> int:
    # Ctrl+C reaches every process of a terminal; the parent ends the run, in order.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    spec = read_spec()
    sys.path[:] = spec["path"]
    try:
        link = Link(spec["endpoint"], fabric=spec["fabric"], timeout=PATIENCE)
        with Session(link) as session:
            host = Host(session, spec["host"], spec["ticket"])
            orphan_watch(lambda: host.inbox.box.put(Orphaned()), GRACE)
            failed = host.run(spec["agents"])
    except RemsError as error:
        print(error, file=sys.stderr, flush=True)
        return 1
    return 1 if failed else 0


def end(status: int) -> None:
    """Exit now: all agents are closed, and a job that still runs is not waited for."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):  # whoever read it may be gone
            stream.flush()
    os._exit(status)


if __name__ == "__main__":
    end(main())
