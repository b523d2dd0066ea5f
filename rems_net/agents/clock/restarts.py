"""Restarts: members that crashed and are started again, if the experiment says so."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from rems_net.agents.protocol.limits import backoff
from rems_net.events import info


@dataclass
class Away:
    """A member that crashed, and shall come back.

    due: when its process is to be started; None once it is.  until: when it is given up
    """

    agent: str
    awaited: bool
    since: float
    until: float
    due: float | None


class Restarts:
    """Counts crashes, and keeps who is away because of one.

    allowed: how often each host may be started again; nobody else is.
    start: starts the process of a host; one of another machine is started there.
    patience: seconds a member has to come back.
    """

    def __init__(
        self,
        allowed: Mapping[str, int],
        start: Callable[[str], None],
        patience: float,
    ):
        self._allowed, self._start = allowed, start
        self._patience = patience
        self._used: dict[str, int] = {}
        self.away: dict[str, Away] = {}

    def may(self, host: str) -> bool:
        """Whether this host would be started again."""
        return self._used.get(host, 0) < self._allowed.get(host, 0)

    def crashed(
        self, host: str, agent: str, when: str, cause: str, *, awaited: bool
    ) -> None:
        """Have it started again, and report it.

        when: "at tick 412".  awaited: whether the others wait for it
        """
        count = self._used[host] = self._used.get(host, 0) + 1
        now, pause = time.monotonic(), backoff(count)
        until = now + pause + self._patience
        self.away[host] = Away(agent, awaited, now, until, now + pause)
        info(
            "crashed",
            f"{agent} crashed {when} ({cause.removeprefix('was ')}); "
            f"started again, {count} of {self._allowed[host]}",
            agent,
        )

    def dies(self, host: str) -> bool:
        """Whether a death of its process is that of the crash, which is known."""
        away = self.away.get(host)
        return away is not None and away.due is not None

    def back(self, host: str, n: int) -> None:
        """It has joined again, from tick `n` on."""
        away = self.away.pop(host, None)
        if away is not None:
            spent = time.monotonic() - away.since
            text = f"{away.agent} is back from tick {n} on, after {spent:.1f} s"
            info("back", text, away.agent)

    def awaited(self) -> bool:
        """Whether somebody is away for whom the others wait."""
        return any(away.awaited for away in self.away.values())

    def look(self) -> list[tuple[str, str, str]]:
        """Start whose time has come. Returns who did not come back: host, agent, cause.

        Each is told of once, and waited for no more.
        """
        lost = []
        now = time.monotonic()
        for host, away in list(self.away.items()):
            if away.due is not None and now >= away.due:
                away.due = None
                self._start(host)
            elif now > away.until:
                del self.away[host]
                cause = f"did not come back within {self._patience:g} s of its crash"
                lost.append((host, away.agent, cause))
        return lost
