"""Admission of clients to a shared router, and limits of what each may hold there."""

import time
from collections import Counter, OrderedDict
from collections.abc import Callable

from rems_net.router.asking import printable
from rems_net.router.gate.probe import PROBE
from rems_net.router.gate.users import OWNER, Users
from rems_net.router.relay import handshake, limits
from rems_net.router.relay.connection import MOMENT, Connection
from rems_net.router.relay.handshake import Hello, Login
from rems_net.router.relay.ids import Ids
from rems_net.router.relay.limits import Guesses
from rems_net.router.relay.notices import Notices

#: s. A refused laptop may ask for the reason within this time.
MEMORY = 5.0

NO_CLIENT = "was refused {times}: it came as a {last}, and only clients are let in"
WRONG = "gave a wrong password {times}, last as {last}"
TOO_FAST = "was refused {times}: it tries passwords too quickly"
TAKEN = "was refused {times}: its session has the id of one of {last}"
TOO_MANY = "was refused {times}: {last}"


class Admission:
    """Admission: decides on each handshake, and counts the sessions of each owner.

    users: None on an open router.  sessions: most of all owners together.
    later: calls a function in so many seconds.
    """

    def __init__(
        self,
        users: Users | None,
        sessions: int,
        notices: Notices,
        later: Callable[[float, Callable[[], None]], None],
    ):
        self._users, self._most_of_all = users, sessions
        self._notices, self._later = notices, later
        self._ids = Ids(named=users is not None)
        self._guesses = Guesses(time.monotonic)
        #: by Zenoh id, its session
        self._live: dict[bytes, Connection] = {}
        #: by ending session, the function to call after its end
        self._after: dict[Connection, Callable[[], None]] = {}
        #: number of sessions, by owner
        self._sessions: Counter[str] = Counter()
        #: by address: reason and time of its last refusal
        self._reasons: OrderedDict[str, tuple[int, float]] = OrderedDict()

    def refuses(self, one: Connection, hello: Hello) -> bool:
        """Return whether a connection was closed because of its InitSyn."""
        if hello.zid == PROBE and (why := self._reason(one.host)):
            one.refuse(why)
        elif hello.mode != "client":
            self._refuse(one, handshake.UNSUPPORTED, NO_CLIENT, hello.mode)
        elif not self._guesses.may(one.host):
            self._refuse(one, handshake.EXPIRED, TOO_FAST)
        elif self._sessions.total() >= self._most_of_all:
            full = f"all {self._most_of_all} sessions of this router are taken"
            self._refuse(one, handshake.TOO_MANY, TOO_MANY, full)
        else:
            return False
        return True

    def _refuse(self, one: Connection, reason: int, line: str, last: str = "") -> None:
        self._notices.add(one.host, line, last)
        self._reasons[one.host] = (reason, time.monotonic())
        self._reasons.move_to_end(one.host)
        if len(self._reasons) > limits.ADDRESSES:
            self._reasons.popitem(last=False)
        one.refuse(reason)

    def _reason(self, host: str) -> int:
        """Return why this address was refused a moment ago; 0 if it was not."""
        reason, then = self._reasons.get(host, (0, 0.0))
        return reason if time.monotonic() - then < MEMORY else 0

    def owner(self, one: Connection, login: Login | None, challenge: int | None) -> str:
        """Return the owner of a session; "" if it was refused."""
        if self._users is None:
            return one.host
        if not self._guesses.may(one.host):
            self._refuse(one, handshake.EXPIRED, TOO_FAST)
            return ""
        if login is None or challenge is None:
            self._refuse(one, handshake.INVALID, WRONG, "nobody")
            return ""
        password = self._users.passwords.get(login.user)
        if password is None or not handshake.proves(login, password, challenge):
            self._guesses.add(one.host)
            name = repr(printable(login.user)[:40])
            self._refuse(one, handshake.INVALID, WRONG, name)
            return ""
        return login.user

    def claim(self, one: Connection, owner: str, then: Callable[[], None]) -> None:
        """Pass OpenSyn on to the router (`then`), if this owner may have its id."""
        if of := self._ids.holder(one.zid, owner):
            self._refuse(one, handshake.TAKEN, TAKEN, of)
            return
        old = self._live.get(one.zid)
        most = self._most(one, owner)
        if old is None and self._sessions[owner] >= most:
            much = f"{owner} has {most} sessions, and may have no more"
            self._refuse(one, handshake.TOO_MANY, TOO_MANY, much)
            return
        one.owner = owner
        self._sessions[owner] += 1
        if old is None:
            then()
        else:  # an owner is back, and the old connection is dead or another address's
            self._after[old] = lambda: self._later(MOMENT, then)
            old.end()

    def _most(self, one: Connection, owner: str) -> int:
        if owner == OWNER or (self._users is None and one.ours):
            return self._most_of_all
        return limits.OF_USER if self._users else limits.OF_ADDRESS

    def let_in(self, one: Connection) -> None:
        """Note that Zenoh has let a session in."""
        self._live[one.zid] = one
        self._ids.bind(one.zid, one.owner)

    def gone(self, one: Connection) -> None:
        """Forget a session that has ended."""
        if self._live.get(one.zid) is one:
            del self._live[one.zid]
            self._ids.end(one.zid, one.owner)
        if one.owner:
            self._sessions[one.owner] -= 1
            if not self._sessions[one.owner]:
                del self._sessions[one.owner]
        if then := self._after.pop(one, None):
            then()
