"""Finding: whether the right servos are there, and what to check if they are not."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress

from rems_net.drivers.hardware.driven import NoDeviceError
from rems_net.drivers.hardware.dynamixel.bus import Bus
from rems_net.drivers.hardware.dynamixel.table import BAUDS, MODELS, named

#: seconds that a servo may take to start anew
REBOOT = 3.0


def find(bus: Bus, servos: Iterable[int], closely: bool) -> None:
    """Raise NoDeviceError if not all of these are there.

    closely: take a second or two to find out what is wrong.
    """
    answer, silent = [], []
    for servo in servos:
        model = bus.ping(servo)
        if model is None:
            silent.append(servo)
            if not closely:
                break
        elif model in MODELS:
            answer.append(servo)
        else:
            raise NoDeviceError(
                f"{bus.name(servo)} says that it is {named(model)}; expected one of "
                f"the X430 series: {', '.join(MODELS.values())}. Check which servo has "
                "this ID, with DYNAMIXEL Wizard: IDs may have been swapped."
            )
    if not silent:
        return
    if not closely:
        raise NoDeviceError(f"{bus.name(silent[0])} does not answer")
    raise NoDeviceError(
        _some(bus, answer, silent) if answer else _none(bus, silent[:2])
    )


def _none(bus: Bus, silent: list[int]) -> str:
    """What to check where no servo answers."""
    asked, place = bus.baud, f"at {bus.port}"
    for baud in BAUDS:
        with suppress(OSError, ValueError):  # more than this port can
            bus.tune(baud)
            heard = [servo for servo in silent if bus.ping(servo, tries=1) is not None]
            if heard:
                return (
                    f"no servo answers {place} at {asked} bits per second, but "
                    f"{bus.name(heard[0])} does at {baud}. Say options = "
                    f"{{ baud = {baud} }}, or set the Baud Rate of the servos to "
                    f"{asked} with DYNAMIXEL Wizard."
                )
    bus.tune(asked)
    return (
        f"no servo answers {place}, at {asked} bits per second or another usual speed. "
        "Check, in this order: 1. that the servos have power of their own: the LED of "
        "each blinks once when they are switched on; 2. that this is the port of their "
        "adapter: rems ports; 3. the cable from the adapter to the first servo; 4. a "
        "switch at the adapter: TTL for cables of three wires, RS-485 for four; 5. the "
        "IDs and the protocol, 2.0, with DYNAMIXEL Wizard."
    )


def _some(bus: Bus, answer: list[int], silent: list[int]) -> str:
    """What to check where some answer and some do not."""
    others = {i: m for i, m in bus.present().items() if i not in answer}
    strangers = [f"servo {i}, {named(model)}" for i, model in others.items()]
    known = f"there is {' and '.join(strangers)}, that is not asked for"
    return (
        f"{_listed(bus, silent)} {_do(silent)} not answer at {bus.baud} bits per "
        f"second; {_listed(bus, answer)} {_do(answer)}. Check, in this order: 1. the "
        "cable to it, from one servo to the next; 2. that its LED blinks when it is "
        f"switched on; 3. its ID{f': {known}' if others else ''}; 4. its Baud Rate, "
        "with DYNAMIXEL Wizard."
    )


def _listed(bus: Bus, servos: list[int]) -> str:
    return " and ".join(bus.name(servo) for servo in servos)


def _do(servos: list[int]) -> str:
    return "does" if len(servos) == 1 else "do"
