"""Connection: one client of a shared router, from its first byte to its last."""

import socket
from contextlib import suppress
from typing import TYPE_CHECKING

from rems_net.router.gate.frames import Reader
from rems_net.router.relay import handshake
from rems_net.router.relay.end import End
from rems_net.router.relay.handshake import MOST, PREFIX, HandshakeError

if TYPE_CHECKING:
    from rems_net.router.relay.gate import Gate

#: s. Zenoh needs a moment to forget a session after its connection has ended.
MOMENT = 0.05


class Connection:
    """Connection of a client's socket and ours to Zenoh: passes bytes between them.

    Until Zenoh has let the client in, each message is read and must come in its order.
    After that, bytes from Zenoh are passed on unread; bytes from the client are passed
    on in whole batches, checked by a Reader.
    """

    def __init__(self, gate: "Gate", client: End, host: str, ours: bool):
        #: ours: the client is on the router's machine
        self.gate, self.client, self.host, self.ours = gate, client, host, ours
        self.router: End | None = None
        self.zid = b""
        #: owner of the id: a user, or an address; "" until proved
        self.owner = ""
        self.let_in = self.ending = False
        self._challenge: int | None = None
        self._step = self._hello
        self._rest = b""
        self._answers = b""
        client.owner = self
        client.took, client.closed, client.sent = self._take, self.end, self._resume
        client.read(True)

    def _take(self, data: memoryview) -> None:
        """Pass whole batches on, and keep the incomplete rest."""
        whole = memoryview(self._rest + data) if self._rest else data
        at = 0
        size = len(whole)
        while size - at >= PREFIX:
            end = at + PREFIX + whole[at] + 256 * whole[at + 1]
            if not self.let_in and end - at > MOST:
                raise HandshakeError("a handshake is not that long")
            if end > size:
                break
            self._step(whole[at + PREFIX : end])
            if self.ending:
                return
            at = end
        if at and self.let_in and self.router is not None:
            gone = self.router.send(whole[:at])
            if not gone:
                self.client.read(False)
        self._rest = bytes(whole[at:])

    def _hello(self, batch: memoryview) -> None:
        """Read InitSyn: from now on Zenoh sees the connection."""
        hello = handshake.hello(bytes(batch))
        self.zid, self._reader = hello.zid, Reader(marks=hello.marks)
        if self.gate.admission.refuses(self, hello):
            return
        sock = socket.socket()
        self.router = router = End(sock, self.gate.selector, self.gate.buffer)
        router.owner = self
        router.took, router.closed = self._answer, self._router_ended
        router.sent = self._connected
        self.gate.shape(sock)
        with suppress(BlockingIOError):
            sock.connect(self.gate.inner)
        router.wait_to_send(handshake.framed(bytes(batch)))
        self.client.read(False)
        self._step = self._too_early

    def _connected(self) -> None:
        assert self.router is not None
        self.router.sent = self._resume_router
        self.router.read(True)

    def _too_early(self, batch: memoryview) -> None:
        raise HandshakeError("a client waits for the answer")

    def _login(self, batch: memoryview) -> None:
        """Read OpenSyn: it proves the user."""
        message = bytes(batch)
        owner = self.gate.admission.owner(
            self, handshake.login(message), self._challenge
        )
        if not owner:
            return
        self.client.read(False)
        self._step = self._too_early
        self.gate.admission.claim(self, owner, lambda: self._go_on(message))

    def _go_on(self, message: bytes) -> None:
        if self.router is not None and not self.ending:
            self.router.send(handshake.framed(message))

    def _check(self, batch: memoryview) -> None:
        """Check a batch of a client that is let in."""
        if why := self._reader.feed(batch):
            self.gate.unfit(self, why)
            return
        stops = self._reader.known.stops
        while stops:
            self.gate.people.stopped(self, stops.pop())

    @property
    def has_closed(self) -> bool:
        """Whether the client has sent a Close."""
        return self._reader.has_closed

    @property
    def tokens(self) -> list[str]:
        """Keys of the client's liveliness tokens."""
        return list(self._reader.known.tokens.values())

    def _resume_router(self) -> None:
        """Continue when all bytes from the client have gone to Zenoh."""
        if self.ending:
            assert self.router is not None
            self.router.finish()
        else:
            self.client.read(True)

    def _answer(self, data: memoryview) -> None:
        """Read Zenoh's side of the handshake; then pass all on unread."""
        answers = self._answers + data
        while not self.let_in and len(answers) >= PREFIX:
            end = PREFIX + answers[0] + 256 * answers[1]
            if end > len(answers):
                break
            batch, answers = answers[PREFIX:end], answers[end:]
            if handshake.acks(batch, handshake.INIT):
                self._challenge = handshake.challenge(batch)
                self._step = self._login
            elif handshake.acks(batch, handshake.OPEN):
                self._let_in()
            self._to_client(handshake.framed(batch))
            if not self.client.pending:
                self.client.read(True)
        self._answers = b"" if self.let_in else answers
        if self.let_in and answers:
            self._to_client(answers)

    def _let_in(self) -> None:
        assert self.router is not None
        self.let_in = True
        self._step = self._check
        self.router.took = self._to_client
        self.gate.let_in(self)

    def _to_client(self, data: bytes | memoryview) -> None:
        if not self.client.send(data) and self.router is not None:
            self.router.read(False)

    def _resume(self) -> None:
        """Continue when all bytes from Zenoh have gone to the client."""
        if self.ending:
            self.drop()
        elif self.router is not None:
            self.router.read(True)
            if self._step != self._too_early and not self.router.pending:
                self.client.read(True)

    def refuse(self, reason: int) -> None:
        """Close with a reason that the client can read."""
        self.client.send(handshake.close(reason))
        self.drop()

    def end(self) -> None:
        """End after the client has gone: Zenoh gets its last bytes, then the end."""
        if self.router is None or not self.let_in:
            self.drop()
            return
        if self.ending:
            return
        self.ending = True
        self.client.close()
        self.router.took = lambda data: None  # the client is gone
        self.router.read(True)
        if not self.router.pending:
            self.router.finish()
        self.gate.drop_later(self)

    def _router_ended(self) -> None:
        """End after Zenoh has closed: the client gets its last bytes."""
        if self.client.pending and not self.ending:
            self.ending = True
            self.client.read(False)
            assert self.router is not None
            self.router.close()
            self.gate.drop_later(self)
        else:
            self.drop()

    def drop(self, *, at_once: bool = False) -> None:
        """Close both sockets; a second call does nothing."""
        self.ending = True
        self.client.close(at_once=at_once)
        if self.router is not None:
            # Otherwise each handshake would occupy a port of ours for a minute.
            self.router.close(at_once=not self.let_in)
        self.gate.gone(self)
