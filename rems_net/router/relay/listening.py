"""Listening: the public port of a shared router."""

import errno
import socket
from collections.abc import Callable
from selectors import EVENT_READ, BaseSelector

from rems_net.errors import FabricError
from rems_net.router.finding.address import host_and_port
from rems_net.router.gate.refusal import cannot_open
from rems_net.router.settings import Link

#: connections that the system keeps until they are accepted: a class arrives at once
BACKLOG = 4096
#: connections accepted at a time, before the existing ones are served
AT_ONCE = 64
_NO_ROOM = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)


class Listener:
    """Listener: calls `take` with a socket, its address, and whether that is local."""

    def __init__(self, endpoint: str, take: Callable[[socket.socket, str, bool], None]):
        """Open the port. Raises FabricError."""
        self._take = take
        self.owner = None
        self._selector: BaseSelector | None = None
        address = _address(endpoint)
        try:
            self._socket = _listening(*address)
        except OSError as error:
            raise cannot_open(Link(endpoint, serve=True), error) from None
        self._socket.setblocking(False)

    def listen(self, selector: BaseSelector) -> None:
        """Accept connections from now on; a second call does nothing."""
        if self._selector is None:
            self._selector = selector
            self._socket.listen(BACKLOG)
            selector.register(self._socket, EVENT_READ, self)

    def pause(self) -> None:
        """Let new connections wait, until `listen`."""
        if self._selector is not None:
            self._selector.unregister(self._socket)
            self._selector = None

    def ready(self, _: int) -> None:
        """Accept waiting connections. Raises OSError if there is no room for more."""
        for _ in range(AT_ONCE):
            try:
                sock, address = self._socket.accept()
            except BlockingIOError:
                return
            except OSError as error:
                if error.errno in _NO_ROOM:
                    raise
                continue  # it has gone already
            try:
                mine = sock.getsockname()[0]
            except OSError:
                sock.close()
                continue
            self._take(sock, address[0], address[0] == mine)

    def close(self) -> None:
        """Accept no more; a second call does nothing."""
        self._socket.close()


def _address(endpoint: str) -> tuple[str, int]:
    protocol = endpoint.partition("/")[0]
    if protocol != "tcp" or any(mark in endpoint for mark in "#?"):
        raise FabricError(
            f"A router for others can't listen at {endpoint}; expected an endpoint "
            "such as tcp/0.0.0.0:7447, with an address of this machine. (R0613)"
        )
    return host_and_port(endpoint)


def _listening(host: str, port: int) -> socket.socket:
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    family, _, _, _, address = min(found, key=lambda one: one[0] != socket.AF_INET)
    both = host == "::" and socket.has_dualstack_ipv6()
    return socket.create_server(
        address[:2], family=family, backlog=1, dualstack_ipv6=both
    )
