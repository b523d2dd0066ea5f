"""Commands: the sentences for an emulator, such as `unplug 5`."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from rems_net.errors import ExperimentError, nearest

if TYPE_CHECKING:
    from rems_net.emulators.emulator import Emulator

#: Word -> what follows it, and what it does.
KNOWN = {
    "lose": ("SHARE", "of the packets are lost, such as 0.05"),
    "drop": ("SHARE", "of the packets lose a byte"),
    "corrupt": ("SHARE", "of the packets have a wrong bit"),
    "late": ("SECONDS", "that every packet takes longer"),
    "echo": ("", "what the device receives comes back first"),
    "unplug": ("SECONDS", "without a line; the device goes on"),
    "brownout": ("SECONDS", "without power; the line stays"),
    "reset": ("", "the device starts anew"),
    "fine": ("", "nothing goes wrong any more"),
}
SHARES = ("lose", "drop", "corrupt")
#: s. Longest outage.
MOST = 3600.0


def known(emulator: "Emulator[Any]") -> list[str]:
    """Return the sentences that are known: `unplug SECONDS`, `bump left|right`."""
    own = emulator.device.words.items()
    return [
        *(f"{name} {_listed(ways)}".strip() for name, ways in own),
        *(f"{name} {what}".strip() for name, (what, _) in KNOWN.items()),
    ]


def read(emulator: "Emulator[Any]", words: str) -> Callable[[], None]:
    """Return a function that does what the words mean. Raises ExperimentError.

    A share may be followed by `heard`: then it damages the packets to the device,
    instead of those from it.
    """
    name, *rest = words.split() or [""]
    own: Mapping[str, Mapping[str, Callable[[], None]]] = emulator.device.words
    if name in own:
        word, ways = " ".join(rest), own[name]
        if word not in ways:
            expected = ", ".join(f"{name} {way}".strip() for way in ways)
            raise ExperimentError(
                f"{name} {word!r} can't happen; expected: {expected}. (R0716)"
            )
        return ways[word]
    if name not in KNOWN:
        names = [*KNOWN, *own]
        raise ExperimentError(
            f"{name!r} is nothing that can happen to it; expected one of "
            f"{', '.join(names)}.{nearest(name, names)} (R0716)"
        )
    heard = name in SHARES and rest[-1:] == ["heard"]
    rest = rest[:-1] if heard else rest
    if len(rest) != bool(KNOWN[name][0]):
        raise ExperimentError(f"expected: {' '.join((name, KNOWN[name][0]))} (R0716)")
    value = _number(name, rest[0]) if rest else 0.0
    match name:
        case "echo":
            return lambda: setattr(emulator, "echo", True)
        case "unplug":
            return lambda: emulator.unplug(value)
        case "brownout" | "reset":
            return lambda: emulator.brown_out(value)
        case "fine":
            return emulator.clear
    faults = emulator.heard if heard else emulator.said
    return lambda: setattr(faults, name, value)


def _listed(ways: Mapping[str, object]) -> str:
    """Return what can follow a word; of many, such as servo IDs, the first and last."""
    named = [way for way in ways if way]
    return "|".join(named if len(named) <= 8 else [*named[:2], "...", named[-1]])


def _number(name: str, word: str) -> float:
    most = 1.0 if name in SHARES else MOST
    try:
        value = float(word)
    except ValueError:
        value = -1.0
    if not 0 <= value <= most:
        raise ExperimentError(
            f"{name} is {word!r}; expected a number, 0 to {most:g}. (R0716)"
        )
    return value
