"""The cases of tests/golden/woodbot: what a Woodbot sends and hears, as bytes.

For each port `<port>.schema` holds the description of its schema, `<port>.digest` its
digest in ASCII, `<port>.payload` the payload of the values below. `<name>.bad` is a
command that is refused, `<name>.refusal` how the firmware says so: a status and the
path of the field, if it is about one. The firmware's test reads them too.
They change only when the wire format or Woodbot does:
`python -m tests.firmware.golden`.
"""

import importlib
import math
import struct
from pathlib import Path
from typing import Any

from rems_net.defdict import Schema
from rems_net.robots.woodbot import Woodbot

msgpack: Any = importlib.import_module("msgpack")

FOLDER = Path(__file__).parent.parent / "golden" / "woodbot"

#: port -> the values of its golden payload; test_codec.c has them too
VALUES: dict[str, dict[str, float]] = {
    "command": {"wheel/left": 7.3, "wheel/right": -1.25},
    "state": {"x": 0.125, "y": -0.0, "heading": 7.0},
    "sensors": {
        "lidar/front": 0.25,
        "lidar/right": 1.2,
        "compass/x": -0.6,
        "compass/y": 0.8,
        "gyro/z": 0.001,
    },
}


def schemas() -> dict[str, Schema]:
    """Return the schemas of a Woodbot with its default parameters, by port."""
    parameters = Woodbot("woodbot").parameters
    found = {name: getattr(Woodbot, name).schema_for(parameters) for name in VALUES}
    assert all(isinstance(one, Schema) for one in found.values())
    return found


def wheels(left: Any, right: Any) -> bytes:
    made: bytes = msgpack.packb({"wheel": {"left": left, "right": right}})
    return made


def _packed(value: Any) -> bytes:
    made: bytes = msgpack.packb(value)
    return made


_LEFT = b"\xa4left\xcb" + struct.pack(">d", 1.0)
_RIGHT = b"\xa5right\xcb" + struct.pack(">d", 1.0)

#: name -> a command, the firmware's refusal, and the beginning of Python's
BAD: dict[str, tuple[bytes, str, str]] = {
    "empty": (b"", "truncated", "the payload is not one msgpack map"),
    "truncated": (
        wheels(1.0, 2.0)[:-1],
        "truncated wheel/right",
        "the payload is not one msgpack map",
    ),
    "trailing": (
        wheels(1.0, 2.0) + b"\0",
        "trailing",
        "the payload is not one msgpack map",
    ),
    "too_long": (wheels(1.0, 2.0) + bytes(21), "too_long", "58 bytes came"),
    "not_a_map": (_packed(1.5), "not_a_map", "expects a map of fields"),
    "flat": (
        _packed({"wheel": 1.0}),
        "not_a_map wheel/left",
        "'wheel' expects a map of fields",
    ),
    "number_as_key": (
        b"\x81\xa5wheel\x82\x01\x01" + _RIGHT,
        "not_a_key",
        "the payload is not one msgpack map",
    ),
    "text": (
        wheels("1", 2.0),
        "not_a_number wheel/left",
        "'wheel/left' expects a number",
    ),
    "true": (
        wheels(1.0, True),
        "not_a_number wheel/right",
        "'wheel/right' expects a number",
    ),
    "unknown": (
        _packed({"wheel": {"left": 1.0, "rihgt": 2.0}}),
        "unknown_field",
        "has no field 'wheel/rihgt'",
    ),
    "missing": (
        _packed({"wheel": {"left": 1.0}}),
        "missing_field wheel/right",
        "'wheel/right' is missing",
    ),
    "twice": (
        b"\x81\xa5wheel\x82" + _LEFT + _LEFT,
        "duplicate_field wheel/left",
        "the payload is not one msgpack map",
    ),
    "too_fast": (
        wheels(7.4, 2.0),
        "out_of_range wheel/left",
        "'wheel/left' expects a number in rad/s from -7.3 to 7.3, but got 7.4",
    ),
    "too_fast_whole": (
        wheels(1.0, -8),
        "out_of_range wheel/right",
        "'wheel/right' expects a number in rad/s from -7.3 to 7.3, but got -8",
    ),
    "nan": (
        wheels(math.nan, 2.0),
        "out_of_range wheel/left",
        "'wheel/left' expects a number in rad/s from -7.3 to 7.3, but got nan",
    ),
    "infinity": (
        wheels(1.0, -math.inf),
        "out_of_range wheel/right",
        "'wheel/right' expects a number in rad/s from -7.3 to 7.3, but got -inf",
    ),
}


def write() -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, schema in schemas().items():
        (FOLDER / f"{name}.schema").write_bytes(schema.to_wire())
        (FOLDER / f"{name}.payload").write_bytes(schema(VALUES[name]).encode())
        (FOLDER / f"{name}.digest").write_bytes(schema.digest.encode())
    for name, (payload, refusal, _) in BAD.items():
        (FOLDER / f"{name}.bad").write_bytes(payload)
        (FOLDER / f"{name}.refusal").write_bytes(refusal.encode())


if __name__ == "__main__":
    write()
