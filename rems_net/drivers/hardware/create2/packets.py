"""The sensor packets of the Open Interface: their numbers, sizes and names.

All are big-endian. Source: iRobot Create 2 Open Interface Specification based on the
Roomba 600, 2016.
"""

import struct
from collections.abc import Iterable, Mapping
from functools import lru_cache

#: name and format (in the letters of `struct`) of each packet, by number
PACKETS: dict[int, tuple[str, str]] = {
    7: ("bumps_and_wheel_drops", "B"),
    8: ("wall", "B"),
    9: ("cliff_left", "B"),
    10: ("cliff_front_left", "B"),
    11: ("cliff_front_right", "B"),
    12: ("cliff_right", "B"),
    13: ("virtual_wall", "B"),
    14: ("overcurrents", "B"),
    15: ("dirt", "B"),
    16: ("unused_16", "B"),
    17: ("infrared_omni", "B"),
    18: ("buttons", "B"),
    19: ("distance", "h"),  # mm since it was read last
    20: ("angle", "h"),  # degrees since it was read last
    21: ("charging", "B"),
    22: ("voltage", "H"),  # mV
    23: ("current", "h"),  # mA, negative while it discharges
    24: ("temperature", "b"),  # degC
    25: ("charge", "H"),  # mAh
    26: ("capacity", "H"),  # mAh
    27: ("wall_signal", "H"),
    28: ("cliff_left_signal", "H"),
    29: ("cliff_front_left_signal", "H"),
    30: ("cliff_front_right_signal", "H"),
    31: ("cliff_right_signal", "H"),
    32: ("unused_32", "B"),
    33: ("unused_33", "H"),
    34: ("chargers", "B"),
    35: ("mode", "B"),
    36: ("song", "B"),
    37: ("song_playing", "B"),
    38: ("stream_packets", "B"),
    39: ("requested_velocity", "h"),  # mm/s
    40: ("requested_radius", "h"),  # mm
    41: ("requested_right", "h"),  # mm/s
    42: ("requested_left", "h"),  # mm/s
    43: ("encoder_left", "h"),  # counts, past 32767 on from -32768
    44: ("encoder_right", "h"),
    45: ("light_bumps", "B"),
    46: ("light_left", "H"),
    47: ("light_front_left", "H"),
    48: ("light_centre_left", "H"),
    49: ("light_centre_right", "H"),
    50: ("light_front_right", "H"),
    51: ("light_right", "H"),
    52: ("infrared_left", "B"),
    53: ("infrared_right", "B"),
    54: ("motor_left", "h"),  # mA
    55: ("motor_right", "h"),
    56: ("motor_main_brush", "h"),
    57: ("motor_side_brush", "h"),
    58: ("stasis", "B"),
}
#: possible values of a Create 2: mV of its battery, mAh of a full one
VOLTAGE, CAPACITY = range(5_000, 25_000), range(500, 10_000)
NUMBERS = {name: number for number, (name, _) in PACKETS.items()}

#: first and last packet of each group
GROUPS = {
    0: (7, 26),
    1: (7, 16),
    2: (17, 20),
    3: (21, 26),
    4: (27, 34),
    5: (35, 42),
    6: (7, 42),
    100: (7, 58),
    101: (43, 58),
    106: (46, 51),
    107: (54, 58),
}
#: names of packets' bits, lowest bit first
BITS: dict[str, tuple[str, ...]] = {
    "bumps_and_wheel_drops": ("bump_right", "bump_left", "drop_right", "drop_left"),
    "overcurrents": ("side_brush", "main_brush", "", "wheel_right", "wheel_left"),
    "buttons": ("clean", "spot", "dock", "minute", "hour", "day", "schedule", "clock"),
    "light_bumps": (
        *("left", "front_left", "centre_left"),
        *("centre_right", "front_right", "right"),
    ),
}
#: counts per turn of a wheel; and counts after which an encoder starts again
COUNTS, WRAP = 508.8, 1 << 16
#: names of the values of packets 35 and 21
MODES = ("off", "passive", "safe", "full")
CHARGING = ("no", "reconditioning", "full_charging", "trickle", "waiting", "fault")


def members(number: int) -> tuple[int, ...]:
    """Return the packets of a group, or a packet itself. Raises KeyError."""
    if number in PACKETS:
        return (number,)
    first, last = GROUPS[number]
    return tuple(range(first, last + 1))


@lru_cache(maxsize=64)
def form(number: int) -> struct.Struct:
    """Return the format of the data of a packet or group."""
    return struct.Struct(">" + "".join(PACKETS[one][1] for one in members(number)))


def unpack(number: int, data: bytes) -> dict[str, int]:
    """Return the values of a packet or group, by name."""
    names = (PACKETS[one][0] for one in members(number))
    return dict(zip(names, form(number).unpack(data), strict=True))


def pack(number: int, values: Mapping[str, int]) -> bytes:
    """Return the data of a packet or group."""
    return form(number).pack(*(values[PACKETS[one][0]] for one in members(number)))


def bit(values: Mapping[str, int], packet: str, name: str) -> bool:
    """Return whether a bit of a packet is set."""
    return bool(values[packet] >> BITS[packet].index(name) & 1)


def bits(packet: str, names: Iterable[str]) -> int:
    """Return the value of a packet in which these bits are set."""
    return sum(1 << BITS[packet].index(name) for name in names)
