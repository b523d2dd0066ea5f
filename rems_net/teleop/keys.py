"""Keys: which keys people hold down, and the stick that these keys stand for."""

from collections.abc import Set

from rems_net.defdict import Rule, Schema, boolean
from rems_net.teleop.stick import STICK

#: percent. Deflection of the stick by a key; SLOW with shift, FAST without.
FAST, SLOW = 60.0, 20.0

#: key -> axis of the stick and its sign. Arrows and w, a, s, d are the same.
MOTIONS = {
    "up": ("ahead", 1),
    "down": ("ahead", -1),
    "left": ("turn", 1),
    "right": ("turn", -1),
    "w": ("ahead", 1),
    "s": ("ahead", -1),
    "a": ("turn", 1),
    "d": ("turn", -1),
    "q": ("left", 1),
    "e": ("left", -1),
}
#: keys that are no motion: slower, and everything at rest
SHIFT, SPACE = "shift", "space"
#: names of all keys that are reported
KEYS = (*MOTIONS, SHIFT, SPACE)


KEYBOARD = Schema(
    "keyboard", dict.fromkeys(KEYS, boolean(doc="whether it is held down"))
)


def stick_of(held: Set[str]) -> dict[str, float]:
    """Return the stick's axes for the keys that are held down, in percent.

    Opposite keys cancel out. With space held, the stick is at rest.
    """
    axes = dict.fromkeys(STICK.paths, 0.0)
    if SPACE in held:
        return axes
    most = SLOW if SHIFT in held else FAST
    for key in held & MOTIONS.keys():
        axis, sign = MOTIONS[key]
        axes[axis] += sign * most
    return {axis: max(-most, min(most, value)) for axis, value in axes.items()}


def _stick(keys: object) -> dict[str, float]:
    return stick_of({name for name in KEYS if keys[name]})  # type: ignore[index]


KEYS_RULE = Rule("keys to stick", KEYBOARD, STICK, _stick)
