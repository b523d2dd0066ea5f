"""Progress: the roster of each tick, the tick all have done, and the late hosts."""

import sys
from collections import deque
from collections.abc import Set

from rems_net.agents.clock.members import Member, Members
from rems_net.agents.protocol.limits import AHEAD
from rems_net.agents.protocol.roster import Roster

#: Number of hosts that are named if more of them hold a tick.
SHOWN = 3


class Progress:
    """Counts up the ticks that every member of the roster has done."""

    def __init__(self, members: Members):
        self._members = members
        #: the newest tick that all members have done
        self.done = 0
        #: the hosts that have not done the next
        self.pending: set[str] = set()
        self.roster = Roster(0, 1, {}, {}, members.run)
        #: the rosters that an unfinished tick may name
        self._rosters = deque([self.roster])
        #: the next tick at which an agent that is here already begins
        self._next = 1
        self._waited_for: set[str] = set()

    def update(self, n: int) -> bool:
        """Bring the roster up to tick n; return True if it is a new one."""
        members = self._members
        if not members.changed and n < self._next:
            return False
        members.changed = False
        every = [e for m in members.present() for e in m.entries]
        self._next = min((e.since for e in every if e.since > n), default=sys.maxsize)
        agents = {e.key: e for e in sorted(every, key=lambda e: e.key) if e.since <= n}
        used = {d for e in agents.values() for d in e.outs.values()}
        schemas = {d: s for d, s in sorted(members.schemas.items()) if d in used}
        epoch = self.roster.epoch + 1
        self.roster = Roster(epoch, n, agents, schemas, members.run, members.gone())
        self._rosters.append(self.roster)
        while len(self._rosters) > 1 and self._rosters[1].first < n - AHEAD:
            self._rosters.popleft()
        self._waited_for = {e.host for e in agents.values() if e.lockstep}
        return True

    def roster_of(self, epoch: str) -> Roster:
        """Return the roster of this epoch (a text); the newest if there is none."""
        found = [r for r in self._rosters if str(r.epoch) == epoch]
        return found[0] if found else self.roster

    def hear(self, member: Member, n: int) -> None:
        """Note that a host has done tick `n`, and so all before."""
        if n > member.n:
            member.hear(n)
            if n > self.done:
                self.pending.discard(member.name)

    def look(self) -> None:
        """Find the hosts that have not done the next tick: the roster has changed."""
        self.pending = self.late(self.done + 1)

    def advance(self, n: int) -> int:
        """Return the newest tick that all members have done, up to `n`."""
        while not self.pending and self.done < n:
            self.done += 1
            self.look()
        return self.done

    def late(self, n: int) -> set[str]:
        """Return the hosts that are waited for and have not done tick n."""
        return {h for h in self._waited_for if self._members.all[h].owes(n)}

    def holders(self, pending: Set[str]) -> list[Member]:
        """Return those late members that do not wait for another late one."""
        hosts = self._members.all
        late = {e.key: h for h in pending for e in hosts[h].entries}
        holding = {
            h
            for h in pending
            if not any(
                late.get(key, h) != h
                for e in hosts[h].entries
                for key in self.roster.writers(e)
            )
        }
        return [hosts[h] for h in sorted(holding or pending)]

    def describe(self, pending: Set[str]) -> str:
        """Return the hosts that hold a tick, their machines and their lines of code."""
        who = []
        holders = self.holders(pending & self._members.all.keys())
        for member in holders[:SHOWN]:
            stands = f" ({member.stands})" if member.stands else ""
            who.append(f"{member.describe()}{stands}")
        if (more := len(holders) - SHOWN) > 0:
            who.append(f"{more} more host{'s' * (more > 1)}")
        return " and ".join(who)
