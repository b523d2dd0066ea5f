"""Handshake: the four messages by which a Zenoh client joins, as far as we read them.

A transport batch is a length of two bytes, low byte first, and so many bytes. The
client sends InitSyn (its id and its mode), the router InitAck (a random number), the
client OpenSyn (its user, and a digest of password and number), the router OpenAck. The
router may answer with Close instead.

Source: Zenoh's protocol 9, commons/zenoh-protocol/src/transport of zenoh 1.10.
"""

import hmac
from typing import NamedTuple

from rems_net.router.gate import wire
from rems_net.router.gate.wire import BYTES, ENCODING, EXTENDED, NUMBER

#: bytes of a batch's length, which is at most 65,535
PREFIX = 2
#: bytes of the longest message of a handshake; Zenoh's own have at most some 400
MOST = 4096
#: the version of the protocol
VERSION = 9
#: modes by their number on the wire
MODES = ("router", "peer", "client")

INIT, OPEN, CLOSE = 0x01, 0x02, 0x03
_ID, _ACK, _SIZES = 0x1F, 0x20, 0x40
#: headers of extensions: proofs; inside it, for passwords, number and digest
_PROOFS, _CHALLENGE, _DIGEST = 0x43, 0x22, 0x42
#: header of the extension with the version of fragments
_PATCH = 0x27
#: reasons of a Close that our clients understand: see router/gate/probe.py
UNSUPPORTED, INVALID, TOO_MANY, EXPIRED, TAKEN = 0x01, 0x02, 0x03, 0x05, 0x07


class HandshakeError(ValueError):
    """Bytes that are not the expected message."""


class Hello(NamedTuple):
    """An InitSyn: a client's id and mode (`client`, `peer` or `router`).

    marks: whether it marks the first fragment of a message
    """

    zid: bytes
    mode: str
    marks: bool


class Login(NamedTuple):
    """The user of an OpenSyn, and the digest that proves the password."""

    user: str
    digest: bytes


class _Bytes:
    """Reader of a message, from its front."""

    def __init__(self, data: bytes):
        self._data, self._at = data, 0

    def take(self, count: int) -> bytes:
        end = self._at + count
        if end > len(self._data):
            raise HandshakeError("it ends too early")
        taken, self._at = self._data[self._at : end], end
        return taken

    def byte(self) -> int:
        return self.take(1)[0]

    def number(self) -> int:
        try:
            value, self._at = wire.number(self._data, self._at)
        except IndexError:
            raise HandshakeError("it ends too early") from None
        return value

    def block(self) -> bytes:
        """Read bytes behind their count."""
        return self.take(self.number())

    def extensions(self, header: int = EXTENDED) -> dict[int, int | bytes]:
        """Read the values of the extensions that the flag in a header announces.

        Raises HandshakeError if one stands twice: Zenoh might use another of them than
        we do.
        """
        found: dict[int, int | bytes] = {}
        while header & EXTENDED:
            header = self.byte()
            encoding = header & ENCODING
            value: int | bytes = b""
            if encoding == NUMBER:
                value = self.number()
            elif encoding == BYTES:
                value = self.block()
            elif encoding:
                raise HandshakeError("an extension has an unknown encoding")
            if found.setdefault(header & ~EXTENDED, value) is not value:
                raise HandshakeError("an extension stands twice")
        return found

    def end(self) -> None:
        """Raise HandshakeError if anything is left."""
        if self._at != len(self._data):
            raise HandshakeError("there is something behind its end")


def hello(batch: bytes) -> Hello:
    """Read an InitSyn. Raises HandshakeError if it is malformed or too long."""
    data = _Bytes(batch)
    header = data.byte()
    if header & (_ID | _ACK) != INIT or data.byte() != VERSION:
        raise HandshakeError("no InitSyn of protocol 9")
    flags = data.byte()
    if flags & 3 == 3:
        raise HandshakeError("an unknown mode")
    zid = data.take(1 + (flags >> 4))
    if header & _SIZES:
        data.take(3)
    patch = data.extensions(header).get(_PATCH, 0)
    data.end()
    if not any(zid):
        raise HandshakeError("an id of zeros")
    marks = isinstance(patch, int) and patch & 0xFF > 0  # Zenoh reads one byte of it
    return Hello(zid.rstrip(b"\0"), MODES[flags & 3], marks)


def challenge(batch: bytes) -> int | None:
    """Read the number of an InitAck for the password's digest; None without one."""
    data = _Bytes(batch)
    header = data.byte()
    data.byte()
    data.take(1 + (data.byte() >> 4))
    if header & _SIZES:
        data.take(3)
    data.block()
    value = _proof(data, header).get(_CHALLENGE)
    return value if isinstance(value, int) else None


def login(batch: bytes) -> Login | None:
    """Read the user of an OpenSyn; None for one without. Raises HandshakeError."""
    data = _Bytes(batch)
    header = data.byte()
    if header & (_ID | _ACK) != OPEN:
        raise HandshakeError("no OpenSyn")
    data.number()
    data.number()
    data.block()
    proof = _proof(data, header)
    data.end()
    value = proof.get(_DIGEST)
    if len(proof) != 1 or not isinstance(value, bytes):
        return None
    inner = _Bytes(value)
    found = Login(inner.block().decode(errors="replace"), inner.block())
    inner.end()
    return found


def _proof(data: _Bytes, header: int) -> dict[int, int | bytes]:
    """Return the extensions inside the one for proofs."""
    proofs = data.extensions(header).get(_PROOFS)
    return _Bytes(proofs).extensions() if isinstance(proofs, bytes) and proofs else {}


def proves(login: Login, password: str, number: int) -> bool:
    """Return whether the digest was made with this password, for this number."""
    key = number.to_bytes(8, "little")
    made = hmac.digest(key, password.encode(), "sha3_256")
    return hmac.compare_digest(made, login.digest)


def acks(batch: bytes, kind: int) -> bool:
    """Return whether the router goes on after InitSyn (INIT), or OpenSyn (OPEN)."""
    return bool(batch) and batch[0] & (_ID | _ACK) == kind | _ACK


def framed(batch: bytes) -> bytes:
    """Return the batch behind its length."""
    return len(batch).to_bytes(PREFIX, "little") + batch


def close(reason: int) -> bytes:
    """Return the batch of a Close that refuses a client for this reason."""
    return framed(bytes((CLOSE, reason)))
