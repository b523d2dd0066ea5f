"""Messages of the channel of events, as the logs of ROS 2 programs."""

import struct

from rems_net.recordings.mcap.derived import TIME_TYPE, put_text

#: key of the channel
EVENTS = "rems/events"
INFO, WARN = 20, 30
#: place of the level in a message
_LEVEL = 4 + struct.calcsize("<II")
#: key and texts of the events of STOP and its release
CLOCK = "clock"
STOPPED, RELEASED = "STOP: every robot holds its safe command", "released"
LOG = (
    "rcl_interfaces/msg/Log",
    f"""uint8 DEBUG=10
uint8 INFO={INFO}
uint8 WARN={WARN}
uint8 ERROR=40
uint8 FATAL=50
builtin_interfaces/Time stamp
uint8 level
string name
string msg
string file
string function
uint32 line
{TIME_TYPE}""",
)


def log(time: int, level: int, name: str, text: str) -> bytes:
    """Return the message of an event. time: ns.  name: key of the agent that did it."""
    out = bytearray(struct.pack("<BBHIIB", 0, 1, 0, *divmod(time, 10**9), level))
    for one in (name, text, "", ""):
        put_text(out, one)
    out += bytes(-len(out) & 3) + bytes(4)
    return bytes(out)


def level_of(message: bytes) -> int:
    """Return the level of the message of an event. Raises ValueError."""
    if len(message) <= _LEVEL:
        raise ValueError("an event is cut off")
    return message[_LEVEL]


def read_log(message: bytes) -> tuple[str, str]:
    """Return key and text of the message of an event. Raises ValueError."""
    at, found = 4 + struct.calcsize("<IIB"), []
    for _ in range(2):
        at += -at & 3
        (length,) = struct.unpack_from("<I", message, at)
        found.append(message[at + 4 : at + 3 + length].decode())
        at += 4 + length
    return found[0], found[1]
