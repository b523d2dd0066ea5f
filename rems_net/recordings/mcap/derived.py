"""Channels for viewers: what recorded values mean, as messages that every one knows.

`/tf` has the pose of each robot with x, y and heading; the rays of its distance sensors
become points; a picture of a camera becomes a PNG file. Viewers draw these, and nothing
of them is read back.
"""

import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from operator import itemgetter
from typing import Any

import numpy as np

from rems_net.defdict import Batch, Field, Schema, cdr
from rems_net.maths import sincos
from rems_net.pictures import is_picture, png

#: frame of all poses
WORLD = "world"
#: key of the channel of poses
POSES = "tf"
_LINE = "=" * 80
#: robots. The poses of as many are done sooner in plain Python than as arrays.
FEW = 16
#: of the numbers of a point
FLOAT32 = 7
#: bytes of a point
POINT = 12
_REAL = struct.Struct("<d")
_STAMP = struct.Struct("<II")
#: x, y and z of a place, and of a quaternion x, y, z and w
_POSE = struct.Struct("<7d")
#: how a message begins that has a header: its form, and its time in s and ns
_STAMPED = struct.Struct("<BBHII")
#: definitions that others use
TIME_TYPE = f"""{_LINE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
_HEADER = f"""{_LINE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{TIME_TYPE}"""
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
CLOUD = (
    "sensor_msgs/msg/PointCloud2",
    f"""std_msgs/Header header
uint32 height
uint32 width
sensor_msgs/PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense
{_LINE}
MSG: sensor_msgs/PointField
uint8 INT8=1
uint8 UINT8=2
uint8 INT16=3
uint8 UINT16=4
uint8 INT32=5
uint8 UINT32=6
uint8 FLOAT32=7
uint8 FLOAT64=8
string name
uint32 offset
uint8 datatype
uint32 count
{_HEADER}""",
)
#: reads x, y and heading in a message
Pose = Callable[[bytes], tuple[float, float, float]]
#: by robot, the rays of its distance sensors: x, y, z, direction, reach (7,)
Rays = Mapping[str, Mapping[str, Sequence[float]]]


@dataclass(frozen=True)
class Derived:
    """One channel: its key, the name and the text of its type, and what fills it.

    message: of the messages of a tick and its time [ns]; b"" if there is none.
    """

    key: str
    type: tuple[str, str]
    message: Callable[[Batch, int], bytes] = lambda messages, time: b""


def derived(schemas: Mapping[str, Schema], rays: Rays) -> list[Derived]:
    """Return the channels that ports with these keys and schemas give.

    rays: of robots, by name.
    """
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
            kind, name, port = key.split("/")
            known = rays.get(name, {}) if (kind, port) == ("robot", "sensors") else {}
            if there := {k: v for k, v in known.items() if _is_number(one, k, "m")}:
                found.append(Derived(f"{key}/points", CLOUD, Cloud(key, one, there)))
    return found


def _is_number(schema: Schema, path: str, unit: str) -> bool:
    """Return whether a field is a number in this unit."""
    field = schema.find(path)
    return isinstance(field, Field) and (field.dtype, field.unit) == ("float", unit)


def has_pose(key: str, schema: Schema) -> bool:
    """Return whether it is a state with x and y in m and heading in rad."""
    if not (key.startswith("robot/") and key.endswith("/state")):
        return False
    pose = (("x", "m"), ("y", "m"), ("heading", "rad"))
    posed = all(_is_number(schema, path, unit) for path, unit in pose)
    return posed and cdr(schema).layout is not None


class Poses:
    """Makes one message of the poses of a tick."""

    def __init__(self, schemas: Mapping[str, Schema]) -> None:
        self._all = tuple(schemas)
        self._form: Callable[[tuple[str, ...]], _Form] = cache(
            lambda keys: _Form({key: schemas[key] for key in keys})
        )

    def __call__(self, messages: Batch, time: int) -> bytes:
        """Return the message of a tick, whose stamp is the time [ns]."""
        try:
            return self._form(self._all).filled(messages, time)
        except KeyError:  # one did not step at this tick
            keys = tuple([key for key in self._all if key in messages])
            return self._form(keys).filled(messages, time) if keys else b""


class _Form:
    """The message of some robots, without their numbers."""

    def __init__(self, schemas: Mapping[str, Schema]) -> None:
        out = bytearray(b"\0\1\0\0") + len(schemas).to_bytes(4, "little")
        stamps: list[int] = []
        groups: dict[Any, tuple[list[str], list[int]]] = {}
        for key, schema in schemas.items():
            out += bytes(-len(out) & 3)
            stamps.append(len(out) // 4)
            out += bytes(8)
            put_text(out, WORLD)
            put_text(out, key.split("/")[1])
            out += bytes(-(len(out) - 4) & 7)
            keys, places = groups.setdefault(cdr(schema).layout, ([], []))
            keys.append(key)
            places.append((len(out) - 4) // 8)
            out += bytes(7 * 8)
        self._data, self._stamps = out, np.array(stamps)[:, None] + [0, 1]
        #: by layout of the states: their keys, and where their numbers are
        self._groups = {
            layout: (tuple(keys), np.add.outer((0, 1, 5, 6), places))
            for layout, (keys, places) in groups.items()
        }
        #: of few robots: key, where the message has its pose, and where this one has
        #: its stamp and its pose
        self._each: list[tuple[str, Pose, int, int]] = []
        few = schemas if len(schemas) <= FEW else ()
        for key, begin in zip(few, stamps, strict=False):
            layout: Any = cdr(schemas[key]).layout
            keys, places = groups[layout]
            at = 8 * places[keys.index(key)] + 4
            self._each.append((key, _pose(layout), 4 * begin, at))

    def filled(self, messages: Batch, time: int) -> bytes:
        """Return the message with the poses of these messages, at a time [ns]."""
        data = bytearray(self._data)
        if self._each:
            self._fill(data, messages, time)
            return bytes(data)
        words = np.frombuffer(data, "<u4", len(data) // 4)
        words[self._stamps] = divmod(time, 10**9)
        reals = np.frombuffer(data, "<f8", (len(data) - 4) // 8, 4)
        for layout, (keys, at) in self._groups.items():
            rows = messages.table(keys, layout)
            # A turn about z: of a quaternion sine and cosine are z and w.
            reals[at] = rows["x"], rows["y"], *sincos(rows["heading"] / 2)
        return bytes(data)

    def _fill(self, data: bytearray, messages: Batch, time: int) -> None:
        stamp = divmod(time, 10**9)
        for key, pose, begin, at in self._each:
            _STAMP.pack_into(data, begin, *stamp)
            x, y, heading = pose(messages[key])
            _POSE.pack_into(data, at, x, y, 0, 0, 0, *sincos(heading / 2))


@cache
def _pose(layout: np.dtype[Any]) -> Pose:
    """Return what reads x, y and heading in a message of this layout."""
    fields: Any = layout.fields
    places = {path: fields[path][1] for path in ("x", "y", "heading")}
    form, end = "<", 0
    for path in sorted(places, key=places.__getitem__):
        form += f"{places[path] - end}xd"
        end = places[path] + 8
    unpack, order = struct.Struct(form).unpack_from, sorted(places.values())
    which = itemgetter(*(order.index(place) for place in places.values()))
    return lambda message: which(unpack(message))


class Picture:
    """Makes a PNG file of each picture of a camera."""

    def __init__(self, key: str, schema: Schema, path: str) -> None:
        self._key, self._path, self._layout = key, path, cdr(schema).layout

    def __call__(self, messages: Batch, time: int) -> bytes:
        """Return the message of a tick, whose stamp is the time."""
        if self._key not in messages:
            return b""
        row = np.frombuffer(messages[self._key], self._layout)[0]
        out = bytearray(_stamp(time))
        put_text(out, self._key)
        put_text(out, "png")
        data = png(row[self._path])
        out += bytes(-len(out) & 3) + len(data).to_bytes(4, "little") + data
        return bytes(out)


class Cloud:
    """Makes the points that the rays of a robot have hit, in the robot's frame.

    Few rays are done sooner in plain Python than as arrays.
    """

    def __init__(
        self, key: str, schema: Schema, rays: Mapping[str, Sequence[float]]
    ) -> None:
        layout: Any = cdr(schema).layout
        self._key = key
        #: where the message has the distance, and the ray
        self._rays = [(layout.fields[path][1], *ray) for path, ray in rays.items()]
        head = bytearray(_STAMPED.size)
        put_text(head, key.split("/")[1])
        head += bytes(-len(head) & 3) + (1).to_bytes(4, "little")
        fields = bytearray((3).to_bytes(4, "little"))
        for i, axis in enumerate("xyz"):
            put_text(fields, axis)
            fields += bytes(-len(fields) & 3)
            fields += struct.pack("<IB3xI", 4 * i, FLOAT32, 1)
        #: by the number of points: what is before them, and how they are packed
        self._forms = [
            (
                bytes(head[_STAMPED.size :] + n.to_bytes(4, "little") + fields)
                + struct.pack("<B3xIII", 0, POINT, POINT * n, POINT * n),
                struct.Struct(f"<{3 * n}fB").pack,
            )
            for n in range(len(rays) + 1)
        ]

    def __call__(self, messages: Batch, time: int) -> bytes:
        """Return the message of a tick, whose stamp is the time [ns]."""
        message = messages.get(self._key)
        if message is None:
            return b""
        points: list[float] = []
        for place, x, y, z, along_x, along_y, along_z, reach in self._rays:
            (far,) = _REAL.unpack_from(message, place)
            if far < reach:
                points += x + far * along_x, y + far * along_y, z + far * along_z
        before, packed = self._forms[len(points) // 3]
        return _stamp(time) + before + packed(*points, 1)


@lru_cache(1)
def _stamp(time: int) -> bytes:
    """Return how a message with a header begins."""
    return _STAMPED.pack(0, 1, 0, *divmod(time, 10**9))


def put_text(out: bytearray, text: str) -> None:
    """Append a text, in CDR."""
    data = text.encode() + b"\0"
    out += bytes(-len(out) & 3) + len(data).to_bytes(4, "little") + data
