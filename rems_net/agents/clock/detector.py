"""Failure detector: which hosts are out of sight, and when that means they are gone."""

from __future__ import annotations

import time
from collections.abc import Callable

from rems_net.agents.clock.membership import Member, Membership
from rems_net.errors import AgentError
from rems_net.router.mail import Presence

#: seconds a host that is out of sight has to come back; a router may restart
RETURN = 5.0


class Detector:
    """Keeps who is out of sight without a word.

    With the router gone everybody is out of sight, and a process of this machine is
    known to live: `excused` says so of a host, and gives it another RETURN seconds.
    `look` raises AgentError for a process that has died.
    """

    def __init__(
        self,
        members: Membership,
        excused: Callable[[str], bool],
        look: Callable[[], None],
    ):
        self._members, self._excused, self._look = members, excused, look
        #: host -> (agent, when to give it up)
        self._lost: dict[str, tuple[str, float]] = {}

    def notice(self, presence: Presence) -> None:
        """An agent came into sight, or went out of it."""
        key = "/".join(presence.key.split("/")[1:3])
        member = self._members.owner(key)
        if member is None:
            return
        if presence.alive:
            self.forget(member.name)
        else:
            self._lost.setdefault(member.name, (key, time.monotonic() + RETURN))

    def forget(self, host: str) -> None:
        """It is here, or has said its last words."""
        self._lost.pop(host, None)

    def given_up(self) -> list[tuple[Member, AgentError]]:
        """Those that have been out of sight for too long, each once."""
        if not self._lost:
            return []
        gone = []
        for host, (key, until) in list(self._lost.items()):
            if time.monotonic() <= until:
                continue
            if self._excused(host):
                self._lost[host] = (key, time.monotonic() + RETURN)
                continue
            self.forget(host)
            member = self._members.all[host]
            gone.append((member, AgentError(key, f"is gone from {member.machine}")))
        return gone

    def died(self) -> tuple[Member, AgentError] | None:
        """The member whose process has died, and how; each once.

        Raises AgentError for one that never joined.
        """
        try:
            self._look()
        except AgentError as error:
            member = self._members.all.get(error.agent)
            if member is None:
                raise
            if not member.left:  # else its last words have said it already
                return member, error
        return None
