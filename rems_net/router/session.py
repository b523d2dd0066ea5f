"""The one room that speaks Zenoh: publish, watch, ask, answer, presence.

Zenoh's threads only file mail; the owner of a `Mailbox` reads it in its own thread.
"""

import ctypes
import logging
import os
import time
from collections.abc import Callable
from contextlib import suppress
from copy import copy
from dataclasses import replace
from functools import partial
from queue import Empty, SimpleQueue
from threading import Thread, current_thread
from typing import TYPE_CHECKING, Any, Self

import zenoh

from rems_net.errors import FabricError
from rems_net.router.asking import Asking, glob, shaped
from rems_net.router.files import SESSION, check_files
from rems_net.router.finding.address import is_here
from rems_net.router.mail import Mail, Mailbox, Presence, Question, encoding
from rems_net.router.publisher import Publisher, Watch, direct
from rems_net.router.settings import Link
from rems_net.system.interrupts import Again

if TYPE_CHECKING:
    from rems_net.router.gate.users import Users

#: Zenoh's threads: one receives, one sends (Zenoh's default is six). A single thread
#: for both would come to a standstill when the receiver waits for the sender. The
#: receiver must not watch the sockets of new connections (`acc`) either, for the same
#: reason; and the sender is too busy: with `acc` on it, a router with ten robots is 10
#: % slower. So `acc` has its own thread, which starts only in a process that listens.
_ONE = "(worker_threads: 1)"
_REST = f"tx: {_ONE}, acc: {_ONE}, net: (handover: rx), app: (handover: rx)"
_THREADS = f"(rx: {_ONE}, {_REST})"
#: At a router on another machine, five receive. When a connection is lost, its receiver
#: waits for the end of the connection's tasks (`net`), for up to 10 s. With these tasks
#: on a receiver, or with one receiver, a laptop that had lost its Wi-Fi was often back
#: after 13 s, in place of 3 s. Within 10 s four connections can be lost, one after the
#: other. The sender must not run the tasks, which wait for it. On one machine this
#: would cost lock-step a quarter of its speed.
_FAR = (
    f"(rx: (worker_threads: 5), tx: {_ONE}, acc: {_ONE}, net: {_ONE}, "
    "app: (handover: net))"
)
#: A shared router gets 16 receiver threads. A thread can block for up to 5 s if a
#: client stops reading messages that must not be lost; with a single thread, one frozen
#: laptop stopped a whole class.
_SHARED = f"(rx: (worker_threads: 16), {_REST})"

logging.getLogger("zenoh.handlers").addFilter(Again())

_ORIGINS = {
    "any": zenoh.Locality.ANY,
    "own": zenoh.Locality.SESSION_LOCAL,
    "others": zenoh.Locality.REMOTE,
}


#: s. Time to join a distant router over a network that may lose messages.
LONG = 10.0
#: s. After a refusal, an answer that comes within this time still counts.
DOUBT = 0.25


def _by_no_daemon(declare: Callable[[], Any]) -> Any:
    """Return `declare()`, called by a thread that is no daemon.

    For an indirect callback Zenoh starts a thread, which is a daemon if a daemon starts
    it. Python does not wait for daemons: if this one woke up while Python ends, it
    would abort the program.
    """
    if not current_thread().daemon:
        return declare()
    came: list[Any] = []

    def call() -> None:
        try:
            came.append(declare())
        except zenoh.ZError as error:
            came.append(error)

    thread = Thread(target=call, daemon=False)
    thread.start()
    thread.join()
    if isinstance(came[0], zenoh.ZError):
        raise came[0]
    return came[0]


class Session:
    """Membership of one process in a fabric. `with Session(link) as session:`."""

    #: whether it belongs to a host that lives in the process of its clock
    near = False

    def __init__(self, link: Link):
        self.link = link
        self._keep: list[object] = []
        self._zenoh: zenoh.Session | None = None
        self._pid = 0

    def __enter__(self) -> Self:
        if self._zenoh is None:
            self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def fabric(self) -> str:
        return self.link.fabric

    @property
    def id(self) -> str:
        """Identifier of this session, unique on the fabric."""
        return str(self._open.zid())

    def on(self, fabric: str) -> "Session":
        """Return the same session with keys on this fabric; both close together."""
        other = copy(self)
        other.link = replace(self.link, fabric=fabric)
        return other

    def beside(self) -> "Session":
        """Return the same session for a host in this process; both close together."""
        other = copy(self)
        other.near = True
        return other

    def routers(self) -> list[str]:
        """Return the ids of the routers to which this session is linked."""
        return [str(zid) for zid in self._open.info.routers_zid()]

    def key(self, *chunks: str) -> str:
        """Return the full key of `kind/name/port` on this fabric."""
        return "/".join((self.link.fabric, *chunks))

    def open(self) -> None:
        """Join. Raises FabricError if there is no router, or its port is taken."""
        check_files(SESSION)
        self._say_threads()
        self._zenoh = self._serve(self.link.users) if self.link.users else self._join()
        self._pid = os.getpid()

    def _say_threads(self) -> None:
        # Zenoh reads the variable once, at its first start. A value that this process
        # inherited from a parent of ours is not the user's own choice.
        if os.environ.get("ZENOH_RUNTIME") in (None, _THREADS, _FAR, _SHARED):
            near = self.link.serve or is_here(self.link.endpoint)
            threads = _SHARED if self.link.behind else _THREADS if near else _FAR
            os.environ["ZENOH_RUNTIME"] = threads

    def _serve(self, users: "Users") -> zenoh.Session:
        from rems_net.router.gate.users import dictionary

        with dictionary(users) as file:
            return self._join(file)

    def _join(self, users: str = "") -> zenoh.Session:
        link = self.link
        while True:
            try:
                return zenoh.open(zenoh.Config.from_json5(link.to_wire(users)))
            except zenoh.ZError as error:
                # Imported here: each process of a run joins, and hardly one is refused.
                from rems_net.router.gate.refusal import cannot_open, is_far

                if link.serve or link.timeout >= LONG or not is_far(link.endpoint):
                    raise cannot_open(link, error) from None
            # Joining takes several messages; on a network that loses some, longer.
            link = replace(link, timeout=LONG)

    def open_once(self) -> bool:
        """Join and return True, or False after `link.timeout`, without a reason."""
        self._say_threads()
        try:
            self._zenoh = zenoh.open(zenoh.Config.from_json5(self.link.to_wire()))
        except zenoh.ZError:
            return False
        self._pid = os.getpid()
        return True

    def close(self) -> None:
        """Leave the fabric and remove all declarations; a second call does nothing."""
        session: Any = self._zenoh  # zenoh's stub leaves `close` untyped
        self._zenoh = None
        self._keep.clear()
        if session is not None and os.getpid() == self._pid:
            # If the network is cut, Zenoh tries to reach the router for 10 s, raises an
            # error, and is closed all the same.
            with suppress(zenoh.ZError):
                session.close()
            if self.link.serve:
                # Freed, a router waits for its threads and holds the GIL meanwhile. If
                # one of them waits for the GIL, neither ever goes on: so it stays.
                ctypes.pythonapi.Py_IncRef(ctypes.py_object(session))

    @property
    def _open(self) -> zenoh.Session:
        if self._zenoh is None:
            raise FabricError(
                "This session is closed; open it with `with` first. (R0615)"
            )
        if os.getpid() != self._pid:
            raise FabricError(
                "This session was opened before a fork, and Zenoh does not survive "
                "one; start processes by multiprocessing's 'spawn'. (R0615)"
            )
        return self._zenoh

    @property
    def connected(self) -> bool:
        """True while the router is reachable. After a loss a client reconnects."""
        return self.link.serve or bool(list(self._open.info.routers_zid()))

    def publisher(
        self, key: str, schema: str = "", *, block: bool = True, remote: bool = False
    ) -> Publisher:
        """Declare a publisher of values at `key`.

        block: True for small values that must not be lost (lock-step, commands, STOP);
        False for free-running values, which are dropped under pressure.
        remote: only other sessions receive it. With `block` values have the higher
        priority; values of one priority stay in the order in which the session sent
        them.
        """
        return Publisher(self._declared(key, schema, block, remote))

    def putting(
        self, key: str, schema: str = "", *, block: bool = True, remote: bool = False
    ) -> Callable[..., None]:
        """Declare a publisher, and return its `put_raw`: without `watched`."""
        put: Callable[..., None] = self._declared(key, schema, block, remote).put
        return put

    def _declared(
        self, key: str, schema: str, block: bool, remote: bool
    ) -> zenoh.Publisher:
        control, priority = zenoh.CongestionControl, zenoh.Priority
        where = zenoh.Locality
        return self._open.declare_publisher(
            shaped(key),
            encoding=encoding(schema),
            congestion_control=control.BLOCK if block else control.DROP,
            priority=priority.INTERACTIVE_HIGH if block else priority.DATA,
            allowed_destination=where.REMOTE if remote else where.ANY,
        )

    def put(
        self, key: str, payload: bytes, schema: str = "", *, stamp: bytes | None = None
    ) -> None:
        """Put one value reliably, without a publisher."""
        self._open.put(
            key,
            payload,
            encoding=encoding(schema),
            attachment=stamp,
            congestion_control=zenoh.CongestionControl.BLOCK,
            priority=zenoh.Priority.INTERACTIVE_HIGH,
        )

    def watch(self, key: str, mailbox: Mailbox, *, remote: bool = False) -> Watch:
        """File every value put at `key` (a glob is fine) in `mailbox`."""
        origin = zenoh.Locality.REMOTE if remote else zenoh.Locality.ANY
        take = zenoh.handlers.Callback(mailbox.put, indirect=False)
        declare = self._open.declare_subscriber
        return Watch(declare(glob(key), take, allowed_origin=origin), self._keep)

    def watch_at_once(
        self, key: str, function: Callable[[Mail], None], *, origin: str = "any"
    ) -> Watch:
        """Call `function(mail)` in its own thread, even while this process is busy.

        origin: `own` for values that this session puts, `others` for those of other
        sessions.

        The function must be short and thread-safe. It does not run in Zenoh's thread,
        which would wait for the GIL at every message and, in a flood, delay all others.
        """

        def call(sample: zenoh.Sample) -> None:
            function(Mail(sample))

        take = zenoh.handlers.Callback(call, indirect=True)
        declare, from_ = self._open.declare_subscriber, _ORIGINS[origin]
        declared = _by_no_daemon(partial(declare, key, take, allowed_origin=from_))
        return Watch(declared, self._keep)

    def answer(self, key: str, mailbox: Mailbox, topic: str = "") -> Watch:
        """File every question for `key` in `mailbox`, as a `Question` on `topic`."""

        def file(query: zenoh.Query) -> None:
            mailbox.put(Question(query, topic))

        return Watch(self._open.declare_queryable(key, direct(file)), self._keep)

    def answer_at_once(
        self,
        key: str,
        function: Callable[[Question], None],
        topic: str = "",
        *,
        apart: bool = False,
    ) -> Watch:
        """Let `function(question)` answer in Zenoh's thread, even if no mail is read.

        The function must be thread-safe and short. With `apart` it gets its own thread,
        in which it may wait a little.
        """

        def reply(query: zenoh.Query) -> None:
            with Question(query, topic) as question:
                function(question)

        if not apart:
            return Watch(self._open.declare_queryable(key, direct(reply)), self._keep)
        take = zenoh.handlers.Callback(reply, indirect=True)
        declare = partial(self._open.declare_queryable, key, take)
        return Watch(_by_no_daemon(declare), self._keep)

    def asking(
        self,
        selector: str,
        payload: bytes | None = None,
        timeout: float = 2.0,
        told: Callable[[Asking], None] | None = None,
    ) -> Asking:
        """Ask for a key; take the answers as they come. `told`: see `Asking`."""
        return Asking(self._open, selector, payload, timeout, told)

    def ask(
        self,
        selector: str,
        payload: bytes | None = None,
        timeout: float = 2.0,
        *,
        first: bool = False,
    ) -> list[Mail]:
        """Ask for a key; return one Mail per answer.

        first: return at the first answer: for a key with one owner, even if another
        program keeps the question open. No answer is an empty list. It does not mean
        that nobody is there: right after a reconnect Zenoh may find nobody for some
        milliseconds. Raises FabricError with the refusal's own sentence if there are
        only refusals.
        """
        answers: list[Mail] = []
        refusal = ""
        until = time.monotonic() + timeout
        with self.asking(selector, payload, timeout) as asking:
            while (came := asking.next(until)) is not None:
                if isinstance(came, Mail):
                    answers.append(came)
                    if first:
                        break
                elif not refusal:
                    refusal = came
                    if first:  # any program can refuse; the owner may only be slower
                        until = min(until, time.monotonic() + DOUBT)
        if refusal and not answers:
            raise FabricError(refusal)
        return answers

    def ask_at_once(
        self,
        selector: str,
        function: Callable[[Mail], None],
        timeout: float = 2.0,
        payload: bytes | None = None,
    ) -> None:
        """Ask without waiting; `function(mail)` is called in Zenoh's own thread.

        `Mailbox.put` is a possible function.
        """

        def file(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                function(Mail(reply.ok))

        self._open.get(
            selector,
            direct(file),
            # Without ALL, Zenoh asks only one queryable that declares itself
            # `complete`.
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout,
            payload=payload,
        )

    def present(self, key: str) -> Watch:
        """Declare presence at `key` until it closes or the process dies."""
        return Watch(self._open.liveliness().declare_token(key), self._keep)

    def who(self, key: str, timeout: float = 2.0) -> list[str]:
        """Return the keys of those present now."""
        # Not Zenoh's own queue of 256: where the tokens are known already, `get` fills
        # it before it returns, and a full one blocks this session for ever.
        came: SimpleQueue[zenoh.Reply | None] = SimpleQueue()
        take = direct(came.put, drop=partial(came.put, None))
        self._open.liveliness().get(key, take, timeout=timeout)
        keys, end = [], time.monotonic() + timeout
        with suppress(Empty):
            while reply := came.get(timeout=max(0.0, end - time.monotonic())):
                if reply.ok is not None:
                    keys.append(str(reply.ok.key_expr))
        return sorted(keys)

    def watch_presence(self, key: str, mailbox: Mailbox) -> Watch:
        """File a `Presence` for each agent that is here, comes or goes."""

        def file(sample: zenoh.Sample) -> None:
            alive = sample.kind == zenoh.SampleKind.PUT
            mailbox.put(Presence(str(sample.key_expr), alive))

        declare = self._open.liveliness().declare_subscriber
        return Watch(declare(key, direct(file), history=True), self._keep)
