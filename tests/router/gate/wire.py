"""A relay between Zenoh's sessions and a router that keeps what the clients send."""

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

HANDSHAKE = (0x01, 0x02)

Judge = Callable[[], Callable[[bytes], str | None]]


class Wire:
    """Relay of one listening port; each client's batches stand in a list of its own."""

    def __init__(self, router: int, judge: Judge, spoil: Callable[[bytes], bytes]):
        self.sent: list[list[bytes]] = []
        self.refused: list[str] = []
        self._router, self._judge, self._spoil = router, judge, spoil
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listening.getsockname()[1]
        self._open: list[socket.socket] = []
        threading.Thread(target=self._accept, daemon=True).start()

    @property
    def endpoint(self) -> str:
        return f"tcp/127.0.0.1:{self.port}"

    def close(self) -> None:
        for one in (self._listening, *self._open):
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                client, _ = self._listening.accept()
                router = socket.create_connection(("127.0.0.1", self._router))
                for one in (client, router):
                    one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._open += [client, router]
                up = (self._up, (client, router))
                for target, args in (up, (self._down, (router, client))):
                    threading.Thread(target=target, args=args, daemon=True).start()

    def _up(self, client: socket.socket, router: socket.socket) -> None:
        batches: list[bytes] = []
        self.sent.append(batches)
        judge = self._judge()
        with suppress(OSError), client.makefile("rb") as stream:
            while len(size := stream.read(2)) == 2:
                batch = stream.read(int.from_bytes(size, "little"))
                if batch[0] & 0x1F not in HANDSHAKE:
                    batch = self._spoil(batch)
                    batches.append(batch)
                    if why := judge(batch):
                        self.refused.append(why)
                        break
                router.sendall(len(batch).to_bytes(2, "little") + batch)
        self._end(client, router)

    def _down(self, router: socket.socket, client: socket.socket) -> None:
        with suppress(OSError):
            while data := router.recv(65536):
                client.sendall(data)
        self._end(client, router)

    @staticmethod
    def _end(*ends: socket.socket) -> None:
        for one in ends:
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()


@contextmanager
def wire(
    router: int, judge: Judge, spoil: Callable[[bytes], bytes] = bytes
) -> Iterator[Wire]:
    """Yield a relay in front of the router at this port of this machine.

    judge: makes what refuses batches of one client.  spoil: changes a batch before.
    """
    relay = Wire(router, judge, spoil)
    try:
        yield relay
    finally:
        relay.close()
