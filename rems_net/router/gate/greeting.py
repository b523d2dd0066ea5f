"""Greeting: who has a port: a Zenoh router, another program, or nobody who speaks."""

from __future__ import annotations

import socket
from contextlib import suppress

from rems_net.router.asking import printable
from rems_net.router.finding.address import host_and_port

#: seconds to wait for an answer; one may be lost on a bad network, and said again
PATIENCE = 3.0
#: bytes of an answer that are read; a router's has about 80
MOST = 4096
#: how a Zenoh client begins (InitSyn, protocol 9): its length in two bytes, the message
_ZENOH = bytes.fromhex(
    "1f00 c109f20cdf517a8562d8af0929a68d5838616c0ac8ff81c2049294ab022701"
)
#: what a router answers: that it goes on, or, where it has users, that it closes
_INIT, _CLOSE = 0x01, 0x03
_WEB = b"GET / HTTP/1.0\r\n\r\n"


def stranger(endpoint: str) -> str:
    """Who else has the port; nothing where that is a router, or can't be told."""
    if not endpoint.startswith("tcp/"):
        return ""
    said = _say(endpoint, _ZENOH)
    if _is_zenoh(said):
        return ""
    answer = _say(endpoint, _WEB)
    if said is None or answer is None:
        return ""
    if answer.startswith(b"HTTP/"):
        return (
            f"{endpoint} is a web server, and no router: mind the port (7447); or this "
            "network wants you to sign in first: open a web page"
        )
    if said := said or answer:
        first = printable(said.decode(errors="replace").splitlines()[0])[:40]
        return f"{endpoint} is another program, and no router: it says {first!r}"
    return (
        f"{endpoint} takes connections and says nothing: a VPN or a proxy in between "
        "takes them in the router's place (turn it off), the router is frozen, or it "
        "is another program: mind the port (7447)"
    )


def _is_zenoh(said: bytes | None) -> bool:
    if said is None or len(said) < 3 or len(said) - 2 != said[0] + 256 * said[1]:
        return False
    return said[2] & 0x1F in (_INIT, _CLOSE)


def _say(endpoint: str, words: bytes) -> bytes | None:
    """What is answered; b"" for silence, None without a connection."""
    try:
        with socket.create_connection(host_and_port(endpoint), PATIENCE) as line:
            line.settimeout(PATIENCE)
            with suppress(OSError):  # it may hang up at once, or never answer
                line.sendall(words)
                return line.recv(MOST)
            return b""
    except OSError:
        return None
