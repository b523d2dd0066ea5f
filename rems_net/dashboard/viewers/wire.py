"""Messages of the Foxglove WebSocket protocol, and what a viewer's hand means.

The server speaks JSON texts and binary messages with little-endian numbers:

  u8 1, u32 subscription, u64 time [ns], message     a value
  u8 2, u64 time [ns]                                the fabric's time

A viewer speaks JSON texts, too, and publishes `u8 1, u32 channel, message`, or calls a
service by `u8 2, u32 service, u32 call, u32 length, encoding, arguments`.
"""

import json
import math
import struct
from typing import Any

from rems_net.errors import WireError
from rems_net.router.asking import printable
from rems_net.router.keys import is_name
from rems_net.teleop.stick import FULL, STICK

#: both names of the protocol, newest first
SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
#: names of the types by which a viewer drives
TWIST = ("geometry_msgs/Twist", "geometry_msgs/msg/Twist")
STICKS = ("rems_msgs/Stick", "rems_msgs/msg/Stick")
#: what a viewer may do
ABLE = ("clientPublish", "parameters", "parametersSubscribe", "services", "time")
#: messages about parameters
PARAMETERS = (
    "getParameters",
    "setParameters",
    "subscribeParameterUpdates",
    "unsubscribeParameterUpdates",
)
#: level of a sentence that a viewer shows
ERROR = 2
#: what a viewer sends to call a verb of an agent, as a JSON schema
CALL = {
    "type": "object",
    "properties": {
        "agent": {"type": "string"},
        "verb": {"type": "string"},
        "args": {"type": "array"},
        "kwargs": {"type": "object"},
    },
    "required": ["agent", "verb"],
}
_VALUE, _TIME = struct.Struct("<BIQ"), struct.Struct("<BQ")
_PUT, _CALL, _ANSWER = (struct.Struct(s) for s in ("<BI", "<BIII", "<BIII"))
#: a Twist in CDR: four bytes, which name the order of bytes, and six numbers
_ORDERS = {b"\0\1": "<6d", b"\0\0": ">6d"}
_TWIST_SIZE = 52


def pack_value(subscription: int, t: int, message: bytes) -> bytes:
    """Return the message of a value; t: its time [ns]."""
    return _VALUE.pack(1, subscription, t) + message


def pack_time(t: int) -> bytes:
    """Return the message of the fabric's time [ns]."""
    return _TIME.pack(2, t)


def pack_answer(service: int, call: int, result: Any) -> bytes:
    """Return the answer of a service, in JSON."""
    plain = json.dumps({"result": result}, default=str).encode()
    return _ANSWER.pack(3, service, call, 4) + b"json" + plain


def pack_text(op: str, **words: Any) -> str:
    """Return a message in JSON."""
    return json.dumps({"op": op, **words}, separators=(",", ":"))


def read_text(text: str) -> dict[str, Any]:
    """Read a message in JSON. Raises WireError."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise WireError('This is no message of a viewer; expected {"op": ...}. (R1003)')
    return found


def read_rows(message: dict[str, Any], name: str) -> list[dict[str, Any]]:
    """Return the maps in a member of a message, each with a whole `id`."""
    rows = message.get(name)
    plain = rows if isinstance(rows, list) else []
    if rows is None or not all(
        isinstance(row, dict) and type(row.get("id")) is int for row in plain
    ):
        raise WireError(f"{name} is no list of maps with an id. (R1003)")
    return plain


def read_binary(message: bytes) -> tuple[str, tuple[int, ...], bytes]:
    """Return "put", (channel,) and the rest; or "call", (service, call), and the rest.

    Raises WireError.
    """
    if message[:1] == b"\1" and len(message) >= _PUT.size:
        return "put", _PUT.unpack_from(message)[1:], message[_PUT.size :]
    if message[:1] == b"\2" and len(message) >= _CALL.size:
        _, service, call, length = _CALL.unpack_from(message)
        return "call", (service, call), message[_CALL.size + length :]
    raise WireError("This is no message of a viewer: its first byte is 1 or 2. (R1003)")


def read_call(
    given: bytes,
) -> tuple[str, str, tuple[Any, ...], dict[str, Any]]:
    """Return agent, verb and arguments of a call, see CALL. Raises WireError."""
    try:
        found = json.loads(given)
    except (ValueError, RecursionError):
        found = None
    match found:
        case {"agent": str(agent), "verb": str(verb)}:
            args, kwargs = found.get("args", []), found.get("kwargs", {})
            fits = isinstance(args, list) and isinstance(kwargs, dict)
            kind, _, name = agent.partition("/")
            if fits and is_name(kind) and is_name(name) and is_name(verb):
                return agent, verb, tuple(args), kwargs
    raise WireError(
        'This calls no verb; expected {"agent": "robot/sim", "verb": "reset"}, and '
        '"args" or "kwargs" if the verb takes some. (R1003)'
    )


def read_topic(channel: dict[str, Any]) -> str:
    """Return the agent that a viewer wants to drive at a channel: `robot/sim`.

    Raises WireError for another topic or another type.
    """
    topic = printable(str(channel.get("topic", "")))
    kind, _, name = topic.strip("/").removesuffix("/command").partition("/")
    if kind not in ("robot", "input") or not is_name(name):
        raise WireError(
            f"{topic!r:.80} drives nothing: publish at the topic of a robot, such as "
            "/robot/sim/command. (R1004)"
        )
    named, encoding = channel.get("schemaName"), channel.get("encoding")
    fits = encoding in ("json", "cdr") if named in TWIST else encoding == "json"
    if named not in (*TWIST, *STICKS) or not fits:
        raise WireError(
            f"{topic} takes {TWIST[0]} as json or cdr, or {STICKS[0]} as json; the "
            f"viewer publishes {named!r:.80} as {encoding!r:.20}, and {kind}/{name} "
            "stands. (R1004)"
        )
    return f"{kind}/{name}"


def read_stick(channel: dict[str, Any], message: bytes) -> dict[str, float]:
    """Return the stick of a published message: percent by axis.

    1 m/s and 1 rad/s of a Twist are a full axis; more is no more. Raises WireError.
    """
    try:
        if channel["encoding"] == "cdr":
            order = _ORDERS[bytes(message[:2])]
            if len(message) != _TWIST_SIZE:
                raise ValueError(f"{len(message)} bytes")
            x, y, _, _, _, turn = struct.unpack_from(order, message, 4)
        else:
            found = json.loads(message)
            if channel["schemaName"] in STICKS:
                return _checked({axis: found.get(axis, 0.0) for axis in STICK.paths})
            linear, angular = found.get("linear", {}), found.get("angular", {})
            x, y = linear.get("x", 0.0), linear.get("y", 0.0)
            turn = angular.get("z", 0.0)
        axes = (("ahead", x), ("left", y), ("turn", turn))
        return _checked({axis: FULL * _number(v) for axis, v in axes})
    except (ValueError, KeyError, AttributeError, RecursionError, UnicodeError) as why:
        raise WireError(
            f"What came at {printable(str(channel['topic']))} is no "
            f"{channel['schemaName']}: {why}; the robot stands. (R1004)"
        ) from None


def _number(value: Any) -> float:
    if type(value) not in (int, float) or not math.isfinite(value):
        raise ValueError(f"{value!r:.40} is no finite number")
    return float(value)


def _checked(stick: dict[str, Any]) -> dict[str, float]:
    """Return a stick within its ends. Raises ValueError."""
    return {axis: max(-FULL, min(FULL, _number(v))) for axis, v in stick.items()}
