"""Failure detector: which hosts are out of sight, and when that means they are gone."""

from __future__ import annotations

import time
from collections.abc import Callable

from rems_net.agents.clock.membership import Member, Membership
from rems_net.errors import AgentError


class Detector:
    """Keeps who is out of sight without a word; after `patience` s, they are gone.

    With the router gone everybody is out of sight, and a process of this machine is
    known to live: `excused` says so of a host, and gives it as long again.
    `look` raises AgentError for a process that has died.
    """

    def __init__(
        self,
        members: Membership,
        excused: Callable[[str], bool],
        look: Callable[[], None],
        patience: float,
    ):
        self._members, self._excused, self._look = members, excused, look
        self._patience = patience
        #: host -> when to give it up
        self._lost: dict[str, float] = {}

    def expect(self, member: Member) -> None:
        """It has joined, and shall come into sight."""
        self._lost.setdefault(member.name, time.monotonic() + self._patience)

    def notice(self, badge: int, alive: bool) -> None:
        """A member came into sight, or went out of it."""
        member = self._members.by_badge.get(badge)
        if member is None:
            return
        if alive:
            self.forget(member.name)
        else:
            self.expect(member)

    def forget(self, host: str) -> None:
        """It is here, or has said its last words."""
        self._lost.pop(host, None)

    def misses(self, host: str) -> bool:
        """Whether this host is out of sight."""
        return host in self._lost

    def given_up(self) -> list[tuple[Member, AgentError]]:
        """Those that have been out of sight for too long, each once."""
        if not self._lost:
            return []
        gone = []
        for host, until in list(self._lost.items()):
            if time.monotonic() <= until:
                continue
            if self._excused(host):
                self._lost[host] = time.monotonic() + self._patience
                continue
            self.forget(host)
            member = self._members.all[host]
            cause = f"is out of sight on {member.machine} for {self._patience:g} s"
            gone.append((member, AgentError(member.agent, cause)))
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
            # Of one that has left its last words have said it already.
            if not member.left or member.name in self._members.returning:
                return member, error
        return None
