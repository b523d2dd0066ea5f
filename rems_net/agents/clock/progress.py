"""Progress: which tick everybody has done, and who has not done the next."""

from __future__ import annotations

import time

from rems_net.agents.clock.membership import Member, Membership


class Progress:
    """Counts up the ticks that every member has done."""

    def __init__(self, members: Membership):
        self._members = members
        #: the newest tick that everybody has done
        self.done = 0
        #: the hosts that have not done the next
        self.pending: set[str] = set()

    def hear(self, member: Member, n: int) -> None:
        """Take in that a host has done tick `n`, and so all before."""
        if n > member.n:
            member.n, member.seen = n, time.monotonic()
            if n > self.done:
                self.pending.discard(member.name)

    def forget(self, host: str) -> None:
        """Nobody waits for this host any more."""
        self.pending.discard(host)

    def look(self) -> None:
        """Find anew who has not done the next tick: the roster has changed."""
        self.pending = self._members.late(self.done + 1)

    def advance(self, n: int) -> int:
        """The newest tick that everybody has done, up to `n`."""
        while not self.pending and self.done < n:
            self.done += 1
            self.look()
        return self.done
