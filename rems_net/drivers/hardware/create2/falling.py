"""Falling: a Create 2 that has left its mode and stands; why, and when it may go on.

A robot in Safe mode protects itself: at a cliff, when it is lifted, when its charger is
plugged in. It must not be sent back as long as it would only fall again: told to go
ahead at the edge of a table, it would creep over it, a little each time.
"""

from collections.abc import Mapping

from rems_net.drivers.hardware.create2.packets import MODES, bit
from rems_net.drivers.hardware.create2.readings import CLIFFS, SIDES


def lifted(values: Mapping[str, int]) -> bool:
    """Whether a wheel hangs."""
    return any(bit(values, "bumps_and_wheel_drops", f"drop_{side}") for side in SIDES)


def at_a_cliff(values: Mapping[str, int]) -> bool:
    """Whether there is no floor in front of it."""
    return any(values[f"cliff_{place}"] for place in CLIFFS)


def reason(values: Mapping[str, int]) -> str:
    """Why it has left its mode, and what to do."""
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
    """Whether it may obey these speeds (right, left) without falling again."""
    if lifted(values) or values["chargers"]:
        return False
    return not at_a_cliff(values) or max(speeds) <= 0
