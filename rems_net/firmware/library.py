"""Library: the Woodbot's core, called from Python, with mirrors of its C structs.

A wrong mirror would crash. So each one is compared with the library's own table of
sizes and offsets before any function is called.
"""

from ctypes import (
    CDLL,
    CFUNCTYPE,
    POINTER,
    Structure,
    c_bool,
    c_char,
    c_char_p,
    c_double,
    c_int,
    c_size_t,
    c_ubyte,
    c_uint,
    c_uint32,
    c_uint64,
    c_void_p,
    cast,
    sizeof,
)
from functools import cache
from pathlib import Path
from typing import Any

from rems_net.errors import MissingPartError
from rems_net.firmware import build

#: Bytes. Longest message that zenoh-pico takes; from link.h.
PAYLOAD = 4096
#: ms between two steps of the motors; from motors.h.
MOTORS_PERIOD = 10

#: State of the network in link.h: connected.
NETWORK_UP = 2


class Light(Structure):
    _fields_ = (("red", c_ubyte), ("green", c_ubyte), ("blue", c_ubyte))


class Bytes(Structure):
    _fields_ = (("at", c_void_p), ("size", c_size_t))


class NetworkSettings(Structure):
    _fields_ = tuple((part, c_char_p) for part in ("ssid", "password", "user", "name"))


class AccessPoint(Structure):
    _fields_ = (("ssid", c_char * 33), ("rssi", c_int), ("open", c_bool))


class Servo(Structure):
    _fields_ = (
        ("trim", c_double),
        ("dead_band", c_double),
        ("top_speed", c_double),
        ("pulse", c_uint),
    )


class Body(Structure):
    """Position of a modelled Woodbot, from posix/body.h."""

    _fields_ = (
        ("servo", Servo * 2),
        ("x", c_double),
        ("y", c_double),
        ("heading", c_double),
        ("arena_radius", c_double),
        ("track", c_double),
        ("at", c_uint64),
    )


#: Functions of hardware.h and link.h: what they return, then their arguments.
HARDWARE: dict[str, Any] = {
    "now": CFUNCTYPE(c_uint64, c_void_p),
    "servo": CFUNCTYPE(None, c_void_p, c_int, c_uint),
    "feed": CFUNCTYPE(None, c_void_p),
    "lidar": CFUNCTYPE(c_int, c_void_p, c_int, POINTER(c_double)),
    "gyro": CFUNCTYPE(c_int, c_void_p, POINTER(c_double)),
    "compass": CFUNCTYPE(c_int, c_void_p, POINTER(c_double), POINTER(c_double)),
    "lights": CFUNCTYPE(None, c_void_p, POINTER(Light)),
    "load": CFUNCTYPE(c_size_t, c_void_p, c_void_p, c_size_t),
    "store": CFUNCTYPE(c_bool, c_void_p, c_void_p, c_size_t),
    "read": CFUNCTYPE(c_size_t, c_void_p, c_void_p, c_size_t),
    "write": CFUNCTYPE(c_size_t, c_void_p, c_void_p, c_size_t),
    "identity": CFUNCTYPE(c_uint64, c_void_p),
    "started_by": CFUNCTYPE(c_int, c_void_p),
    "restart": CFUNCTYPE(None, c_void_p),
}
LINK: dict[str, Any] = {
    "join": CFUNCTYPE(None, c_void_p, POINTER(NetworkSettings)),
    "network": CFUNCTYPE(c_int, c_void_p),
    "scan": CFUNCTYPE(c_int, c_void_p, POINTER(AccessPoint), c_size_t),
    "open": CFUNCTYPE(c_bool, c_void_p, c_char_p),
    "close": CFUNCTYPE(None, c_void_p),
    "up": CFUNCTYPE(c_bool, c_void_p),
    "subscribe": CFUNCTYPE(c_bool, c_void_p, c_char_p),
    "answer": CFUNCTYPE(c_bool, c_void_p, c_char_p),
    "token": CFUNCTYPE(c_bool, c_void_p, c_char_p),
    "forget": CFUNCTYPE(None, c_void_p, c_char_p),
    "put": CFUNCTYPE(c_bool, c_void_p, c_char_p, Bytes, c_char_p, Bytes, c_bool),
    "ask": CFUNCTYPE(c_bool, c_void_p, c_char_p, Bytes, c_uint32, c_uint32),
    "reply": CFUNCTYPE(c_bool, c_void_p, c_void_p, c_char_p, Bytes, c_char_p, Bytes),
    "refuse": CFUNCTYPE(c_bool, c_void_p, c_void_p, c_char_p),
    "poll": CFUNCTYPE(None, c_void_p, c_uint32),
}


class Hardware(Structure):
    _fields_ = (("self", c_void_p), *HARDWARE.items())


class Link(Structure):
    _fields_ = (("self", c_void_p), *LINK.items())


#: Struct in C -> its mirror.
MIRRORS: dict[str, type[Structure]] = {
    "light": Light,
    "bytes": Bytes,
    "network_settings": NetworkSettings,
    "access_point": AccessPoint,
    "servo": Servo,
    "body": Body,
    "hardware": Hardware,
    "link": Link,
}
#: Structs of which only the size is needed here.
OPAQUE = ("settings",)
#: Function -> what it returns, then its arguments.
FUNCTIONS: dict[str, tuple[Any, ...]] = {
    "woodbot_size": (c_size_t,),
    "woodbot_start": (None, c_void_p, POINTER(Hardware), POINTER(Link)),
    "woodbot_drive": (None, c_void_p),
    "woodbot_run": (None, c_void_p, c_uint32),
    "woodbot_heard": (None, c_void_p, c_char_p, Bytes, c_char_p, Bytes),
    "woodbot_asked": (None, c_void_p, c_void_p, c_char_p, c_char_p, Bytes),
    "woodbot_answered": (None, c_void_p, c_uint32, c_bool, Bytes, Bytes),
    "body_default": (None, POINTER(Body)),
    "body_advance": (None, POINTER(Body), c_uint64),
    "body_turning": (c_double, POINTER(Body)),
    "body_lidar": (c_double, POINTER(Body), c_int),
    "settings_default": (None, c_void_p),
    "settings_set": (c_char_p, c_void_p, c_char_p, c_char_p),
    "settings_store": (c_bool, c_void_p, POINTER(Hardware)),
}


class Place(Structure):
    _fields_ = (("name", c_char_p), ("at", c_size_t))


@cache
def load() -> CDLL:
    """Return the library, compiled if need be. Raises MissingPartError."""
    return load_from(build.library())


def load_from(path: Path) -> CDLL:
    """Return the library in this file. Raises MissingPartError if it does not fit."""
    try:
        loaded = CDLL(str(path))
        for name, (returns, *takes) in FUNCTIONS.items():
            function = getattr(loaded, name)
            function.restype, function.argtypes = returns, takes
        places = (Place * 1).in_dll(loaded, "library_places")
    except (OSError, AttributeError, ValueError) as error:
        raise MissingPartError(
            f"The firmware's library {path} cannot be used: {error}. Remove it; it "
            "is made anew. (R0709)"
        ) from None
    check_mirrors(read_places(places))
    return loaded


def size_of(loaded: CDLL, struct: str) -> int:
    """Return the bytes of a struct that only C knows."""
    return read_places((Place * 1).in_dll(loaded, "library_places"))[struct]


def read_places(places: Any) -> dict[str, int]:
    """Return the library's table: bytes of each struct, and offsets of its fields."""
    table = cast(places, POINTER(Place))
    found: dict[str, int] = {}
    while (place := table[len(found)]).name is not None:
        found[place.name.decode()] = place.at
    return found


def check_mirrors(there: dict[str, int]) -> None:
    """Raise MissingPartError if a mirror differs from its struct in C."""
    mine = {name: there.get(name) for name in OPAQUE}
    for name, mirror in MIRRORS.items():
        mine[name] = sizeof(mirror)
        for part in mirror._fields_:
            mine[f"{name}.{part[0]}"] = getattr(mirror, part[0]).offset
    for name in {**there, **mine}:
        if there.get(name) != mine.get(name):
            struct, _, field = name.partition(".")
            what = f"`{field}` of struct {struct}" if field else f"struct {struct}"
            kind = "is at byte" if field else "has bytes:"
            raise MissingPartError(
                f"The firmware's {what} {kind} {there.get(name, 'none')} in C, and "
                f"{mine.get(name, 'none')} in rems_net/firmware/library.py. Write "
                "it there as in the header, and in shared/library.c. (R0709)"
            )
