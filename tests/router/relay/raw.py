"""A client that speaks as much of Zenoh's handshake as we want it to."""

import hmac
import os
import socket
from typing import Self

from rems_net.router.relay.handshake import CLOSE, challenge, framed

#: modes on the wire
ROUTER, PEER, CLIENT = 0, 1, 2
#: s in which a router answers
ANSWER_TIMEOUT = 5.0


def number(value: int) -> bytes:
    """In groups of seven bits, the least first."""
    groups = bytearray()
    while value > 0x7F:
        groups.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes((*groups, value))


def block(data: bytes) -> bytes:
    return number(len(data)) + data


def init_syn(zid: bytes, mode: int = CLIENT, *, password: bool = False) -> bytes:
    head = bytes((0x81 if password else 0x01, 9, len(zid) - 1 << 4 | mode)) + zid
    return head + (b"\x43" + block(b"\x02") if password else b"")


def open_syn(cookie: bytes, user: str = "", digest: bytes = b"") -> bytes:
    """With a lease of 100 s: what has joined stays, though it says nothing."""
    proof = b"\x42" + block(block(user.encode()) + block(digest))
    head = bytes((0xC2 if user else 0x42, 100, 0)) + block(cookie)
    return head + (b"\x43" + block(proof) if user else b"")


class Raw:
    """A connection; `host` is the address that it comes from."""

    def __init__(self, port: int, zid: bytes = b"", host: str = "127.0.0.1"):
        self.zid = zid or os.urandom(16)
        self.socket = socket.create_connection(
            ("127.0.0.1", port), ANSWER_TIMEOUT, source_address=(host, 0)
        )
        self.socket.settimeout(ANSWER_TIMEOUT)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def send(self, batch: bytes) -> None:
        self.socket.sendall(framed(batch))

    def read(self) -> bytes:
        """A batch; nothing if the connection has ended."""
        try:
            with self.socket.makefile("rb") as stream:
                return stream.read(int.from_bytes(stream.read(2), "little"))
        except ConnectionError:
            return b""

    @property
    def closed(self) -> bool:
        """Whether the router has hung up; what it has sent before is thrown away."""
        try:
            while self.read():
                pass
        except TimeoutError:
            return False
        return True

    def join(self, user: str = "", password: str = "", mode: int = CLIENT) -> int:
        """Be let in: -1; else the reason that the router gives, 99 for none."""
        self.send(init_syn(self.zid, mode, password=bool(user)))
        answer = self.read()
        if not answer or answer[0] & 0x1F == CLOSE:
            return answer[1] if answer else 99
        digest, secret = b"", challenge(answer)
        if secret is not None:
            key = secret.to_bytes(8, "little")
            digest = hmac.digest(key, password.encode(), "sha3_256")
        at = 3 + 1 + (answer[2] >> 4) + (3 if answer[0] & 0x40 else 0)
        cookie = answer[at + 1 : at + 1 + answer[at]]
        self.send(open_syn(cookie, user, digest))
        answer = self.read()
        if not answer or answer[0] & 0x1F == CLOSE:
            return answer[1] if answer else 99
        return -1
