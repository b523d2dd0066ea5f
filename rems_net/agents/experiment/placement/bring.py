"""Bring: this machine starts what a run elsewhere wants of it, and nothing else.

Of classes, only parts that are installed here, and files below its own folder whose
digests are those of the run's machine: code never travels. What the agents read comes
into a folder of its own, which is gone afterwards.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rems_net.agents import parts
from rems_net.agents.experiment.folder import own_folder
from rems_net.agents.experiment.hosts import Hosts
from rems_net.agents.experiment.placement.needs import source_digest
from rems_net.agents.experiment.placement.receiving import (
    ask_offer,
    receive,
    say_trouble,
)
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.alike import check_version
from rems_net.agents.protocol.placement import Offer, reference
from rems_net.agents.protocol.plan import ROBOT, Plan
from rems_net.errors import AgentError, ExperimentError, RemsError
from rems_net.router.session import Session

#: agents of a host that are named
MOST = 20


class Brought(Hosts):
    """The processes of an offer: what they run came over the fabric, and was checked.

    data: the folder of what they read.  out: that of what outputs among them make.
    """

    def __init__(self, offer: Offer, here: Path, data: Path, out: Path, show: Show):
        # What is told of them is as it came; these say who lives where.
        plans = {
            host: [Plan(plan["kind"], plan["name"], []) for plan in some]
            for host, some in offer.hosts.items()
        }
        super().__init__(plans, {}, show, native=offer.native)
        self._offer, self._here, self._data, self._out = offer, here, data, out
        #: the last line of each
        self._last: dict[str, str] = {}

    def say(self, source: str, line: str) -> None:
        """Pass on what a process printed, and keep it: it may be why it ended."""
        self._last[source] = line
        super().say(source, line)

    def wait(self) -> None:
        """Wait until every process has ended. Raises AgentError with its last words."""
        try:
            super().wait()
        except AgentError as error:
            # What it said may still be on its way.
            self.processes[error.agent].end()
            said = self._last.get(error.agent, "").removeprefix("warning: ")
            said = said.removeprefix(f"{error.agent}: ")
            raise AgentError(error.agent, said or error.cause) from None

    def words(self, name: str) -> dict[str, Any]:
        """What a host is told: as it came, with folders and classes of this machine."""
        folders = {"folder": str(self._data), "out": str(self._out)}
        plans = [
            {
                **plan,
                **folders,
                "classes": [find_class(self._here, c) for c in plan["classes"]],
            }
            for plan in self._offer.hosts[name]
        ]
        words = [sys.argv[0], *self._offer.words]
        argv = [word.encode(errors="replace") for word in words]
        return {"argv": argv, "agents": plans, "values": []}


def serve_run(
    session: Session,
    machine: str,
    here: Path,
    show: Show,
    tell: Callable[[str], None],
) -> None:
    """Bring what the run on this session's fabric wants of `machine`; till its end.

    here: where this machine's own code is.  tell: called with what will be started.
    Raises RemsError, and says so to the run, if it waits.
    """
    check_version(session)
    offer = ask_offer(session, machine)
    with telling(session, machine):
        check_code(offer, here)
        check_parts(offer)
        for sentence in describe(offer, session, machine):
            tell(sentence)
        with (
            TemporaryDirectory(prefix="rems-", ignore_cleanup_errors=True) as data,
            out_folder(offer, machine, show) as out,
        ):
            receive(session, machine, offer, Path(data))
            hosts = Brought(offer, here, Path(data), out, show)
            try:
                hosts.start(session.link, own=False)
                hosts.wait()
            finally:
                hosts.leave()


def describe(offer: Offer, session: Session, machine: str) -> Iterator[str]:
    """Whose run it is, and what will be started and read."""
    yield (
        f"{offer.name}, which {offer.laptop} runs on the fabric {session.fabric!r} at "
        f"{session.link.endpoint}, wants of machine {machine}:"
    )
    for plans in offer.hosts.values():
        for plan in plans[:MOST]:
            made = " done by ".join(c.rpartition(":")[2] for c in plan["classes"])
            yield f"  {plan['kind']}/{plan['name']}  {made}"
        if len(plans) > MOST:
            yield f"  and {len(plans) - MOST} more"
    for name, file in offer.files.items():
        yield f"  {name}, {file.size} bytes, comes from there"
    for name in offer.code:
        yield f"  {name} is the same here"


@contextmanager
def telling(session: Session, machine: str) -> Iterator[None]:
    """Say to the run, too, why this machine can't bring what it wants."""
    try:
        yield
    except RemsError as error:
        with suppress(RemsError):
            say_trouble(session, machine, str(error))
        raise


def out_folder(offer: Offer, machine: str, show: Show) -> AbstractContextManager[Path]:
    """Where outputs and the user's code write, beside what is run here: `runs/lab-b`.

    What they write stays on this machine. Other parts write nothing.
    """
    plans = [plan for plans in offer.hosts.values() for plan in plans]
    if offer.code or any(plan["kind"] == "output" for plan in plans):
        name = f"{offer.name}-{machine}"
        return own_folder(name, None, {}, {}, 1.0, show, native=offer.native)
    return nullcontext(Path())


# -- code ----------------------------------------------------------------------------


def check_code(offer: Offer, here: Path) -> None:
    """Raise ExperimentError naming each source that is missing here, or differs."""
    wrong = []
    for name, digest in sorted(offer.code.items()):
        path = own_file(here, name)
        if path is None:
            wrong.append(f"{name} is not here")
        elif source_digest(path.read_bytes()) != digest:
            wrong.append(f"{name} differs here and on {offer.laptop}")
    if wrong:
        raise ExperimentError(
            f"{', '.join(wrong)} (here is {here}). Code never travels: copy it from "
            f"{offer.laptop}, which runs {offer.name}."
        )


def own_file(here: Path, name: str) -> Path | None:
    """A file below `here`, if it is there, and no link leads out."""
    path = (here / name).resolve()
    return path if path.is_relative_to(here.resolve()) and path.is_file() else None


def check_parts(offer: Offer) -> None:
    """Raise ExperimentError for a class that is no part which is installed here."""
    wanted = {}
    for plan in (plan for plans in offer.hosts.values() for plan in plans):
        kinds = ROBOT if plan["kind"] == "robot" else (plan["kind"],)
        for pair in zip(kinds, plan["classes"], strict=True):
            wanted[pair] = f"{plan['kind']}/{plan['name']}"
    for (kind, one), agent in wanted.items():
        known = {p.reference for found in parts.by_name(kind).values() for p in found}
        if one not in known and not reference(one)[0].endswith(".py"):
            raise ExperimentError(
                f"{agent} is made of {one!r}, which is no {kind} of rems_net, nor of a "
                "package that is installed here (`rems parts`)."
            )


def find_class(here: Path, one: str) -> str:
    """A class for a process of this machine: a file's full path, in place of a name."""
    where, name = reference(one)
    if where.endswith(".py"):
        return f"{own_file(here, where)}:{name}"
    return one
