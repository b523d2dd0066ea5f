"""Messages between the server and a page, over one WebSocket.

The page speaks JSON texts, at most LONGEST bytes each and RATE a second:

  {"hello": TOKEN, "version": 1, "fabric": NAME}
                                     the first message; anything else ends it. Without
                                     a fabric it is the one that was joined
  {"do": VERB, "id": 7, ...}         a request: see `requests.py` and `teams.py` for the
                                     verbs
  {"look": [AGENT]}                  the agents of which it shows every port; of
                                     other robots it gets the port `state` only
  {"do": "drive", "id": 8, "agents": [AGENT]}
                                     drive these robots and no others; [] lets go
  {"hand": {"held": [KEY], "stick": {AXIS: PERCENT}}, "beat": NUMBER}
                                     what the hand does now; at least every 0.2 s
                                     while it is not at rest
  {"play": {playing, pace, t, past, ports, dragged}}
                                     of a recording, each member if it changes; see
                                     `recorded/player.py`

The server speaks JSON texts with one or more of these members:

  welcome    {version, fabric, at, layout, recording, may: [VERB]},
             once
  schemas    {DIGEST: [{path, dtype, unit, range, shape, choices, doc, item}]}
  channels   [{id, key, schema}], each channel once; `schema` is a digest or ""
  forget     the run is another one: all values and channels are void
  status     {agents, clock, stopped, robots, router, late}, when it has changed
  scenes     {AGENT: place and outline}, when it has changed
  events     [{level, tick, agent, text}], the new ones
  beat       {number, driving: {AGENT: {drives, taken, other}}}, each 0.1 s to a
             page that drives; what a hand does for an older one is ignored
  playback   {playing, pace}, of a recording, when it has changed
  rewind     a recording is at another time: all values and events before this are void
  answer     {id, result} or {id, error: SENTENCE}, to each request

and binary frames with the newest values, one for each display frame. A page that is
too slow gets no frame until its buffer is empty, and then one with all values:

  u8 version, then for each value
  u16 channel, u8 length of the stamp, u32 length of the payload, stamp, payload

All numbers are little-endian. Stamp and payload are the bytes that the agent sent:
`docs/wire_format.md`. The key of a crowd is `robot/@crowd/state`; its payload is a map
of names and values.
"""

import json
import struct
from collections.abc import Iterable
from typing import Any

from rems_net.defdict import Schema
from rems_net.errors import WireError
from rems_net.router.message import read

VERSION = 1
#: bytes. A longer message of a page ends its connection.
LONGEST = 8192
#: messages per second that a page may send; driving needs 20
RATE = 60.0
#: agents of which a page may show every port
LOOKS = 200
#: bytes. Larger values are announced, not sent: the page shows their size.
LARGEST = 65_536

#: characters of an event's text that are shown
REPORT = 2000

_HEAD = struct.Struct("<HBI")
Value = tuple[bytes, bytes]


def pack_frame(values: Iterable[tuple[int, Value]]) -> bytes:
    """Return a binary frame of (channel, (stamp, payload))."""
    parts = [bytes([VERSION])]
    for channel, (stamp, payload) in values:
        parts += [_HEAD.pack(channel, len(stamp), len(payload)), stamp, payload]
    return b"".join(parts)


def described(schema: Schema) -> list[dict[str, Any]]:
    """Return a schema as a list of its fields, for a browser."""
    rows = []
    for path, field in schema.rows():
        more = {
            "range": list(field.range or ()),
            "shape": list(field.shape),
            "choices": list(field.choices),
            "doc": field.doc,
            "item": described(field.item) if field.item is not None else None,
        }
        row = {"path": path, "dtype": field.dtype, "unit": field.unit}
        rows.append(row | {word: one for word, one in more.items() if one})
    return rows


def read_message(text: str | bytes) -> dict[str, Any]:
    """Read a message of a page. Raises WireError."""
    try:
        found = json.loads(text) if isinstance(text, str) else None
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise WireError('This is no message of the page; expected {"do": ...}. (R1003)')
    return found


def read_look(message: dict[str, Any]) -> set[str]:
    """Read the agents that a page looks at. Raises WireError."""
    agents = message["look"]
    if not isinstance(agents, list) or len(agents) > LOOKS:
        raise WireError(f"A page looks at a list of at most {LOOKS} agents. (R1003)")
    return {agent for agent in agents if isinstance(agent, str)}


def read_report(payload: bytes) -> dict[str, Any]:
    """Read an event of a run, as `clock/@event` has it. Raises WireError."""
    match read(payload):
        case [str(level), int(tick), str(agent), str(), str(text)]:
            words = {"level": level[:8], "tick": tick, "agent": agent[:128]}
            return words | {"text": text[:REPORT]}
    raise WireError("it is no event: [level, tick, agent, kind, text]. (R1003)")
