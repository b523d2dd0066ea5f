"""Readings: a Create 2's packets as fields with units, and why it stops by itself."""

from collections.abc import Mapping
from typing import Any

from rems_net.defdict import (
    Schema,
    boolean,
    charge,
    choice,
    current,
    integer,
    ratio,
    temperature,
    voltage,
)
from rems_net.drivers.hardware.create2.packets import (
    BITS,
    CAPACITY,
    CHARGING,
    MODES,
    VOLTAGE,
    bit,
)
from rems_net.drivers.hardware.odometry import Odometer

SIDES = ("left", "right")
#: places of the cliff sensors, and of the light bumpers, from left to right
CLIFFS = ("left", "front_left", "front_right", "right")
LIGHTS = BITS["light_bumps"]
BUTTONS = ("clean", "spot", "dock")
#: counts. Highest signal of a cliff sensor or light bumper, and of the wall sensor.
SIGNAL, WALL = 4095, 1023

_SHARE = ratio(range=(0, 1), doc="of the most it can measure: 4095 counts, wall 1023")
#: fields that only the device has; the definition has those that a simulation has, too
STATUS = Schema(
    "create2.status",
    {
        "mode": choice(*MODES, doc="of the Open Interface"),
        "wheel_drop": {side: boolean(doc="the wheel hangs") for side in SIDES},
        "light": {place: boolean(doc="something is near") for place in LIGHTS},
        "signal": {
            "wall": _SHARE,
            "cliff": dict.fromkeys(CLIFFS, _SHARE),
            "light": dict.fromkeys(LIGHTS, _SHARE),
        },
        "wall": boolean(doc="on its right"),
        "virtual_wall": boolean(doc="the beam of one"),
        "infrared": {
            side: integer(doc="character of a beam, 0 for none")
            for side in ("omni", *SIDES)
        },
        "button": {name: boolean(doc="pressed") for name in BUTTONS},
        "motor": {side: current(doc="of the wheel's motor") for side in SIDES},
        "overcurrent": {side: boolean(doc="of the wheel's motor") for side in SIDES},
        "battery": {
            "voltage": voltage(),
            "current": current(doc="negative while it discharges"),
            "charge": charge(doc="left in it; 1 mAh is 3.6 A*s"),
            "capacity": charge(doc="of a full one, as the robot takes it"),
            "temperature": temperature(),
            "charging": choice(*CHARGING),
            "impossible": integer(doc="values above that cannot be, and were left out"),
        },
        "charger": {
            "plug": boolean(doc="in its socket"),
            "dock": boolean(doc="it stands on its home base"),
        },
        "song_playing": boolean(),
    },
)


def numbers() -> tuple[int, ...]:
    """Return the numbers of the packets to stream: all but the unused ones.

    19 and 20 are wrong in some firmware (appendix B); the encoders replace them.
    """
    unused = {15, 16, 19, 20, 32, 33, 36, 38, 39, 40, 56, 57, 58}
    return tuple(number for number in range(7, 59) if number not in unused)


def sensors(values: Mapping[str, int], path: Odometer) -> dict[str, Any]:
    """Return the sensors that simulations of a Create 2 have, too."""
    found: dict[str, Any] = {}
    for side, turned in zip(SIDES, (path.left, path.right), strict=True):
        found[f"encoder/{side}"] = turned
        found[f"bumper/{side}"] = bit(values, "bumps_and_wheel_drops", f"bump_{side}")
    for place in CLIFFS:
        found[f"cliff/{place}"] = bool(values[f"cliff_{place}"])
    return found


def status(values: Mapping[str, int]) -> dict[str, Any]:
    """Return the fields of STATUS. Raises IndexError for an unknown mode."""
    found: dict[str, Any] = {
        "mode": MODES[values["mode"]],
        "wall": bool(values["wall"]),
        "virtual_wall": bool(values["virtual_wall"]),
        "signal/wall": min(values["wall_signal"] / WALL, 1.0),
        "infrared/omni": values["infrared_omni"],
        **battery(values),
        "battery/current": values["current"] / 1000,
        "battery/temperature": float(values["temperature"]),
        "battery/charging": CHARGING[values["charging"]],
        "charger/plug": bool(values["chargers"] & 1),
        "charger/dock": bool(values["chargers"] & 2),
        "song_playing": bool(values["song_playing"]),
    }
    for place in CLIFFS:
        found[f"signal/cliff/{place}"] = _share(values[f"cliff_{place}_signal"])
    for place in LIGHTS:
        found[f"light/{place}"] = bit(values, "light_bumps", place)
        found[f"signal/light/{place}"] = _share(values[f"light_{place}"])
    for name in BUTTONS:
        found[f"button/{name}"] = bit(values, "buttons", name)
    for side in SIDES:
        hangs = bit(values, "bumps_and_wheel_drops", f"drop_{side}")
        found[f"wheel_drop/{side}"] = hangs
        found[f"overcurrent/{side}"] = bit(values, "overcurrents", f"wheel_{side}")
        found[f"motor/{side}"] = values[f"motor_{side}"] / 1000
        found[f"infrared/{side}"] = values[f"infrared_{side}"]
    return found


#: fields that `battery` returns, if all are possible
BATTERY = ("battery/voltage", "battery/charge", "battery/capacity")
#: times its capacity. A new battery may hold more than the robot expects.
FULLEST = 1.5


def battery(values: Mapping[str, int]) -> dict[str, float]:
    """Return those fields of BATTERY that a battery can have.

    Robots with another battery report such as 65,529 mAh of 2,696, or 0 of 0.
    """
    found = {}
    if values["voltage"] in VOLTAGE:
        found["battery/voltage"] = values["voltage"] / 1000
    if values["capacity"] in CAPACITY:
        found["battery/capacity"] = values["capacity"] * 3.6
        if values["charge"] <= FULLEST * values["capacity"]:
            found["battery/charge"] = values["charge"] * 3.6
    return found


def _share(signal: int) -> float:
    return min(signal / SIGNAL, 1.0)


#
# A robot in Safe mode protects itself: at a cliff, when it is lifted, when its charger
# is plugged in. As long as the cause remains, we must not set its mode again: with a
# command to go ahead at the edge of a table, it would creep over it, step by step.


def lifted(values: Mapping[str, int]) -> bool:
    """Return whether a wheel hangs."""
    return any(bit(values, "bumps_and_wheel_drops", f"drop_{side}") for side in SIDES)


def at_a_cliff(values: Mapping[str, int]) -> bool:
    """Return whether a cliff sensor sees no floor."""
    return any(values[f"cliff_{place}"] for place in CLIFFS)


def reason(values: Mapping[str, int]) -> str:
    """Return why the robot has left its mode, and what the user can do."""
    if lifted(values):
        return "a wheel hangs. Put it on the floor; it goes on from there."
    if values["chargers"]:
        return "it is at its charger. Pull that out; it goes on then."
    if at_a_cliff(values):
        return "there is no floor ahead. Drive it back, or carry it away."
    return (
        f"it is in mode {MODES[values['mode'] % len(MODES)]}, by a button or a broken "
        "command; it goes on by itself."
    )


def allows(values: Mapping[str, int], speeds: tuple[int, int]) -> bool:
    """Return whether the robot may safely obey these speeds (right, left), mm/s."""
    if lifted(values) or values["chargers"]:
        return False
    return not at_a_cliff(values) or max(speeds) <= 0
