"""The firmware's protocol, called from Python: mirrors of its structs."""

from ctypes import (
    CDLL,
    POINTER,
    Structure,
    byref,
    c_bool,
    c_char,
    c_char_p,
    c_double,
    c_size_t,
    c_uint64,
    c_void_p,
    cast,
    create_string_buffer,
    string_at,
)
from pathlib import Path
from typing import Any

from tests.firmware.compiling import CORE, library


class Bytes(Structure):
    _fields_ = (("at", c_void_p), ("size", c_size_t))


class Text(Structure):
    _fields_ = (("at", c_char_p), ("room", c_size_t), ("size", c_size_t))


class Message(Structure):
    """One that compares with what Python reads."""

    def words(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name, *_ in self._fields_}


class Beat(Message):
    _fields_ = (
        *((name, c_uint64) for name in ("run", "n", "epoch", "stops")),
        *((name, c_double) for name in ("t", "dt", "pace")),
    )


class Stamp(Message):
    _fields_ = (
        *((name, c_uint64) for name in ("n", "badge", "said")),
        ("t", c_double),
    )


class Admission(Message):
    _fields_ = (
        *((name, c_uint64) for name in ("badge", "first", "stops")),
        *((name, c_double) for name in ("dt", "patience")),
    )


class Age(Message):
    _fields_ = (("run", c_uint64), ("stops", c_uint64), ("seconds", c_double))


class Claim(Message):
    _fields_ = (("badge", c_uint64), ("holder", c_char * 101))


class Request(Structure):
    _fields_ = (
        ("agent", c_char_p),
        ("identity", c_uint64),
        ("source", c_char_p),
        ("stopped", c_bool),
    )


READERS: dict[str, type[Message]] = {
    "beat": Beat,
    "stamp": Stamp,
    "admission": Admission,
    "age": Age,
    "claim": Claim,
}
ROOM = 4096


class Core:
    """The library. `read` and `written` are its functions by name."""

    def __init__(self, made: Path):
        sources = sorted((CORE / "wire").glob("*.c"))
        sources += [CORE / "fabric" / "guard.c", CORE / "woodbot_schemas.c"]
        self.c = CDLL(str(library(sources, made)))
        for name in (
            "stop",
            "stamp",
            "done",
            "badge",
            "request",
            "schemas",
            "farewell",
        ):
            getattr(self.c, f"{name}_write").restype = Bytes
        for name in (*READERS, "stop", "newest", "call"):
            getattr(self.c, f"{name}_read").restype = c_bool
        for name in ("key_covers", "key_asks"):
            getattr(self.c, name).restype = c_bool
        self.c.text_in.restype = Text
        self.c.text_real.argtypes = (POINTER(Text), c_double)

    def read(self, name: str, payload: bytes) -> Message | None:
        """What the core reads; None where it refuses."""
        found = READERS[name]()
        taken = getattr(self.c, f"{name}_read")(given(payload), byref(found))
        return found if taken else None

    def takes(self, name: str, payload: bytes) -> bool:
        return bool(getattr(self.c, name)(given(payload)))

    def newest(self, payload: bytes) -> int | None:
        n = c_uint64()
        taken = self.c.newest_read(given(payload), byref(n))
        return n.value if taken else None

    def written(self, name: str, *words: Any, room: int = ROOM) -> bytes:
        """What the core writes into `room` bytes, and not one more."""
        memory = create_string_buffer(b"\xa5" * (room + 8), room + 8)
        made = getattr(self.c, f"{name}_write")(memory, *words)
        assert memory.raw[room:] == b"\xa5" * 8
        return string_at(made.at, made.size)

    def real(self, number: float) -> str:
        memory = create_string_buffer(64)
        text = self.c.text_in(memory, c_size_t(64))
        self.c.text_real(byref(text), number)
        return memory.value.decode()

    def covers(self, glob: str, key: str) -> bool:
        return bool(self.c.key_covers(glob.encode(), key.encode()))


def given(payload: bytes) -> Bytes:
    """As a C program is given it, without a byte behind it."""
    held = create_string_buffer(payload, len(payload)) if payload else None
    made = Bytes(cast(held, c_void_p) if held else None, len(payload))
    made.held = held
    return made
