"""Gate: it listens at a shared router's public address, in front of Zenoh.

Zenoh cannot refuse a client by address, by id or by mode, and counts a connection from
its first packet. So Zenoh's router listens on a port of this machine only, and one
thread here relays between it and the clients.
"""

import _thread
import heapq
import selectors
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from itertools import count
from typing import Self

from rems_net.errors import FabricError
from rems_net.router.finding.address import host_and_port, is_here
from rems_net.router.gate.users import Users
from rems_net.router.keys import FABRIC
from rems_net.router.relay import handshake, limits
from rems_net.router.relay.admission import Admission
from rems_net.router.relay.connection import Connection
from rems_net.router.relay.descriptors import room
from rems_net.router.relay.end import CHUNK, End
from rems_net.router.relay.limits import Waiting, group
from rems_net.router.relay.listening import Listener
from rems_net.router.relay.notices import Notices
from rems_net.router.relay.people import People
from rems_net.router.relay.scouts import Scouts
from rems_net.router.settings import INSIDE

#: bytes of the system's buffer for a client that reads slowly: a small buffer reveals a
#: frozen reader sooner
FOR_CLIENT = 131_072
#: s. Interval in which slow handshakes are closed.
LOOK = 0.25
#: s. Time for the last bytes of an ended connection.
LAST = 2.0

NO_HANDSHAKE = "opened connections and did not join; they were closed: {times}"
FULL = "has no room for more connections ({last}): newcomers wait"
NO_ZENOH = "no Zenoh client begins so"
UNREADABLE = "was disconnected {times}: {last}"


class Gate:
    """Relay at a port: `with Gate(...)` opens it; `gate.open(...)` lets clients in."""

    def __init__(
        self,
        listen: str,
        users: Users | None,
        report: Callable[[str], None],
        fabric: str = FABRIC,
    ):
        """report: prints a line on the teacher's screen.  fabric: the class's own."""
        self._listen = listen
        self.inner = ("127.0.0.1", 0)
        self.buffer = memoryview(bytearray(CHUNK))
        self.notices = Notices(report)
        self.people = People(users, fabric, self.notices)
        self._room = room()
        self.admission = Admission(users, self._room.sessions, self.notices, self.later)
        self._others: Waiting[Connection] = Waiting(limits.OF_ONE, self._room.others)
        self._ours: Waiting[Connection] = Waiting(limits.OF_ONE, self._room.ours)
        self._all: set[Connection] = set()
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
        self.notices.start()
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        """End. Raises FabricError if the gate has ended by itself."""
        self._ended = True
        self._wake.close()
        if self._thread.ident is not None:
            self._thread.join()
            self.notices.end()
        self._woken.close()
        self._listener.close()
        if self._scouts is not None:
            self._scouts.close()
        self.selector.close()
        if self._failure is not None:
            raise FabricError(
                "The router's gate has ended by a mistake of its own, and so has the "
                f"router: {self._failure!r}. Start it again, and report this line."
                " (R0601)"
            ) from self._failure

    # -- its thread --------------------------------------------------------------------

    def _run(self) -> None:
        try:
            self._loop()
        # otherwise a port would stay open that never answers
        except Exception as error:
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
                except Exception as error:  # one client's bytes must not end the others
                    if end.owner is None:
                        raise
                    self.unfit(end.owner, f"it could not be read ({error!r})")
            now = time.monotonic()
            if now >= look or (self._later and self._later[0][0] <= now):
                look = now + LOOK
                self._look(now)

    def _pause(self) -> float:
        """Return the time until the next task [s]."""
        if self._later:
            return min(LOOK, max(0.0, self._later[0][0] - time.monotonic()))
        return LOOK if self._others.count or self._ours.count else 1.0

    def _look(self, now: float) -> None:
        """Do the tasks that are due, and close slow handshakes."""
        if int(now) != self._second:
            self._second = int(now)
            self._came.clear()
        self.people.look(now)
        while self._later and self._later[0][0] <= now:
            heapq.heappop(self._later)[2]()
        for waiting in (self._others, self._ours):
            for one in waiting.older(now - limits.HANDSHAKE_TIMEOUT):
                self.notices.add(one.host, NO_HANDSHAKE)
                one.drop(at_once=True)

    def later(self, seconds: float, what: Callable[[], None]) -> None:
        """Call `what` in so many seconds."""
        due = time.monotonic() + seconds
        heapq.heappush(self._later, (due, next(self._order), what))

    def _accept(self, sock: socket.socket, host: str, ours: bool) -> None:
        host = group(host)
        self._came[host] += 1
        if self._came[host] > limits.A_SECOND:  # closed without any work
            sock.close()
            self.notices.add(host, NO_HANDSHAKE)
            return
        self.shape(sock, FOR_CLIENT)
        end = End(sock, self.selector, self.buffer)
        one = Connection(self, end, host, ours)
        self._all.add(one)
        waiting = self._ours if ours else self._others
        if old := waiting.add(one.host, one, time.monotonic()):
            self.notices.add(old.host, NO_HANDSHAKE)
            old.drop(at_once=True)

    def _full(self, one: Connection | None, error: OSError) -> None:
        """Make newcomers wait until the system gives sockets again."""
        self.notices.add("this machine", FULL, error.strerror or str(error))
        for waiting in (self._others, self._ours):
            if old := waiting.oldest():
                old.drop(at_once=True)
        if one is not None:
            one.drop()
        self._listener.pause()
        self.later(LOOK, lambda: self._listener.listen(self.selector))

    def shape(self, sock: socket.socket, sent: int = INSIDE) -> None:
        """Give a socket small buffers."""
        with suppress(OSError):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, sent)
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, INSIDE)

    def let_in(self, one: Connection) -> None:
        """Note that Zenoh has let a connection in."""
        (self._ours if one.ours else self._others).remove(one.host, one)
        self.admission.let_in(one)
        self.people.came(one, time.monotonic())

    def unfit(self, one: Connection, why: str) -> None:
        """Disconnect a client whose messages would hurt the router."""
        self.notices.add(one.host, UNREADABLE, why)
        one.drop()

    def drop_later(self, one: Connection) -> None:
        """Drop a connection after some time for its last bytes."""
        self.later(LAST, one.drop)

    def gone(self, one: Connection) -> None:
        """Forget a connection; a second call does nothing."""
        if one not in self._all:
            return
        self._all.remove(one)
        (self._ours if one.ours else self._others).remove(one.host, one)
        self.admission.gone(one)
        self.people.left(one, time.monotonic())
