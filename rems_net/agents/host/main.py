"""A host process, once it has a lifeline: its plans, and its session."""

import builtins
import io
import os
import sys
from dataclasses import replace
from functools import partial
from typing import NoReturn

from rems_net.agents import registry
from rems_net.agents.diagnosis import no_keyboard
from rems_net.agents.host.host import Host
from rems_net.agents.host.lifeline import FAILED, Lifeline
from rems_net.agents.host.membership import Orphaned
from rems_net.agents.protocol.limits import OVER
from rems_net.errors import RemsError
from rems_net.events import LOGGER, Event, listening
from rems_net.router.message import read
from rems_net.router.session import Session
from rems_net.router.settings import Link

#: s. The router is there, but it may be busy for this long.
CONNECT_TIMEOUT = 10.0
#: s. An orphan may close its agents for this long; with the time to notice it, 2 s.
GRACE = 1.5


def main(lifeline: Lifeline) -> int:
    """Run the parent's plans; return the exit status."""
    spec = read(lifeline.words())
    sys.path[:] = [os.fsdecode(entry) for entry in spec["path"]]
    sys.argv[:] = [os.fsdecode(word) for word in spec["argv"]]
    if spec["brought"]:  # a relative name must find only files that came with the run
        os.chdir(spec["folder"])
    LOGGER.propagate = False  # the process that started this one logs its events
    registry.enter_run()
    builtins.input = no_keyboard
    sys.stdin = NoKeyboard()
    try:
        link = Link(
            spec["endpoint"],
            fabric=spec["fabric"],
            timeout=CONNECT_TIMEOUT,
            user=spec["user"],
            password=spec["password"],
        )
        with Session(link) as session:
            host = Host(
                session,
                spec["host"],
                spec["ticket"],
                free=spec["free"],
                brought=spec["brought"],
                restarts=spec["restarts"],
            )
            lifeline.on_end(lambda: host.inbox.box.put(Orphaned()), GRACE)
            with listening(partial(report, host)):
                failed = host.run(spec)
            over = host.over
    except RemsError as error:
        print(error, file=sys.stderr, flush=True)
        return FAILED
    return (OVER if over else FAILED) if failed else 0


def report(host: Host, event: Event) -> None:
    """Pass an event to the process that started this one."""
    agent, tick = event.agent or host.acting, event.tick or host.n
    event = replace(event, agent=agent, tick=tick)
    sys.stderr.write(event.to_line())
    sys.stderr.flush()


class NoKeyboard(io.TextIOBase):
    """A host's standard input: it is the lifeline, so agents cannot read it."""

    def readable(self) -> bool:
        """Return True: a reader then gets the reason why it cannot read."""
        return True

    def read(self, size: int | None = -1, /) -> NoReturn:
        """Raise ExperimentError."""
        no_keyboard()

    def readline(self, size: int = -1, /) -> NoReturn:  # type: ignore[override]
        """Raise ExperimentError."""
        no_keyboard()
