"""Messages of the channel of events, as the logs of ROS 2 programs."""

import struct

from rems_net.recordings.mcap.derived import TIME_TYPE, put_text

#: key of the channel
EVENTS = "rems/events"
INFO, WARN = 20, 30
#: time in s and ns, and level, behind the four bytes that name the order of bytes
_BEGIN = struct.Struct("<IIB")
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
    out = bytearray(b"\0\1\0\0" + _BEGIN.pack(*divmod(time, 10**9), level))
    for one in (name, text, "", ""):
        put_text(out, one)
    out += bytes(-len(out) & 3) + bytes(4)
    return bytes(out)


def read_log(message: bytes) -> tuple[int, str, str]:
    """Return level, key and text of an event. Raises ValueError, struct.error."""
    _, _, level = _BEGIN.unpack_from(message, 4)
    at, texts = 4 + _BEGIN.size, []
    for _ in range(2):
        at += -at & 3
        (length,) = struct.unpack_from("<I", message, at)
        texts.append(message[at + 4 : at + 3 + length].decode())
        at += 4 + length
    return level, texts[0], texts[1]
