"""Lines typed where `rems router serve` runs: STOP for all robots, without a network.

Every system can read a line, and Ctrl+C still ends the router. A script or another
program can write the same line to its standard input.
"""

import signal
import sys
from collections.abc import Callable, Iterator
from threading import Thread

from rems_net.cli.stop import say
from rems_net.errors import FabricError
from rems_net.router.session import Session
from rems_net.system.standard_input import lines

STOPS, RELEASES = ("s", "stop"), ("r", "release")


def obey(session: Session, log: Callable[[str], None]) -> None:
    """Stop and release all robots at this router, by typed lines, until end of input.

    log: prints a line. The thread never keeps the process alive.
    """
    if sys.stdin is None:
        return
    # without this, reading would suspend `rems router serve &`
    if hasattr(signal, "SIGTTIN"):
        signal.signal(signal.SIGTTIN, signal.SIG_IGN)
    if sys.stdin.isatty():
        log("To stop all robots, type here: s (and Enter). To let them go on: r")
    Thread(target=_obey, args=(session, log), name="typed", daemon=True).start()


def _obey(session: Session, log: Callable[[str], None]) -> None:
    for line in lines():
        if line in STOPS + RELEASES:
            log("\n".join(done(session, release=line in RELEASES)))
        elif line:
            log(f"rems: {line[:40]!r} is unknown; expected s or r")


def done(session: Session, *, release: bool) -> Iterator[str]:
    """Stop or release on every fabric at the router; yield a report line by line.

    STOP is put before the first robot is asked.
    """
    try:
        told = say(session, everywhere_there=True, release=release)
    except FabricError as error:
        told = {session.fabric: error}
    if not told:
        yield "there is no robot, and no run"
    for fabric, said in sorted(told.items()):
        yield f"On {fabric}:"
        lines = [str(said)] if isinstance(said, FabricError) else said.lines
        yield from (f"  {line}" for line in lines)
    if not release:
        yield "Let them go on with: r (and Enter), or rems stop --release --all"
