"""Giving: a run tells the machines that it waits for what to bring, and sends files."""

from __future__ import annotations

from functools import partial

from rems_net.agents.experiment.placement.offers import Offers
from rems_net.agents.protocol.limits import PIECE
from rems_net.agents.protocol.placement import read_caller
from rems_net.errors import WireError
from rems_net.events import info
from rems_net.router.mail import Question
from rems_net.router.session import Session

#: sentences about machines that are told
MOST = 30


class Giving:
    """Answers for a run, in Zenoh's own thread, until it has begun."""

    def __init__(self, session: Session, offers: Offers):
        self._files = offers.files
        self._told: set[str] = set()
        self._watches = []
        for machine, offer in offers.by_machine.items():
            key = session.key("machine", machine, "@start")
            start = partial(self._start, key, machine, offer.to_wire())
            self._watches.append(session.answer_at_once(key, start))
            where = session.key("machine", machine, "@file")
            mine = {file.digest for file in offer.files.values()}
            piece = partial(self._piece, where, mine)
            self._watches.append(session.answer_at_once(f"{where}/*", piece))
            # By this it is found; what is asked is there before it.
            self._watches.append(session.present(key))

    def close(self) -> None:
        """Nobody is waited for any more."""
        for watch in self._watches:
            watch.close()

    def _start(self, key: str, machine: str, offer: bytes, question: Question) -> None:
        try:
            caller = read_caller(question.payload)
        except WireError as error:
            question.refuse(str(error))
            return
        self._say(f"machine {machine} is {caller.laptop}")
        if caller.trouble:
            self._say(f"machine {machine} ({caller.laptop}): {caller.trouble}")
        question.answer(key, b"" if caller.trouble else offer)

    def _piece(self, where: str, mine: set[str], question: Question) -> None:
        """Send the piece of a file that `?part=3` names."""
        digest = question.key.rpartition("/")[2]
        part = question.parameters.get("part", "0")
        if digest in mine and part.isdecimal() and len(part) < 5:
            begin = int(part) * PIECE
            data = self._files[digest][begin : begin + PIECE]
            question.answer(f"{where}/{digest}", data)

    def _say(self, sentence: str) -> None:
        if sentence not in self._told and len(self._told) < MOST:
            self._told.add(sentence)
            info("machine", sentence)
