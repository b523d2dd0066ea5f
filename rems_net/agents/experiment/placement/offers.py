"""Offers: the agents that each machine is to bring, their files, and the sending."""

import hashlib
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from rems_net.agents.agent import Agent
from rems_net.agents.experiment.checking.settings import origin
from rems_net.agents.experiment.lineup import Lineup
from rems_net.agents.experiment.placement.models import check_models
from rems_net.agents.experiment.placement.needs import carried, code_of, data_of
from rems_net.agents.protocol.alike import laptop, user
from rems_net.agents.protocol.limits import FILE_BYTES, PIECE, SENT
from rems_net.agents.protocol.placement import File, Offer, read_caller
from rems_net.agents.protocol.plan import Plan, written
from rems_net.errors import ExperimentError, WireError
from rems_net.events import info
from rems_net.router.mail import Question
from rems_net.router.session import Session
from rems_net.uncaught import is_users

#: Number of sentences about machines that are reported.
MOST = 30


class Offers(NamedTuple):
    """By machine, the agents that it is to bring; by digest, the files that travel."""

    by_machine: Mapping[str, Offer]
    files: Mapping[str, bytes]


def make_offers(
    lab: Lineup, agents: Mapping[str, Agent], machines: Mapping[str, str]
) -> Offers:
    """Return the offers to the machines of an experiment.

    machines: by host, the machine that is to bring it. Raises ExperimentError for files
    and classes that another machine can't have.
    """
    plans, folder = lab.by_host(), lab.folder
    offers: dict[str, Offer] = {}
    files: dict[str, bytes] = {}
    for machine in sorted(set(machines.values())):
        mine = [host for host, where in machines.items() if where == machine]
        code: dict[str, str] = {}
        paths: dict[str, Path] = {}
        brought = [plan for host in mine for plan in plans[host]]
        for plan in brought:
            with origin(f"{plan.kind} {plan.name!r}"):
                code |= _code(plan, folder)
                paths |= data_of(agents[plan.key], folder)
        data = _read(machine, paths)
        check_models(data)  # before the other machine refuses them
        digests = {file: hashlib.sha256(d).hexdigest() for file, d in data.items()}
        offers[machine] = Offer(
            name=lab.name,
            user=user(),
            laptop=laptop(),
            **written(brought, agents, lab.dt, lambda cls: carried(cls, folder)[0]),
            words=_words() if code else [],
            files={file: File(len(d), digests[file]) for file, d in data.items()},
            code=code,
            native=lab.native,
        )
        files |= {digests[file]: d for file, d in data.items()}
    return Offers(offers, files)


def _words() -> list[str]:
    """Return the arguments of the script that runs this; those of `rems` are none."""
    script = Path(sys.argv[0]).resolve()
    return sys.argv[1:] if script.suffix == ".py" and is_users(str(script)) else []


def _code(plan: Plan, folder: Path) -> dict[str, str]:
    """Return the digests of the sources that a plan needs, by name."""
    code: dict[str, str] = {}
    for cls in plan.classes:
        _, file = carried(cls, folder)
        if file is not None:
            code |= code_of(file, folder)
    return code


def _read(machine: str, paths: Mapping[str, Path]) -> dict[str, bytes]:
    size = sum(path.stat().st_size for path in paths.values())
    if len(paths) > SENT or size > FILE_BYTES:
        raise ExperimentError(
            f"machine {machine} would be sent {len(paths)} files of {size} bytes; "
            f"expected at most {SENT}, of {FILE_BYTES} bytes together. (R0440)"
        )
    return {name: path.read_bytes() for name, path in paths.items()}


def machines_of(by_host: Mapping[str, Sequence[Plan]]) -> dict[str, str]:
    """Return, by host, the machine that brings it, if that is not this one.

    Raises ExperimentError for agents of one host on two machines.
    """
    found = {}
    for host, plans in by_host.items():
        machine = plans[0].machine
        for plan in plans:
            if plan.machine != machine:
                raise ExperimentError(
                    f"{plans[0].key} and {plan.key} share the process {host!r}, and "
                    f"are on {_where(machine)} and {_where(plan.machine)}; give both "
                    "the same machine, or a host each. (R0433)"
                )
        if machine:
            found[host] = machine
    return found


def _where(machine: str) -> str:
    return f"machine {machine}" if machine else "this one"


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
            # Machines find the run by this token; the answers must be ready before it.
            self._watches.append(session.present(key))

    def close(self) -> None:
        """Stop answering."""
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
