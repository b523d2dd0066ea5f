"""Scouts: clients that look for a router by multicast get its public endpoint.

Zenoh's own answer would name the port behind the gate. A network without multicast
does not matter: nothing else depends on this.
"""

import socket
from contextlib import suppress
from selectors import EVENT_READ, BaseSelector

from rems_net.router.finding.address import host_and_port, is_ipv4
from rems_net.router.finding.interfaces import reachable, source
from rems_net.router.relay.handshake import VERSION

#: multicast address at which Zenoh's clients look for routers
GROUP, PORT = "224.0.0.224", 7446
#: addresses that mean all networks of this machine
EVERYWHERE = ("0.0.0.0", "::")
#: bytes of a question that are read; a valid one has at most 19
MOST = 64
_SCOUT, _HELLO, _LOCATORS, _ID, _ROUTERS = 0x01, 0x02, 0x20, 0x1F, 0x01


class Scouts:
    """Responder to clients that look for a router."""

    def __init__(self, endpoint: str, zid: str):
        """endpoint: of the router; zid: its Zenoh id, in hexadecimal digits."""
        self._host, self._port = host_and_port(endpoint)
        self._zid = int(zid, 16).to_bytes(16, "little").rstrip(b"\0")
        self.owner = None
        self._socket: socket.socket | None = None

    def listen(self, selector: BaseSelector) -> None:
        """Answer from now on, on every network that lets multicast through."""
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if hasattr(socket, "SO_REUSEPORT"):  # macOS requires it
                with suppress(OSError):
                    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
            sock.bind(("", PORT))
        except OSError:
            sock.close()
            return
        for address in reachable():
            place = socket.inet_aton(GROUP) + socket.inet_aton(address)
            with suppress(OSError):
                sock.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, place)
        sock.setblocking(False)
        self._socket = sock
        selector.register(sock, EVENT_READ, self)

    def ready(self, _: int) -> None:
        """Answer one question."""
        with suppress(OSError):
            assert self._socket is not None
            question, (host, port) = self._socket.recvfrom(MOST)
            if _asks_for_routers(question) and (answer := self.answer(host)):
                self._socket.sendto(answer, (host, port))

    def close(self) -> None:
        """Stop answering; a second call does nothing."""
        if self._socket is not None:
            self._socket.close()

    def answer(self, asker: str) -> bytes:
        """Return a Hello with our address on the route to `asker`; b"" without one."""
        host = source(asker) if self._host in EVERYWHERE else self._host
        if not is_ipv4(host):
            return b""
        endpoint = f"tcp/{host}:{self._port}".encode()
        head = bytes((_HELLO | _LOCATORS, VERSION, len(self._zid) - 1 << 4))
        return head + self._zid + bytes((1, len(endpoint))) + endpoint


def _asks_for_routers(question: bytes) -> bool:
    return (
        len(question) >= 3
        and question[0] & _ID == _SCOUT
        and question[1] == VERSION
        and bool(question[2] & _ROUTERS)
    )
