"""Membership: the data of a host's membership in one run."""

from collections import Counter, deque
from collections.abc import Callable
from math import ceil
from typing import NamedTuple

from rems_net.agents.about.wiring import Entry
from rems_net.agents.protocol.badge import run_of
from rems_net.agents.protocol.crowds import CrowdValues, Layout, read_crowd
from rems_net.agents.protocol.limits import AHEAD
from rems_net.agents.protocol.messages import Admission, Beat
from rems_net.agents.protocol.roster import Roster
from rems_net.agents.protocol.shapes import wrong
from rems_net.agents.tick import time_of
from rems_net.errors import WireError
from rems_net.router.keys import ALL, STEP, crowd_key, plain_key
from rems_net.router.mail import Mail
from rems_net.router.message import Stamp

#: Values kept per key. A writer may be AHEAD ticks in front, and a tick is read twice:
#: by later phases as the current value, by earlier ones as the previous value.
KEEP = AHEAD + 2
#: Number of values kept whose writer is not on a roster yet. The host asks again for
#: values that do not fit.
STRANGERS = 256
#: Bytes. Larger values are not kept for the next roster.
SMALL = 4096
#: s. Another host can receive ticks earlier than this one by at most this much. A real
#: robot obeys no command that is older.
SKEW = 0.5
#: s. If a host skips ticks of this much time, it warns.
LATE = 1.0


class Released(Exception):  # noqa: N818 - not an error: the clock let this host go
    """The roster no longer names this host."""


class Orphaned(Exception):  # noqa: N818 - not an error of this host
    """The parent of this host or its clock is gone, or the clock gave it up."""


class Value(NamedTuple):
    """Payload at a key, and the tick at which its source first had it."""

    payload: bytes
    said: int


class Membership:
    """Membership of one run: thrown away when it ends, with all values.

    rates: the `every` of each agent, if all agents of the host are free-running; else
    nothing.
    told: full keys at which programs outside may put values for this host.
    latest: by full key, the newest value of an agent.  given: by key of the In, the
    newest value of a program outside. Both begin empty.
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
        #: Ticks. A stamp may be ahead of the newest tick received here by this much.
        self._ahead = max(AHEAD + 1, ceil(SKEW / self.dt))
        #: ticks to be done, in order
        self.beats: deque[Beat] = deque()
        #: the newest tick up to which all have come, and the tick begun last
        self.newest = self.current = admission.first - 1
        self._first = admission.first
        #: ticks that came while an earlier one is missing
        self._early: dict[int, Beat] = {}
        #: Whether the clock sent a tick again: a message is late, or was lost.
        self.repeated = False
        #: How late this host has just been, as a sentence part; "" if it was in time.
        self.lateness = ""
        self.rosters: dict[int, Roster] = {}
        self._admitted = False
        #: full key of a port -> badges of agents that may write it
        self._writers: dict[str, set[int]] = {}
        #: full keys of the values of agents in lock-step
        self.steps: set[str] = set()
        #: badge -> agent, for agents in lock-step: they write one value a tick
        self._exact: dict[int, str] = {}
        self._latest, self._given = latest, given
        latest.clear()
        given.clear()
        self._kept: dict[str, dict[int, Value]] = {}
        #: values of crowds: by key, tick, and badge with schema
        self._crowds: dict[str, dict[int, dict[tuple[int, str], CrowdValues]]] = {}
        #: by key, and badge with schema: the layout of the newest message
        self._layouts: dict[tuple[str, tuple[int, str]], Layout] = {}
        #: number of agents in lock-step, by badge of their host
        self.sizes: Counter[int] = Counter()
        self._strangers: deque[tuple[Mail, Stamp]] = deque(maxlen=STRANGERS)

    def hear_beat(self, beat: Beat) -> None:
        """Take in a tick; ignore one of another run. Raises WireError."""
        tick = beat.tick
        if beat.run != self.run:
            return
        n = tick.n
        if tick.dt != self.dt or tick.t != time_of(n, tick.dt):
            raise WireError(
                f"tick {tick.n} is at {tick.t:g} s, in steps of {tick.dt:g} s; "
                f"expected steps of {self.dt:g} s. (R0621)"
            )
        if n == self.newest + 1 and not self._early:  # as nearly always
            self.newest = n
            self.beats.append(beat)
            return
        if n <= self.newest or n in self._early:
            self.repeated = True
            return
        if self.rates:  # nobody waits for this host: ticks that it missed are past
            self.newest = tick.n - 1
            self._early.clear()
        elif tick.n > self.newest + AHEAD + 1:
            raise WireError(
                f"tick {tick.n} is further ahead of {self.newest} than a clock can be."
                " (R0621)"
            )
        self._early[tick.n] = beat
        while self.newest + 1 in self._early:
            self.newest += 1
            self.beats.append(self._early.pop(self.newest))

    def take(self) -> Beat:
        """Return the next tick to be done; one must be there."""
        if self.rates:
            self._skip()
        beat = self.beats.popleft()
        self.current = beat.tick.n
        return beat

    def _skip(self) -> None:
        """Skip all ticks but the newest one to step at: this host is too slow."""
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

    def hear_roster(self, roster: Roster) -> None:
        """Take in a roster. Raises Released, or Orphaned if the clock gave us up."""
        if roster.run != self.run:
            return
        newest = roster.epoch > max(self.rosters, default=-1)
        self.rosters[roster.epoch] = roster
        self._learn_writers()
        # It is a lost one that we asked for, or older than this membership.
        if not newest or roster.first < self._first:
            return
        # By badge: another host may have this one's name by now.
        here = any(entry.badge == self.badge for entry in roster.agents.values())
        if not here and self._host in roster.gone:
            raise Orphaned(f"the clock gave this host up: {roster.gone[self._host]}")
        if not here and (self._admitted or not roster.agents):
            raise Released
        self._admitted = self._admitted or here

    def has_roster(self, epoch: int) -> bool:
        """Return whether the roster that a tick names is here, or a usable newer one.

        The clock keeps each roster as long as a host that it waits for needs it. A
        free-running host may come too late for a roster, and takes the next.
        """
        late = self.rates and max(self.rosters, default=-1) > epoch
        return bool(late) or epoch in self.rosters

    def take_roster(self, epoch: int) -> Roster:
        """Return the roster of this epoch, and forget those before."""
        for old in [e for e in self.rosters if e < epoch]:
            del self.rosters[old]
        return self.rosters[min(self.rosters)]

    def writes_on(self, writer: Entry, n: int) -> bool:
        """Return whether `writer` is still there to write at tick n."""
        now = self.rosters[max(self.rosters)].agents.get(writer.key)
        return now is not None and now.since <= n and now.badge == writer.badge

    def _learn_writers(self) -> None:
        self._writers, self._exact, self.steps = {}, {}, set()
        self._layouts.clear()
        self.sizes.clear()
        for roster in self.rosters.values():
            badges = (e.badge for e in roster.agents.values() if e.lockstep)
            self.sizes |= Counter(badges)
            for key, entry in roster.agents.items():
                if entry.lockstep:
                    self._exact[entry.badge] = key
                for port in entry.outs:
                    self.steps.add(f"{self._fabric}/{key}/{STEP}/{port}")
                    self.steps.add(f"{self._fabric}/{entry.kind}/{STEP}/{port}")
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

    def hear_value(self, mail: Mail) -> None:
        """Take in a value, if its sender may write its key. Raises WireError."""
        stamp, key = mail.stamp(), plain_key(mail.key)
        if stamp.n > self.newest + self._ahead:
            raise WireError(
                f"its stamp is of tick {stamp.n}, and the newest here is "
                f"{self.newest}; no writer can be so far ahead, and it would be "
                "young for ever. (R0621)"
            )
        if stamp.badge in self._writers.get(key, ()):
            self._keep(key, mail, stamp)
        elif f"/{ALL}/" in key and run_of(stamp.badge) == self.run:
            if stamp.badge in self._exact:  # else it has overtaken the roster
                self._keep_crowd(key, mail, stamp)
        elif key in self._told:
            own = key.partition("/")[2]
            self._check(own.rpartition("/")[0], stamp.badge, self.run)
            self._given[own] = mail, stamp
        elif run_of(stamp.badge) == self.run and mail.size <= SMALL:
            # A value may overtake the roster that names its writer.
            self._strangers.append((mail, stamp))
        else:
            raise WireError(
                "no member of this run writes there with that stamp. (R0621)"
            )

    def _keep(self, key: str, mail: Mail, stamp: Stamp) -> None:
        self._latest[key] = mail, stamp
        if not self._is_near(stamp):
            return
        kept = self._kept.setdefault(key, {})
        if stamp.n not in kept:  # the first one counts: it may be in use already
            kept[stamp.n] = Value(mail.payload, stamp.said)
            if len(kept) > KEEP:
                del kept[min(kept)]
        elif kept[stamp.n].payload != mail.payload and stamp.badge in self._exact:
            raise self._copied(stamp)

    def _is_near(self, stamp: Stamp) -> bool:
        """Return whether to keep a value: no writer can be further ahead than that.

        Older values are not needed any more.
        """
        near = self.current - KEEP <= stamp.n <= self.current + KEEP
        return near and not self.rates

    def _copied(self, stamp: Stamp) -> WireError:
        return WireError(
            f"it is a second value of tick {stamp.n}, another one, with the badge "
            f"of {self._exact[stamp.badge]}. A program on this fabric has copied "
            "that badge. The first value counts, which may be the wrong one: "
            "from here on a recording may be wrong. (R0621)"
        )

    def _keep_crowd(self, key: str, mail: Mail, stamp: Stamp) -> None:
        if not self._is_near(stamp):
            return
        of, message = (stamp.badge, mail.schema), mail.payload
        digest = of[1].rpartition("@")[2]
        if not any(digest in roster.schemas for roster in self.rosters.values()):
            raise wrong("its encoding", of[1], "the schema of a port of the run")
        kept = self._crowds.setdefault(key, {})
        known = kept.setdefault(stamp.n, {}).get(of)
        if known is not None:
            if known.message != message:
                raise self._copied(stamp)
            return
        values, self._layouts[key, of] = read_crowd(
            message, self._layouts.get((key, of))
        )
        kept[stamp.n][of] = values
        if len(kept) > KEEP:
            del kept[min(kept)]

    def value(self, key: str, n: int) -> Value | None:
        """Return the value of the full key at tick n; None if it has not come."""
        value = self._kept.get(key, {}).get(n)
        if value is None and (crowd := self.crowd(key, n)) is not None:
            return Value(crowd.payloads[crowd.where[crowd_key(key)[1]]], n)
        return value

    def crowd(self, key: str, n: int) -> CrowdValues | None:
        """Return the values that came with that of the full key at tick n, if any."""
        if self._crowds:
            together, name = crowd_key(key)
            for (badge, _), some in self._crowds.get(together, {}).get(n, {}).items():
                if name in some.where and badge in self._writers.get(key, ()):
                    return some
        return None
