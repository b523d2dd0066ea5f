"""Gate: what listens at a shared router's public address, in front of Zenoh.

Zenoh can refuse nobody by address, by id or by mode, and a connection counts for it
from its first packet. So Zenoh's router listens on a port of this machine only, and
one thread here relays between it and the clients.
"""

from __future__ import annotations

import _thread
import heapq
import selectors
import socket
import threading
import time
from collections import Counter, OrderedDict
from collections.abc import Callable
from contextlib import suppress
from itertools import count
from typing import Self

from rems_net.errors import FabricError
from rems_net.router.asking import printable
from rems_net.router.finding.address import host_and_port, is_here
from rems_net.router.gate.greeting import PROBE
from rems_net.router.gate.users import OWNER, Users
from rems_net.router.relay import handshake, limits
from rems_net.router.relay.connection import MOMENT, Connection
from rems_net.router.relay.descriptors import room
from rems_net.router.relay.end import CHUNK, End
from rems_net.router.relay.handshake import Hello, Login
from rems_net.router.relay.ids import KEPT, Ids
from rems_net.router.relay.limits import Guesses, Waiting, group
from rems_net.router.relay.listening import Listener
from rems_net.router.relay.notices import Notices
from rems_net.router.relay.scouts import Scouts
from rems_net.router.settings import INSIDE

#: bytes that the system keeps for a client that reads slowly: with a small buffer a
#: reader that is frozen is known sooner
FOR_CLIENT = 131_072
#: s between looks at what takes too long
LOOK = 0.25
#: s in which a laptop that was refused asks for the reason
MEMORY = 5.0
#: s that the last bytes of an ended connection get
LAST = 2.0

NO_HANDSHAKE = "opened connections and did not join; they were closed: {times}"
NO_CLIENT = "was refused {times}: it came as a {last}, and only clients are let in"
WRONG = "gave a wrong password {times}, last as {last}"
TOO_FAST = "was refused {times}: it tries passwords too quickly"
TAKEN = "was refused {times}: its session has the id of one of {last}"
TOO_MANY = "was refused {times}: {last}"
FULL = "has no room for more connections ({last}): newcomers wait"
NO_ZENOH = "no Zenoh client begins so"
UNREADABLE = "was disconnected {times}: {last}"


class Gate:
    """`with Gate(...) as gate:` has the port; `gate.open(...)` lets clients in."""

    def __init__(
        self,
        listen: str,
        users: Users | None,
        report: Callable[[str], None],
    ):
        """report: prints a line on the teacher's screen."""
        self._listen, self._users = listen, users
        self.inner = ("127.0.0.1", 0)
        self.buffer = memoryview(bytearray(CHUNK))
        self._notices = Notices(report)
        self._ids = Ids(KEPT if users is None else None)
        self._guesses = Guesses(time.monotonic)
        self._room = room()
        self._others: Waiting[Connection] = Waiting(limits.OF_ONE, self._room.others)
        self._ours: Waiting[Connection] = Waiting(limits.OF_ONE, self._room.ours)
        self._live: dict[bytes, Connection] = {}
        self._after: dict[Connection, Callable[[], None]] = {}
        self._all: set[Connection] = set()
        self._sessions: Counter[str] = Counter()
        #: by address: why it was refused last, and when
        self._reasons: OrderedDict[str, tuple[int, float]] = OrderedDict()
        #: connections by address, in this second
        self._came: Counter[str] = Counter()
        self._second = 0
        self._later: list[tuple[float, int, Callable[[], None]]] = []
        self._order = count()
        self._scouts: Scouts | None = None
        self._failure: BaseException | None = None
        self._ended = False
        self._thread = threading.Thread(target=self._run, name="gate", daemon=True)

    def __enter__(self) -> Self:
        self._listener = Listener(self._listen, self._accept)
        self.selector = selectors.DefaultSelector()
        self._wake, self._woken = socket.socketpair()
        return self

    def open(self, inner: str, zid: str) -> None:
        """Let clients in from now on, to the router with this id at this endpoint."""
        self.inner = host_and_port(inner)
        self._scouts = Scouts(self._listen, zid)
        self._listener.listen(self.selector)
        if not is_here(self._listen):
            self._scouts.listen(self.selector)
        self._notices.start()
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        """End. Raises FabricError if the gate has ended by itself."""
        self._ended = True
        self._wake.close()
        if self._thread.ident is not None:
            self._thread.join()
            self._notices.end()
        self._woken.close()
        self._listener.close()
        if self._scouts is not None:
            self._scouts.close()
        self.selector.close()
        if self._failure is not None:
            raise FabricError(
                "The router's gate has ended by a mistake of its own, and so has the "
                f"router: {self._failure!r}. Start it again, and report this line."
            ) from self._failure

    # -- its thread --------------------------------------------------------------------

    def _run(self) -> None:
        try:
            self._loop()
        except Exception as error:  # it must not leave a port at which nobody answers
            self._failure = error
            _thread.interrupt_main()
        finally:
            self._listener.close()
            for one in list(self._all):
                one.drop()

    def _loop(self) -> None:
        selector = self.selector
        selector.register(self._woken, selectors.EVENT_READ, None)
        look = 0.0
        while not self._ended:
            for key, mask in selector.select(self._pause()):
                end = key.data
                if end is None:
                    continue
                try:
                    end.ready(mask)
                except handshake.HandshakeError as error:
                    self.unfit(end.owner, f"{NO_ZENOH} ({error})")
                except OSError as error:  # no socket for Zenoh's side, or no memory
                    self._full(end.owner, error)
                except Exception as error:  # what one sends must not end the rest
                    if end.owner is None:
                        raise
                    self.unfit(end.owner, f"it could not be read ({error!r})")
            now = time.monotonic()
            if now >= look or (self._later and self._later[0][0] <= now):
                look = now + LOOK
                self._look(now)

    def _pause(self) -> float:
        """Return for how many seconds nothing is due."""
        if self._later:
            return min(LOOK, max(0.0, self._later[0][0] - time.monotonic()))
        return LOOK if self._others.count or self._ours.count else 1.0

    def _look(self, now: float) -> None:
        """Do what is due, and close what takes too long."""
        if int(now) != self._second:
            self._second = int(now)
            self._came.clear()
        while self._later and self._later[0][0] <= now:
            heapq.heappop(self._later)[2]()
        for waiting in (self._others, self._ours):
            for one in waiting.older(now - limits.PATIENCE):
                self._notices.add(one.host, NO_HANDSHAKE)
                one.drop(at_once=True)

    def later(self, seconds: float, what: Callable[[], None]) -> None:
        """Call it in so many seconds."""
        due = time.monotonic() + seconds
        heapq.heappush(self._later, (due, next(self._order), what))

    def _accept(self, sock: socket.socket, host: str, ours: bool) -> None:
        host = group(host)
        self._came[host] += 1
        if self._came[host] > limits.A_SECOND:  # no time is lost with these
            sock.close()
            self._notices.add(host, NO_HANDSHAKE)
            return
        self.shape(sock, FOR_CLIENT)
        end = End(sock, self.selector, self.buffer)
        one = Connection(self, end, host, ours)
        self._all.add(one)
        waiting = self._ours if ours else self._others
        if old := waiting.add(one.host, one, time.monotonic()):
            self._notices.add(old.host, NO_HANDSHAKE)
            old.drop(at_once=True)

    def _full(self, one: Connection | None, error: OSError) -> None:
        """The system gives no more sockets: newcomers wait until it does."""
        self._notices.add("this machine", FULL, error.strerror or str(error))
        for waiting in (self._others, self._ours):
            if old := waiting.oldest():
                old.drop(at_once=True)
        if one is not None:
            one.drop()
        self._listener.pause()
        self.later(LOOK, lambda: self._listener.listen(self.selector))

    # -- what connections ask ----------------------------------------------------------

    def shape(self, sock: socket.socket, sent: int = INSIDE) -> None:
        """Give a socket small buffers."""
        with suppress(OSError):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, sent)
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, INSIDE)

    def refuses(self, one: Connection, hello: Hello) -> bool:
        """Close a connection whose InitSyn is not to reach Zenoh."""
        if hello.zid == PROBE and (why := self._reason(one.host)):
            one.refuse(why)
        elif hello.mode != "client":
            self._refuse(one, handshake.UNSUPPORTED, NO_CLIENT, hello.mode)
        elif not self._guesses.may(one.host):
            self._refuse(one, handshake.EXPIRED, TOO_FAST)
        elif self._sessions.total() >= self._room.sessions:
            full = f"all {self._room.sessions} sessions of this router are taken"
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
        """Return to whom a session belongs; nothing if it was refused."""
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
            self._refuse(one, handshake.INVALID, WRONG, repr(_short(login.user)))
            return ""
        return login.user

    def claim(self, one: Connection, owner: str, then: Callable[[], None]) -> None:
        """Let the router have the OpenSyn (`then`), if this owner may have its id."""
        if not self._ids.may(one.zid, owner, time.monotonic()):
            of = self._ids.owner(one.zid)
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
        else:  # the same owner is back, and the old connection leads nowhere
            self._after[old] = lambda: self.later(MOMENT, then)
            old.end()

    def _most(self, one: Connection, owner: str) -> int:
        if owner == OWNER or (self._users is None and one.ours):
            return self._room.sessions
        return limits.OF_USER if self._users else limits.OF_ADDRESS

    def let_in(self, one: Connection) -> None:
        """Note that Zenoh has let it in."""
        (self._ours if one.ours else self._others).remove(one.host, one)
        self._live[one.zid] = one
        self._ids.bind(one.zid, one.owner)

    def unfit(self, one: Connection, why: str) -> None:
        """Disconnect a client whose messages would hurt the router."""
        self._notices.add(one.host, UNREADABLE, why)
        one.drop()

    def drop_later(self, one: Connection) -> None:
        """Give the last bytes of a connection a while."""
        self.later(LAST, one.drop)

    def gone(self, one: Connection) -> None:
        """Forget a connection; calling it twice is fine."""
        if one not in self._all:
            return
        self._all.remove(one)
        (self._ours if one.ours else self._others).remove(one.host, one)
        if self._live.get(one.zid) is one:
            del self._live[one.zid]
            self._ids.end(one.zid, time.monotonic())
        if one.owner:
            self._sessions[one.owner] -= 1
            if not self._sessions[one.owner]:
                del self._sessions[one.owner]
        if then := self._after.pop(one, None):
            then()


def _short(name: str) -> str:
    return printable(name)[:40]
