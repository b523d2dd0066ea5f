"""The one room that speaks Zenoh: publish, watch, ask, answer, presence.

Zenoh's threads only file mail; whoever owns a `Mailbox` reads it in its own thread.
"""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable
from contextlib import suppress
from copy import copy
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Self

import zenoh

from rems_net.errors import FabricError
from rems_net.interrupts import Again
from rems_net.router.asking import Asking, glob, shaped
from rems_net.router.files import SESSION, check_files
from rems_net.router.mail import Mail, Mailbox, Presence, Question, encoding
from rems_net.router.publisher import Publisher, Watch
from rems_net.router.settings import Link

if TYPE_CHECKING:
    from rems_net.router.gate.users import Users

#: Zenoh's threads: one that receives, one that sends, and none more to wake up (its
#: own choice is six). One for both would do less still, and come to a standstill when
#: the receiver has to wait for the sender. So it would if the receiver were to look
#: after the sockets of who joins (`acc`), and hear that they can be written again; and
#: the sender is too busy for it: a router with ten robots is a tenth slower. So they
#: have a thread of their own, which a process that does not listen never starts.
_ONE = "(worker_threads: 1)"
_RX = "(handover: rx)"
_REST = f"tx: {_ONE}, acc: {_ONE}, net: {_RX}, app: {_RX}"
_THREADS = f"(rx: {_ONE}, {_REST})"
#: 16 receivers of a router that is shared. One waits, up to 5 s, while somebody reads
#: nothing of what must not be lost; with one for all, a class stood still for a laptop.
_SHARED = f"(rx: (worker_threads: 16), {_REST})"

logging.getLogger("zenoh.handlers").addFilter(Again())

_ORIGINS = {
    "any": zenoh.Locality.ANY,
    "own": zenoh.Locality.SESSION_LOCAL,
    "others": zenoh.Locality.REMOTE,
}

#: seconds to join a router that is far away, and whose network may lose messages
LONG = 10.0
#: seconds in which an answer still counts more than another's refusal
DOUBT = 0.25


class Session:
    """One process's membership of a fabric. `with Session(link) as session:`."""

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
        """What no other session on the fabric has."""
        return str(self._open.zid())

    def on(self, fabric: str) -> Session:
        """The same session, whose keys are on this fabric; closed with this one."""
        other = copy(self)
        other.link = replace(self.link, fabric=fabric)
        return other

    def routers(self) -> list[str]:
        """The ids of the routers this session is linked to."""
        return [str(zid) for zid in self._open.info.routers_zid()]

    def key(self, *chunks: str) -> str:
        """The full key of `kind/name/port` on this fabric."""
        return "/".join((self.link.fabric, *chunks))

    def open(self) -> None:
        """Join. Raises FabricError if there is no router, or its port is taken."""
        check_files(SESSION)
        self._say_threads()
        self._zenoh = self._serve(self.link.users) if self.link.users else self._join()
        self._pid = os.getpid()

    def _say_threads(self) -> None:
        # Read once, at the first. What was ours in who started this process is not
        # the user's own choice.
        if os.environ.get("ZENOH_RUNTIME") in (None, _THREADS, _SHARED):
            os.environ["ZENOH_RUNTIME"] = _SHARED if self.link.behind else _THREADS

    def _serve(self, users: Users) -> zenoh.Session:
        from rems_net.router.gate.users import dictionary

        with dictionary(users) as file:
            return self._join(file)

    def _join(self, users: str = "") -> zenoh.Session:
        link = self.link
        while True:
            try:
                return zenoh.open(zenoh.Config.from_json5(link.to_wire(users)))
            except zenoh.ZError as error:
                # Here: each process of a run joins, and hardly one is refused.
                from rems_net.router.gate.refusal import cannot_open, is_far

                if link.serve or link.timeout >= LONG or not is_far(link.endpoint):
                    raise cannot_open(link, error) from None
            # Some messages go to and fro: where a network loses one, in a moment more.
            link = replace(link, timeout=LONG)

    def open_once(self) -> bool:
        """Join, and say whether it did, after `link.timeout`; nobody asks why not."""
        self._say_threads()
        try:
            self._zenoh = zenoh.open(zenoh.Config.from_json5(self.link.to_wire()))
        except zenoh.ZError:
            return False
        self._pid = os.getpid()
        return True

    def close(self) -> None:
        """Leave. Everything declared is gone with it; calling it twice is fine."""
        session: Any = self._zenoh  # zenoh's stub leaves `close` untyped
        self._zenoh = None
        self._keep.clear()
        if session is not None and os.getpid() == self._pid:
            # Where the network is cut there is nobody to take leave of; after 10 s
            # Zenoh says that it could not, and has closed all the same.
            with suppress(zenoh.ZError):
                session.close()

    @property
    def _open(self) -> zenoh.Session:
        if self._zenoh is None:
            raise FabricError("This session is closed; open it with `with` first.")
        if os.getpid() != self._pid:
            raise FabricError(
                "This session was opened before a fork, and Zenoh does not survive "
                "one; start processes by multiprocessing's 'spawn'."
            )
        return self._zenoh

    @property
    def connected(self) -> bool:
        """Whether the router is there now; after a loss a client comes back itself."""
        return self.link.serve or bool(list(self._open.info.routers_zid()))

    def publisher(
        self, key: str, schema: str = "", *, block: bool = True, remote: bool = False
    ) -> Publisher:
        """Declare what puts values at `key`.

        block: for what must not be lost and is small (lock-step, commands, stop);
        False drops under pressure (everything free-running).
        remote: only other sessions get it. All on one priority, so that a session's
        messages stay in the order in which it sent them.
        """
        return Publisher(self._declared(key, schema, block, remote))

    def putting(
        self, key: str, schema: str = "", *, block: bool = True, remote: bool = False
    ) -> Callable[..., None]:
        """A publisher's `put_raw`, where nobody asks whether it is watched."""
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

    def put(self, key: str, payload: bytes, schema: str = "") -> None:
        """Put one value once, reliably."""
        self._open.put(
            key,
            payload,
            encoding=encoding(schema),
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
        """Call `function(mail)` in a thread of its own, whatever this process does.

        origin: `own` for what this session puts, `others` for what other sessions put.

        It must be short, and safe beside the main thread. Not in Zenoh's: that would
        wait for the GIL at every message, and in a flood so would all others.
        """

        def call(sample: zenoh.Sample) -> None:
            function(Mail(sample))

        take = zenoh.handlers.Callback(call, indirect=True)
        declare, from_ = self._open.declare_subscriber, _ORIGINS[origin]
        return Watch(declare(key, take, allowed_origin=from_), self._keep)

    def answer(self, key: str, mailbox: Mailbox, topic: str = "") -> Watch:
        """File every question for `key` in `mailbox`, as a `Question` on `topic`."""

        def file(query: zenoh.Query) -> None:
            mailbox.put(Question(query, topic))

        take = zenoh.handlers.Callback(file, indirect=False)
        return Watch(self._open.declare_queryable(key, take), self._keep)

    def answer_at_once(
        self,
        key: str,
        function: Callable[[Question], None],
        topic: str = "",
        *,
        apart: bool = False,
    ) -> Watch:
        """Let `function(question)` answer in Zenoh's own thread, whoever reads no mail.

        It must be safe beside the main thread, and short; unless it is `apart`, in a
        thread of its own, where it may wait a little.
        """

        def reply(query: zenoh.Query) -> None:
            with Question(query, topic) as question:
                function(question)

        take = zenoh.handlers.Callback(reply, indirect=apart)
        return Watch(self._open.declare_queryable(key, take), self._keep)

    def asking(
        self,
        selector: str,
        payload: bytes | None = None,
        timeout: float = 2.0,
        told: Callable[[Asking], None] | None = None,
    ) -> Asking:
        """Ask for a key, and take the answers as they come; `told` that some came."""
        return Asking(self._open, selector, payload, timeout, told)

    def ask(
        self,
        selector: str,
        payload: bytes | None = None,
        timeout: float = 2.0,
        *,
        first: bool = False,
    ) -> list[Mail]:
        """Ask for a key; one Mail per answer.

        first: the first answer is enough, whoever else keeps the question open: for a
        key with one owner.
        No answer is an empty list, and does not mean that nobody is there: right
        after a reconnect Zenoh may find nobody for some milliseconds. Raises
        FabricError with the answerer's own sentence when nobody does but refuse.
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
                    if first:  # anybody can refuse; the owner may only be slower
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

        A mailbox's `put` will do for it.
        """

        def file(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                function(Mail(reply.ok))

        self._open.get(
            selector,
            zenoh.handlers.Callback(file, indirect=False),
            # Else one that says it has everything (`complete`) is asked, and no other.
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=timeout,
            payload=payload,
        )

    def present(self, key: str) -> Watch:
        """Be seen at `key` until it or the session closes, or this process dies."""
        return Watch(self._open.liveliness().declare_token(key), self._keep)

    def who(self, key: str, timeout: float = 2.0) -> list[str]:
        """The keys of those present now."""
        replies = self._open.liveliness().get(key, timeout=timeout)
        return sorted(str(r.ok.key_expr) for r in replies if r.ok is not None)

    def watch_presence(self, key: str, mailbox: Mailbox) -> Watch:
        """File a `Presence` for who is here, comes and goes."""

        def file(sample: zenoh.Sample) -> None:
            alive = sample.kind == zenoh.SampleKind.PUT
            mailbox.put(Presence(str(sample.key_expr), alive))

        take = zenoh.handlers.Callback(file, indirect=False)
        declare = self._open.liveliness().declare_subscriber
        return Watch(declare(key, take, history=True), self._keep)
