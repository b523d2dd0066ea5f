"""Probe of a port: a Zenoh router, another program, or one that never answers."""

import socket
from contextlib import suppress

from rems_net.router.asking import printable
from rems_net.router.finding.address import host_and_port
from rems_net.router.relay.handshake import EXPIRED, TAKEN, TOO_MANY

#: s. Time to wait for an answer; a bad network may lose and repeat one.
ANSWER_TIMEOUT = 3.0
#: bytes of an answer that are read; a router's answer has about 80
MOST = 4096
#: first message of a Zenoh client (InitSyn, protocol 9), behind its length in two bytes
_ZENOH = bytes.fromhex(
    "1f00 c109f20cdf517a8562d8af0929a68d5838616c0ac8ff81c2049294ab022701"
)
#: its Zenoh id: a gate that has just refused this laptop answers with the reason
PROBE = _ZENOH[5:21]
#: reasons in a gate's Close
_REFUSED = {
    TOO_MANY: "has no room for another session of this user, or of this laptop's "
    "address: end programs that you do not need, then try again",
    EXPIRED: "has had too many wrong passwords from this laptop's address: wait a "
    "moment, then type the name and the password with care",
    TAKEN: "knows this program's Zenoh id as another user's: start the program again",
}
#: a router's answers: it continues or, with users, closes
_INIT, _CLOSE = 0x01, 0x03
_WEB = b"GET / HTTP/1.0\r\n\r\n"


def stranger(endpoint: str) -> str:
    """Return which program has the port, or why its router has refused this laptop.

    Return "" for a router that has given no reason, or if it is unknown.
    """
    if not endpoint.startswith("tcp/"):
        return ""
    said = _say(endpoint, _ZENOH)
    if said is not None and _is_zenoh(said):
        refused = _REFUSED.get(said[3]) if said[2] & 0x1F == _CLOSE else None
        return f"{endpoint} {refused}" if refused else ""
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
        return f"{endpoint} is another program, and no router: it answers {first!r}"
    return (
        f"{endpoint} takes connections and answers nothing: a VPN or a proxy in "
        "between takes them in the router's place (turn it off), the router is frozen "
        "or has more connections than it takes, or it is another program: mind the "
        "port (7447). Where `rems router serve` runs, s and Enter stop all robots"
    )


def _is_zenoh(said: bytes) -> bool:
    if len(said) < 4 or len(said) - 2 != said[0] + 256 * said[1]:
        return False
    return said[2] & 0x1F in (_INIT, _CLOSE)


def _say(endpoint: str, words: bytes) -> bytes | None:
    """Return the answer to `words`; b"" for silence, None without a connection."""
    try:
        with socket.create_connection(host_and_port(endpoint), ANSWER_TIMEOUT) as line:
            line.settimeout(ANSWER_TIMEOUT)
            with suppress(OSError):  # it may close at once, or never answer
                line.sendall(words)
                return line.recv(MOST)
            return b""
    except OSError:
        return None
