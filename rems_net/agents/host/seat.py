"""Seat: what a host remembers of its membership of one run, and of no other."""

from collections import deque
from collections.abc import Callable
from math import ceil
from typing import NamedTuple

from rems_net.agents.protocol.badge import run_of
from rems_net.agents.protocol.limits import AHEAD
from rems_net.agents.protocol.messages import Admission, Beat
from rems_net.agents.protocol.roster import Roster
from rems_net.agents.tick import time_of
from rems_net.engine.wiring import Entry
from rems_net.errors import WireError
from rems_net.router.keys import plain_key
from rems_net.router.mail import Mail
from rems_net.router.message import Stamp

#: values kept of each key: its writer may be this much further, and a tick is needed
#: twice, by who reads it now and by who reads what was
KEEP = AHEAD + 2
#: values whose writer is not on a roster yet; what does not fit is asked for again
STRANGERS = 256
#: bytes of a value that is kept for the next roster
SMALL = 4096
#: s. By so much another host can hear ticks earlier than this one; a robot that is
#: really driven obeys no command that is older than this.
SKEW = 0.5
#: seconds of ticks that go by without a host, of which it is told
LATE = 1.0


class Released(Exception):  # noqa: N818 - not an error: the clock let this host go
    """The roster no longer names this host."""


class Orphaned(Exception):  # noqa: N818 - not an error of this host
    """Whoever started this host is gone, or its clock is, or it was given up."""


class Value(NamedTuple):
    """What came at a key, and the tick at which its source said it."""

    payload: bytes
    said: int


class Seat:
    """One membership: thrown away when it ends, with all that came.

    rates: where all agents of the host are free-running, their every; else nothing.
    told: full keys at which programs from outside may tell this host something.
    latest: by full key, the newest value of an agent.  given: by key of the In, the
    newest of a program outside. Both begin empty.
    check: raises WireError for an agent's In that a badge may not write (`Leases`).
    """

    def __init__(
        self,
        fabric: str,
        host: str,
        admission: Admission,
        rates: list[int],
        told: set[str],
        latest: dict[str, tuple[Mail, Stamp]],
        given: dict[str, tuple[Mail, Stamp]],
        check: Callable[[str, int, int], None],
    ):
        self._fabric, self._host = fabric, host
        self.badge, self.dt = admission.badge, admission.dt
        self.run = run_of(admission.badge)
        self.rates, self._told, self._check = rates, told, check
        #: ticks that a stamp may be ahead of the newest tick that was heard here
        self._ahead = max(AHEAD + 1, ceil(SKEW / self.dt))
        #: ticks to be done, in order
        self.beats: deque[Beat] = deque()
        #: the newest tick that was heard with all before it, and the last begun
        self.newest = self.current = admission.first - 1
        self._first = admission.first
        #: heard, and one before it was not
        self._early: dict[int, Beat] = {}
        #: the clock says a tick again: something is late, or was lost
        self.repeated = False
        #: how late this host has just been, in words; nothing where it was in time
        self.lateness = ""
        self.rosters: dict[int, Roster] = {}
        self._admitted = False
        #: full key of a port -> badges of who may write it
        self._writers: dict[str, set[int]] = {}
        #: badge -> agent, of those in lock-step: they write one value a tick
        self._exact: dict[int, str] = {}
        self._latest, self._given = latest, given
        latest.clear()
        given.clear()
        self._kept: dict[str, dict[int, Value]] = {}
        self._strangers: deque[tuple[Mail, Stamp]] = deque(maxlen=STRANGERS)

    # -- ticks -------------------------------------------------------------------

    def hear_beat(self, beat: Beat) -> None:
        """Take in a tick; another run's is left alone. Raises WireError."""
        tick = beat.tick
        if beat.run != self.run:
            return
        n = tick.n
        if tick.dt != self.dt or tick.t != time_of(n, tick.dt):
            raise WireError(
                f"tick {tick.n} is at {tick.t:g} s, in steps of {tick.dt:g} s; "
                f"expected steps of {self.dt:g} s."
            )
        if n == self.newest + 1 and not self._early:  # as nearly always
            self.newest = n
            self.beats.append(beat)
            return
        if n <= self.newest or n in self._early:
            self.repeated = True
            return
        if self.rates:  # nobody waits for this host: what it did not hear is past
            self.newest = tick.n - 1
            self._early.clear()
        elif tick.n > self.newest + AHEAD + 1:
            raise WireError(
                f"tick {tick.n} is further ahead of {self.newest} than a clock can be."
            )
        self._early[tick.n] = beat
        while self.newest + 1 in self._early:
            self.newest += 1
            self.beats.append(self._early.pop(self.newest))

    def take(self) -> Beat:
        """The next tick to be done; one must be there."""
        if self.rates:
            self._skip()
        beat = self.beats.popleft()
        self.current = beat.tick.n
        return beat

    def _skip(self) -> None:
        """Free-running and too slow: pass over all but the newest tick to step at."""
        due = [b for b in self.beats if any(not b.tick.n % k for k in self.rates)]
        keep = due[-1] if due else self.beats[-1]
        while self.beats[0] is not keep:
            self.beats.popleft()
        tick, first = keep.tick, self.current + 1
        late = (tick.n - first) * tick.dt / tick.pace if tick.pace else 0.0
        self.lateness = ""
        if late >= LATE:
            gone = f"ticks {first} to {tick.n - 1} went by without it"
            self.lateness = f"was {late:.1f} s late: {gone}"

    # -- rosters -----------------------------------------------------------------

    def hear_roster(self, roster: Roster) -> None:
        """Take in a roster. Raises Released, or Orphaned where the clock gave us up."""
        if roster.run != self.run:
            return
        newest = roster.epoch > max(self.rosters, default=-1)
        self.rosters[roster.epoch] = roster
        self._learn_writers()
        # One that was lost, and asked for; or of before this membership.
        if not newest or roster.first < self._first:
            return
        here = self._host in roster.hosts()
        if not here and self._host in roster.gone:
            raise Orphaned(f"the clock gave this host up: {roster.gone[self._host]}")
        if not here and (self._admitted or not roster.agents):
            raise Released
        self._admitted = self._admitted or here

    def has_roster(self, epoch: int) -> bool:
        """Whether the roster is there which a tick names, or one that will do.

        The clock keeps what those need that it waits for. Who is free-running may come
        too late for one, and takes the next.
        """
        late = self.rates and max(self.rosters, default=-1) > epoch
        return bool(late) or epoch in self.rosters

    def take_roster(self, epoch: int) -> Roster:
        """The roster of this epoch; those before are forgotten."""
        for old in [e for e in self.rosters if e < epoch]:
            del self.rosters[old]
        return self.rosters[min(self.rosters)]

    def writes_on(self, writer: Entry, n: int) -> bool:
        """Whether `writer` is still there to write at tick n."""
        now = self.rosters[max(self.rosters)].agents.get(writer.key)
        return now is not None and now.since <= n and now.badge == writer.badge

    def _learn_writers(self) -> None:
        self._writers, self._exact = {}, {}
        for roster in self.rosters.values():
            for key, entry in roster.agents.items():
                if entry.lockstep:
                    self._exact[entry.badge] = key
                for port in entry.outs:
                    full = f"{self._fabric}/{key}/{port}"
                    self._writers.setdefault(full, set()).add(entry.badge)
        strangers = list(self._strangers)
        self._strangers.clear()
        for mail, stamp in strangers:
            key = plain_key(mail.key)
            if stamp.badge in self._writers.get(key, ()):
                self._keep(key, mail, stamp)
            else:
                self._strangers.append((mail, stamp))

    # -- values ------------------------------------------------------------------

    def hear_value(self, mail: Mail) -> None:
        """Take in a value, if it is from who writes its key. Raises WireError."""
        stamp, key = mail.stamp(), plain_key(mail.key)
        if stamp.n > self.newest + self._ahead:
            raise WireError(
                f"its stamp is of tick {stamp.n}, and the newest here is "
                f"{self.newest}; nobody can be so far ahead, so it would be young for "
                "ever."
            )
        if stamp.badge in self._writers.get(key, ()):
            self._keep(key, mail, stamp)
        elif key in self._told:
            own = key.partition("/")[2]
            self._check(own.rpartition("/")[0], stamp.badge, self.run)
            self._given[own] = mail, stamp
        elif run_of(stamp.badge) == self.run and mail.size <= SMALL:
            # A value may overtake the roster that names its writer.
            self._strangers.append((mail, stamp))
        else:
            raise WireError("nobody of this run writes there with that stamp.")

    def _keep(self, key: str, mail: Mail, stamp: Stamp) -> None:
        self._latest[key] = mail, stamp
        # Nobody can be further ahead; what is further back is not needed any more.
        if self.rates or not self.current - KEEP <= stamp.n <= self.current + KEEP:
            return
        kept = self._kept.setdefault(key, {})
        if stamp.n not in kept:  # the first one counts: it may be in use already
            kept[stamp.n] = Value(mail.payload, stamp.said)
            if len(kept) > KEEP:
                del kept[min(kept)]
        elif kept[stamp.n].payload != mail.payload and stamp.badge in self._exact:
            raise WireError(
                f"it is a second value of tick {stamp.n}, another one, with the badge "
                f"of {self._exact[stamp.badge]}. A program on this fabric has copied "
                "that badge. The first value counts, and nobody can know whether it "
                "is the true one: from here on a recording may be wrong."
            )

    def value(self, key: str, n: int) -> Value | None:
        """What the full key had at tick n, if it has come."""
        return self._kept.get(key, {}).get(n)
