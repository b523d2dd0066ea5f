"""Fits: check whether the Woodbot's firmware can implement a definition."""

from collections.abc import Mapping
from typing import NamedTuple

from rems_net.agents.about.wiring import Entry
from rems_net.agents.protocol.limits import NUMERICS
from rems_net.agents.protocol.messages import Request
from rems_net.defdict import Field, Schema
from rems_net.defdict.wire.reader import longest
from rems_net.errors import SchemaError
from rems_net.packing import pack

#: Bytes. Largest message that zenoh-pico sends and receives in one piece.
MOST = 4096
#: Limits of the firmware's codec (codec.h).
MOST_FIELDS, MOST_KEY, MOST_DEPTH = 15, 31, 4
#: Characters. Longest name in the firmware's settings.
MOST_NAME = 64

#: Fields that the firmware's own code uses, by port, with their units.
NEEDS: dict[str, dict[str, str]] = {
    "command": {"wheel/left": "rad/s", "wheel/right": "rad/s"},
    "state": {"x": "m", "y": "m", "heading": "rad"},
    "sensors": {
        "lidar/front": "m",
        "lidar/right": "m",
        "compass/x": "",
        "compass/y": "",
        "gyro/z": "rad/s",
    },
    "parameters": {
        "wheel_radius": "m",
        "track": "m",
        "max_wheel_speed": "rad/s",
        "lidar_front": "m",
        "lidar_right": "m",
        "lidar_reach": "m",
        "arena_radius": "m",
    },
}
_KEYWORDS = """
auto bool break case char const continue default do double else enum extern false float
for goto if inline int long register restrict return short signed sizeof static struct
switch true typedef union unsigned void volatile while
"""
TAKEN = frozenset(_KEYWORDS.split())


def c_name(path: str) -> str:
    """Return the name of a field in C: `wheel_left`."""
    return path.replace("/", "_")


def check_needs(robot: str, found: Mapping[str, Schema]) -> None:
    """Raise SchemaError if a field is missing that the firmware uses.

    found: the schema of each port, and of the parameters.
    """
    for port, fields in NEEDS.items():
        for path, unit in fields.items():
            field = found[port].find(path) if port in found else None
            if not isinstance(field, Field) or field.dtype != "float" or field.shape:
                raise SchemaError(
                    f"{robot}.{port} has no float {path!r}, with which the firmware "
                    "works. (R0711)"
                )
            if field.unit != unit:
                raise SchemaError(
                    f"{robot}.{port}: {path!r} is in {field.unit or 'no unit'}; the "
                    f"firmware works in {unit or 'no unit'}. (R0711)"
                )


def check(place: str, schema: Schema) -> None:
    """Raise SchemaError, with the field, if the codec cannot encode a schema."""
    if len(schema.fields) > MOST_FIELDS:
        raise SchemaError(
            f"{place}: {schema.paths[MOST_FIELDS]!r} is one field too many; the "
            f"firmware takes {MOST_FIELDS}. (R0711)"
        )
    names: dict[str, str] = {}
    for path, field in schema.rows():
        if problem := _problem(path, field):
            raise SchemaError(f"{place}: {path!r} {problem} (R0711)")
        name = c_name(path)
        if name in names:
            raise SchemaError(
                f"{place}: {path!r} and {names[name]!r} would both be {name!r} in C."
                " (R0711)"
            )
        names[name] = path


def _problem(path: str, field: Field) -> str:
    """Return why the codec cannot encode a field; "" if it can."""
    if field.dtype != "float" or field.shape:
        return (
            f"is of type {field.describe_type()}; the firmware takes float only, "
            "0.0 and 1.0 for a bool."
        )
    chunks = path.split("/")
    if len(chunks) > MOST_DEPTH:
        return f"is {len(chunks)} deep; the firmware takes {MOST_DEPTH}."
    for chunk in chunks:
        size = len(chunk.encode())
        if size > MOST_KEY:
            return f"has a name of {size} bytes; the firmware takes {MOST_KEY}."
    name = c_name(path)
    if not name.isascii() or not name.isidentifier() or name in TAKEN:
        return f"cannot be called {name!r} in C."
    return ""


class Sizes(NamedTuple):
    """Bytes of the longest messages.

    payload: a value of any port          description: the schema of any port
    answer: the answer at @schema         join: the request at @join
    """

    payload: int
    description: int
    answer: int
    join: int


def sizes(robot: str, schemas: Mapping[str, Schema]) -> Sizes:
    """Return the sizes. Raises SchemaError if a message would be too long."""
    wires = {port: schema.to_wire() for port, schema in schemas.items()}
    found = Sizes(
        payload=max(map(longest, schemas.values())),
        description=max(map(len, wires.values())),
        answer=len(pack(wires)),
        join=len(_longest_join(schemas)),
    )
    most = max(found)
    if most > MOST:
        raise SchemaError(
            f"{robot}: a message of it may have {most} bytes, and zenoh-pico drops "
            f"those of more than {MOST}. Take away fields, or shorten their docs."
            " (R0711)"
        )
    return found


def _longest_join(schemas: Mapping[str, Schema]) -> bytes:
    """Return the longest request to join that such a robot may send."""
    long = "x" * MOST_NAME
    outs = {port: schema.digest for port, schema in schemas.items()}
    key = f"robot/{long}"
    reads = [f"input/{long}/{long}"]
    entry = Entry(key, key, outs, reads, 2**31, False, 2**53, 2**53)
    wires = {schema.digest: schema.to_wire() for schema in schemas.values()}
    numerics = "x" * NUMERICS
    request = Request(key, long, 2**53, "", [entry], wires, True, 0, numerics)
    return request.to_wire()
