"""Bring: this machine starts agents of a run elsewhere, if its user agrees.

Their classes are parts that are installed here, or are in files below this machine's
own folder with the same digests as on the run's machine: code never travels
(`sources.py`). Files that the agents read come into a temporary folder, in which they
run; no other file is opened for them (`offered.py`, `models.py`).
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from rems_net.agents.experiment.folder import own_folder
from rems_net.agents.experiment.hosting.hosts import Hosts
from rems_net.agents.experiment.lineup import Lineup
from rems_net.agents.experiment.placement.models import check_models
from rems_net.agents.experiment.placement.offered import Use, uses
from rems_net.agents.experiment.placement.receiving import (
    ask_offer,
    receive,
    say_trouble,
)
from rems_net.agents.experiment.placement.sources import (
    check_code,
    check_parts,
    find_class,
)
from rems_net.agents.experiment.show import Show
from rems_net.agents.protocol.alike import check_version
from rems_net.agents.protocol.placement import Offer
from rems_net.agents.protocol.plan import (
    Plan,
    class_names,
    class_words,
    each,
    grouped,
)
from rems_net.errors import RemsError
from rems_net.router.session import Session

#: Number of lines of agents, of files and of addresses that are shown.
MOST = 20
#: The failure that a run learns of a machine that refuses an offer.
REFUSED = "does not bring what it was asked for; its own screen shows why"


class Brought(Hosts):
    """The processes of an offer; their plans came over the fabric and were checked.

    data: the folder of the files they read.  out: the folder of their outputs.
    """

    def __init__(self, offer: Offer, here: Path, data: Path, out: Path, show: Show):
        # The hosts get the plans as they came; these only name host and agents.
        self._tables = offer.hosts()
        plans = {
            host: [
                Plan(kind, one["name"], [], restart=one.get("restart", 0))
                for kind, one in some
            ]
            for host, some in self._tables.items()
        }
        super().__init__(plans, {}, show, offer.dt, native=offer.native)
        self._offer, self._here, self._data, self._out = offer, here, data, out

    def words(self, name: str) -> dict[str, Any]:
        """Return a host's plans, with the folders and classes of this machine."""
        offer = self._offer
        found = [
            (kind, {**one, **{w: find_class(self._here, one[w]) for w in words}})
            for kind, one in self._tables[name]
            for words in (class_words(kind),)
        ]
        argv = [sys.argv[0], *offer.words]
        return {
            "argv": [word.encode(errors="replace") for word in argv],
            "agents": grouped(found),
            "taken": offer.taken,
            "values": [],
            "dt": offer.dt,
            "seed": offer.seed,
            "folder": str(self._data),
            "out": str(self._out),
            "brought": True,
        }


class Asked(NamedTuple):
    """Request of a run to this machine, for its user to accept.

    sentences: lines that describe all of it.  uses: ports and addresses it would use.
    """

    sentences: list[str]
    uses: list[Use]


def serve_run(
    session: Session,
    machine: str,
    here: Path,
    show: Show,
    agree: Callable[[Asked], None],
) -> None:
    """Start the agents that the run on this fabric wants of `machine`, until its end.

    here: the folder of this machine's own code.  agree: called before anything is
    fetched, imported or started; it raises ExperimentError if the user refuses. Raises
    RemsError. The run learns that there is a reason, but not which.
    """
    check_version(session)
    offer = ask_offer(session, machine)
    with telling(session, machine):
        check_parts(offer)
        used = uses(offer)
        check_code(offer, here)
        agree(Asked(list(describe(offer, session, machine, here, used)), used))
        with TemporaryDirectory(prefix="rems-", ignore_cleanup_errors=True) as folder:
            data = Path(folder)
            receive(session, machine, offer, data)
            check_models({name: (data / name).read_bytes() for name in offer.files})
            with out_folder(offer, machine, show, data) as out:
                hosts = Brought(offer, here, data, out, show)
                try:
                    hosts.start(session.link)
                    hosts.wait()
                finally:
                    hosts.leave()


def describe(
    offer: Offer, session: Session, machine: str, here: Path, used: list[Use]
) -> Iterator[str]:
    """Yield lines: whose run it is, and all that would be started, read and used."""
    link = session.link
    yield (
        f"{offer.name}, a run of {offer.user:.40} on {offer.laptop:.40} (fabric "
        f"{link.fabric!r} at {link.endpoint}), asks machine {machine} to start:"
    )
    agents = [
        f"{kind}/{one['name']}  "
        + " done by ".join(c.rpartition(":")[2] for c in class_names(kind, one))
        for kind, one in each(offer.agents)
    ]
    yield from _some(agents)
    if offer.files:
        yield "with these files, which it sends, and which are deleted at the end:"
        sizes = [
            f"{name:.100}, {file.size} bytes" for name, file in offer.files.items()
        ]
        yield from _some(sizes)
    if offer.code:
        yield f"with these files of yours, in {here}, which are the same there:"
        yield from _some(sorted(offer.code))
    if used:
        yield "and would use from this laptop:"
        yield from _some([f"{one.text}  for {one.agent}" for one in used])


def _some(lines: list[str]) -> Iterator[str]:
    yield from (f"  {line}" for line in lines[:MOST])
    if len(lines) > MOST:
        yield f"  and {len(lines) - MOST} more"


@contextmanager
def telling(session: Session, machine: str) -> Iterator[None]:
    """Notify the run if this machine does not bring the agents it wants.

    Without the reason: that may quote a file of this machine, or reveal that it exists.
    """
    try:
        yield
    except RemsError:
        with suppress(RemsError):
            say_trouble(session, machine, REFUSED)
        raise


def out_folder(
    offer: Offer, machine: str, show: Show, data: Path
) -> AbstractContextManager[Path]:
    """Return the folder for outputs and the user's code: `runs/lab-b`.

    Their files stay on this machine. Other parts write nothing.
    """
    if offer.code or offer.agents.get("output"):
        lab = Lineup(native=offer.native)
        lab.name = f"{offer.name}-{machine}"
        return own_folder(lab, None, {}, show)
    return nullcontext(data)
