"""Channels for viewers: what recorded values mean, as messages that every one knows.

`/tf` has the pose of each robot with x, y and heading; a picture of a camera becomes
a PNG file. Viewers draw both, and nothing that is theirs is read back.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from rems_net.defdict import Field, Schema, cdr
from rems_net.maths import sincos
from rems_net.pictures import is_picture, png

#: frame of all poses
WORLD = "world"
#: key of the channel of poses
POSES = "tf"
_LINE = "=" * 80
_HEADER = f"""{_LINE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_LINE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
TF = (
    "tf2_msgs/msg/TFMessage",
    f"""geometry_msgs/TransformStamped[] transforms
{_LINE}
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
{_LINE}
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
{_LINE}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
{_LINE}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
{_HEADER}""",
)
IMAGE = (
    "sensor_msgs/msg/CompressedImage",
    f"std_msgs/Header header\nstring format\nuint8[] data\n{_HEADER}",
)
Messages = Mapping[str, bytes]


@dataclass(frozen=True)
class Derived:
    """One channel: its key, the name and the text of its type, and what fills it.

    message: of the messages of a tick and its time [ns]; b"" if there is none.
    """

    key: str
    type: tuple[str, str]
    message: Callable[[Messages, int], bytes]


def derived(schemas: Mapping[str, Schema]) -> list[Derived]:
    """Return the channels that ports with these keys and schemas give."""
    found = []
    posed = {key: one for key, one in sorted(schemas.items()) if has_pose(key, one)}
    if posed:
        found.append(Derived(POSES, TF, Poses(posed)))
    for key, one in sorted(schemas.items()):
        if cdr(one).layout is not None:
            for path, field in one.rows():
                if is_picture(field):
                    picture = Picture(key, one, path)
                    found.append(Derived(f"{key}/{path}/png", IMAGE, picture))
    return found


def has_pose(key: str, schema: Schema) -> bool:
    """Return whether it is a state with x and y in m and heading in rad."""
    wanted = {"x": "m", "y": "m", "heading": "rad"}
    fields = {path: schema.find(path) for path in wanted}
    return key.startswith("robot/") and key.endswith("/state") and all(
        isinstance(one, Field) and one.dtype == "float" and one.unit == wanted[path]
        for path, one in fields.items()
    ) and cdr(schema).layout is not None  # fmt: skip


class Poses:
    """Makes one message of the poses of a tick."""

    def __init__(self, schemas: Mapping[str, Schema]) -> None:
        self._schemas = schemas
        self._form: Callable[[tuple[str, ...]], _Form] = cache(self._made)

    def __call__(self, messages: Messages, time: int) -> bytes:
        """Return the message of a tick, whose stamp is the time [ns]."""
        keys = tuple([key for key in self._schemas if key in messages])
        return self._form(keys).filled(messages, time) if keys else b""

    def _made(self, keys: tuple[str, ...]) -> _Form:
        return _Form({key: self._schemas[key] for key in keys})


class _Form:
    """The message of some robots, without their numbers."""

    def __init__(self, schemas: Mapping[str, Schema]) -> None:
        out = bytearray(b"\0\1\0\0") + len(schemas).to_bytes(4, "little")
        stamps: list[int] = []
        #: by layout of the states: their keys, and where their numbers are
        self._groups: dict[Any, tuple[list[str], list[int]]] = {}
        for key, schema in schemas.items():
            out += bytes(-len(out) & 3)
            stamps.append(len(out) // 4)
            out += bytes(8)
            _put(out, WORLD)
            _put(out, key.split("/")[1])
            out += bytes(-(len(out) - 4) & 7)
            keys, places = self._groups.setdefault(cdr(schema).layout, ([], []))
            keys.append(key)
            places.append((len(out) - 4) // 8)
            out += bytes(7 * 8)
        self._data, self._stamps = out, np.array(stamps)

    def filled(self, messages: Messages, time: int) -> bytes:
        """Return the message with the poses of these messages, at a time [ns]."""
        data = bytearray(self._data)
        words = np.frombuffer(data, "<u4", len(data) // 4)
        words[self._stamps] = time // 10**9
        words[self._stamps + 1] = time % 10**9
        reals = np.frombuffer(data, "<f8", (len(data) - 4) // 8, 4)
        for layout, (keys, places) in self._groups.items():
            rows = np.frombuffer(b"".join([messages[key] for key in keys]), layout)
            at = np.array(places)
            reals[at], reals[at + 1] = rows["x"], rows["y"]
            # A turn about z: of a quaternion these are z and w.
            sine, cosine = sincos(rows["heading"] / 2)
            reals[at + 5], reals[at + 6] = sine, cosine
        return bytes(data)


class Picture:
    """Makes a PNG file of each picture of a camera."""

    def __init__(self, key: str, schema: Schema, path: str) -> None:
        self._key, self._path, self._layout = key, path, cdr(schema).layout

    def __call__(self, messages: Messages, time: int) -> bytes:
        """Return the message of a tick, whose stamp is the time."""
        if self._key not in messages:
            return b""
        row = np.frombuffer(messages[self._key], self._layout)[0]
        out = bytearray(struct.pack("<BBHII", 0, 1, 0, time // 10**9, time % 10**9))
        _put(out, self._key)
        _put(out, "png")
        data = png(row[self._path])
        out += bytes(-len(out) & 3) + len(data).to_bytes(4, "little") + data
        return bytes(out)


def _put(out: bytearray, text: str) -> None:
    data = text.encode() + b"\0"
    out += bytes(-len(out) & 3) + len(data).to_bytes(4, "little") + data
