"""A host process, once it has a lifeline: what it is told to run, and its session."""

from __future__ import annotations

import os
import sys

from rems_net.agents.host.host import Host
from rems_net.agents.host.lifeline import FAILED, Lifeline
from rems_net.agents.host.seat import Orphaned
from rems_net.errors import RemsError
from rems_net.router.message import read
from rems_net.router.session import Session
from rems_net.router.settings import Link

#: seconds to wait for the router, which is there, but may be busy
PATIENCE = 10.0
#: seconds an orphan has to close its agents: with what it takes to notice, two
GRACE = 1.5


def main(lifeline: Lifeline) -> int:
    """Run what the parent says; the exit status."""
    spec = read(lifeline.words())
    sys.path[:] = [os.fsdecode(entry) for entry in spec["path"]]
    try:
        link = Link(
            spec["endpoint"],
            fabric=spec["fabric"],
            timeout=PATIENCE,
            user=spec["user"],
            password=spec["password"],
        )
        with Session(link) as session:
            host = Host(session, spec["host"], spec["ticket"], free=spec["free"])
            lifeline.on_end(lambda: host.inbox.box.put(Orphaned()), GRACE)
            failed = host.run(spec["agents"])
    except RemsError as error:
        print(error, file=sys.stderr, flush=True)
        return FAILED
    return FAILED if failed else 0
