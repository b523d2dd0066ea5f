"""The cases of tests/golden/defdict: schemas and values whose bytes are kept.

For each case `<name>.schema` holds the description of the schema, `<name>.digest` its
digest in ASCII, `<name>.payload` the payload, `<name>.cdr` the same value in CDR, and
`<name>.msg` its definition for ROS 2. The firmware's tests read those of the
Woodbot itself, in tests/golden/woodbot.
They change only when the wire format does: `python -m tests.defdict.golden`.
"""

from pathlib import Path
from typing import Any

from rems_net.defdict import (
    Schema,
    angle,
    angular_velocity,
    array,
    blob,
    boolean,
    choice,
    count,
    integer,
    length,
    magnetic_field,
    many,
    number,
    percent,
    text,
    velocity,
)
from rems_net.defdict.wire.cdr import cdr
from rems_net.defdict.wire.ros2msg import ros2msg

FOLDER = Path(__file__).parent.parent / "golden" / "defdict"

_wheel = angular_velocity("rad/s", range=(-6.8, 6.8), max_age=0.5)
_spot = Schema("spot", {"x": length("m"), "id": integer()})

CASES: dict[str, tuple[Schema, dict[str, Any]]] = {
    "woodbot_command": (
        Schema("woodbot.command", {"wheel": {"left": _wheel, "right": _wheel}}),
        {"wheel/left": 6.8, "wheel/right": -1.25},
    ),
    "pose": (
        Schema("pose", {"x": length("m"), "y": length("m"), "theta": angle("rad")}),
        {"x": 0.25, "y": -0.0, "theta": 3.141592653589793},
    ),
    "woodbot_sensors": (
        Schema(
            "woodbot.sensors",
            {
                "lidar": {
                    "front": length("mm", range=(0, 8190)),
                    "right": length("mm", range=(0, 8190)),
                },
                "mag": {"x": magnetic_field("uT"), "y": magnetic_field("uT")},
                "gyro": {"z": angular_velocity("rad/s")},
            },
        ),
        {"lidar/front": 250.0, "lidar/right": 8190.0, "mag/x": -12.5, "gyro/z": 1e-3},
    ),
    "every_kind": (
        Schema(
            "every.kind",
            {
                "float": number("m/s**2", default=9.81, doc="down"),
                "percent": percent(range=(0, 100)),
                "whole": integer(range=(-(2**40), 2**40)),
                "count": count(table=[(0, 0.2), (4095, 0.0)], means="m"),
                "yes": boolean(default=True),
                "word": text(max_len=40),
                "bytes": blob(max_len=8),
                "mode": choice("euler", "rk4"),
                "vector": array(3, "m/s", range=(-2, 2), dtype="f4"),
                "matrix": array((2, 2), dtype="u2", default=[[1, 2], [3, 4]]),
                "bits": array(4, dtype="bool"),
                "spots": many(_spot, max_len=3),
                "deep": {"er": {"still": velocity("km/hr")}},
            },
        ),
        {
            "percent": 12.5,
            "whole": -1_000_000,
            "count": 4095,
            "word": "grüezi",
            "bytes": b"\x00\xff",
            "mode": "rk4",
            "vector": [0.5, -0.5, 2],
            "bits": [True, False, True, True],
            "spots": [{"x": 1, "id": 7}, {"x": 2, "id": -8}],
            "deep/er/still": 36,
        },
    ),
    "sixteen": (
        Schema("sixteen", {f"field_{n:02}": number() for n in range(16)}),
        {"field_15": 1.5},
    ),
}


def write() -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, (schema, values) in CASES.items():
        (FOLDER / f"{name}.schema").write_bytes(schema.to_wire())
        (FOLDER / f"{name}.payload").write_bytes(schema(values).encode())
        (FOLDER / f"{name}.digest").write_bytes(schema.digest.encode())
        (FOLDER / f"{name}.cdr").write_bytes(cdr(schema).encode(schema(values)))
        text = ros2msg("state", schema)
        (FOLDER / f"{name}.msg").write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    write()
