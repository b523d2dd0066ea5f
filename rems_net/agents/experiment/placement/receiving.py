"""Receiving: a machine asks a run for its offer, and for the files, piece by piece."""

import hashlib
from pathlib import Path

from rems_net.agents.protocol.alike import laptop
from rems_net.agents.protocol.limits import CAUSE, PIECE
from rems_net.agents.protocol.placement import Caller, File, Offer, read_offer
from rems_net.errors import ExperimentError, FabricError, WireError
from rems_net.events import info
from rems_net.router.keys import is_name
from rems_net.router.mail import Mailbox, Presence
from rems_net.router.session import Session

#: s, and a number. Time for an answer on a busy network, and number of attempts.
ANSWER_TIMEOUT, TRIES = 10.0, 3
#: s. Without a waiting run, report it after LOOK; all waiting runs appear within QUIET.
LOOK, QUIET = 1.0, 0.2
SILENT = "the run does not send its files. It is over, or cut off: type rems why"


class Wanted:
    """The runs that wait for a machine, as they come and go.

    fabric: its name; "" for any fabric, if only one run waits.
    """

    def __init__(self, session: Session, machine: str, fabric: str):
        self._session, self._machine = session, machine
        self._box = Mailbox()
        self._fabrics: set[str] = set()
        where = f"{fabric or '*'}/machine/{machine}/@start"
        session.watch_presence(where, self._box)

    def next(self) -> Session:
        """Wait for a run; return the session on its fabric.

        Raises ExperimentError if several wait.
        """
        told = False
        while self._look(QUIET if self._fabrics else LOOK) or not self._fabrics:
            if not (told or self._fabrics):
                told = True
                info(
                    "waiting",
                    f"no run at {self._session.link.endpoint} waits for machine "
                    f"{self._machine} yet; waiting, until one does (Ctrl+C ends it)",
                )
        if len(self._fabrics) > 1:
            raise ExperimentError(
                f"{len(self._fabrics)} runs wait for a machine {self._machine}, on the "
                f"fabrics {', '.join(sorted(self._fabrics))};"
                " choose one: --fabric NAME (R0443)"
            )
        return self._session.on(min(self._fabrics))

    def wait_for_end(self, fabric: str) -> None:
        """Return when the run on this fabric does not wait any more."""
        while fabric in self._fabrics:
            self._look(LOOK)

    def _look(self, seconds: float) -> bool:
        """Take a token that came or went; return False if none did."""
        letter = self._box.get(seconds)
        if isinstance(letter, Presence):
            name = letter.key.partition("/")[0]
            if not letter.alive:
                self._fabrics.discard(name)
            elif is_name(name):
                self._fabrics.add(name)
        return letter is not None


def ask_offer(session: Session, machine: str) -> Offer:
    """Return the run's offer to `machine`. Raises FabricError, or WireError."""
    key = session.key("machine", machine, "@start")
    silent = (
        f"the run on {session.fabric!r} does not send what to bring. Type: rems why"
    )
    return read_offer(_ask(session, key, silent, Caller(laptop(), "").to_wire()))


def say_trouble(session: Session, machine: str, sentence: str) -> None:
    """Send the run the reason why `machine` can't bring its agents."""
    payload = Caller(laptop(), sentence[:CAUSE]).to_wire()
    session.ask(session.key("machine", machine, "@start"), payload, first=True)


def receive(session: Session, machine: str, offer: Offer, folder: Path) -> None:
    """Put all files of an offer below `folder`. Raises FabricError, or WireError."""
    for name, file in offer.files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(_bytes_of(session, machine, name, file))


def _bytes_of(session: Session, machine: str, name: str, file: File) -> bytes:
    data = b""
    while len(data) < file.size:
        key = session.key("machine", machine, "@file", file.digest)
        piece = _ask(session, f"{key}?part={len(data) // PIECE}", SILENT)
        if len(piece) != min(PIECE, file.size - len(data)):
            raise WireError(f"{name} came in a piece of {len(piece)} bytes. (R0621)")
        data += piece
    if hashlib.sha256(data).hexdigest() != file.digest:
        raise WireError(
            f"{name} is not what the run has: another SHA-256 came. (R0621)"
        )
    return data


def _ask(
    session: Session, key: str, silent: str, payload: bytes | None = None
) -> bytes:
    """Return the answer of a run. Raises FabricError with `silent` if none comes."""
    for _ in range(TRIES):
        for mail in session.ask(key, payload, ANSWER_TIMEOUT, first=True):
            return mail.payload
    raise FabricError(f"{silent} (R0443)")
