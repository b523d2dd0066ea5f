"""Finding: checks that the right servos are there, and what to do if they are not."""

from collections.abc import Iterable, Mapping
from contextlib import suppress

from rems_net.drivers.hardware.driven import NoDeviceError
from rems_net.drivers.hardware.dynamixel.bus import Bus
from rems_net.drivers.hardware.dynamixel.table import BAUDS, MODELS, named

#: s. A servo restarts within this.
REBOOT = 3.0
#: IDs that a message lists, at most
SHOWN = 6
#: possible cause if no unexpected servo answers
TWO = "two that have the same talk at once, or seem to be one"


def find(
    bus: Bus, servos: Iterable[int], models: Mapping[int, str], closely: bool
) -> None:
    """Raise NoDeviceError if a servo is missing, or of a model not in `models`.

    closely: take a second or two to find the cause.
    """
    found: dict[int, int | None] = {}
    for servo in servos:
        found[servo] = bus.ping(servo)
        if found[servo] is None and not closely:
            raise NoDeviceError(f"{bus.name(servo)} does not answer")
    some = any(found.values())
    present = bus.present() if some and None in found.values() else {}
    # A servo that was too slow for ping(), on a busy machine, may have answered here.
    found = {servo: model or present.get(servo) for servo, model in found.items()}
    if wrong := [i for i, model in found.items() if model and model not in models]:
        there = (present or bus.present()) if closely else {}
        raise NoDeviceError(_stranger(bus, wrong[0], found, there, models))
    silent = [servo for servo, model in found.items() if model is None]
    if not silent:
        return
    if not some:
        raise NoDeviceError(_none(bus, list(found), models))
    answer = [servo for servo in found if servo not in silent]
    others = {servo: m for servo, m in present.items() if servo not in found}
    raise NoDeviceError(_some(bus, answer, silent, others))


def _stranger(
    bus: Bus,
    servo: int,
    found: Mapping[int, int | None],
    there: Mapping[int, int],
    models: Mapping[int, str],
) -> str:
    """Return what to check if a servo is of an unexpected model.

    found: models of the servos that are needed.  there: models of all that answer
    """
    model = found[servo] or 0
    series = "one of the X430 series: " if len(models) > 1 else ""
    whose = f"there are the servos {_ids(there)}, and {_ids(found)} are needed"
    checks = [f"whether this is another robot: {whose}"] if {*there} - {*found} else []
    checks.append(
        "which servo has this ID, with DYNAMIXEL Wizard: IDs may have been swapped"
    )
    if name := MODELS.get(model):
        checks.append(
            f'if your robot is made so, write options = {{ model = "{name}" }}'
        )
    return (
        f"{bus.name(servo)} reports at {bus.baud} bits per second that it is "
        f"{named(model)}; expected {series}{', '.join(models.values())}. Check, in "
        f"this order: {'; '.join(f'{i}. {one}' for i, one in enumerate(checks, 1))}."
    )


def _none(bus: Bus, needed: list[int], models: Mapping[int, str]) -> str:
    """Return what to check if no servo answers."""
    asked = bus.baud
    if elsewhere := _elsewhere(bus, needed[:2]):
        servo, baud = elsewhere
        there = bus.present()
        if there.get(servo, 0) not in {0, *models}:
            known = {needs: there.get(needs) for needs in needed}
            return _stranger(bus, servo, known, there, models)
        other = (
            f" Or is it another robot? There are the servos {_ids(there)}; "
            f"{_ids(needed)} are needed."
        )
        return (
            f"no servo answers at {bus.port} at {asked} bits per second, but "
            f"{bus.name(servo)} does at {baud}. Set options = {{ baud = {baud} }}, or "
            f"set the Baud Rate of the servos to {asked} with DYNAMIXEL Wizard."
            + (other if {*there} != {*needed} else "")
        )
    return (
        f"no servo answers at {bus.port}, at {asked} bits per second or another usual "
        "speed. Check, in this order: 1. that the servos have power of their own: the "
        "LED of each blinks once when they are switched on; 2. that this is the port "
        f"of their adapter: rems board ports {bus.port}; 3. the cable from the "
        "adapter to the first servo; 4. a switch at the adapter: TTL for cables of "
        "three wires, RS-485 for four; 5. the IDs and the protocol, 2.0, with "
        "DYNAMIXEL Wizard."
    )


def _some(
    bus: Bus, answer: list[int], silent: list[int], others: Mapping[int, int]
) -> str:
    """Return what to check if some servos answer and some do not.

    others: models of unexpected servos
    """
    strangers = [f"servo {i}, {named(model)}" for i, model in others.items()]
    known = f"there is {' and '.join(strangers)}, that is not asked for"
    return (
        f"{_listed(bus, silent)} {_do(silent)} not answer at {bus.baud} bits per "
        f"second; {_listed(bus, answer)} {_do(answer)}. Check, in this order: 1. the "
        "cable to it, from one servo to the next; 2. that its LED blinks when it is "
        f"switched on; 3. its ID: {known if others else TWO}; 4. its Baud Rate; both "
        "with DYNAMIXEL Wizard."
    )


def _elsewhere(bus: Bus, silent: Iterable[int]) -> tuple[int, int] | None:
    """Return the first servo that answers at another speed, and set that speed."""
    own = bus.baud
    for baud in (baud for baud in BAUDS if baud != own):
        with suppress(OSError, ValueError):  # more than this port can
            bus.tune(baud)
            for servo in silent:
                if bus.ping(servo, tries=1) is not None:
                    return servo, baud
    bus.tune(own)
    return None


def _ids(servos: Iterable[int]) -> str:
    """Return the IDs; of many, the first ones."""
    each = [str(servo) for servo in servos]
    more = f" and {len(each) - SHOWN} others" if len(each) > SHOWN else ""
    return ", ".join(each[:SHOWN]) + more


def _listed(bus: Bus, servos: list[int]) -> str:
    """Return the names; of many, the first, and how many others."""
    if len(servos) > 3:
        return f"{bus.name(servos[0])} and {len(servos) - 1} others"
    return " and ".join(bus.name(servo) for servo in servos)


def _do(servos: list[int]) -> str:
    return "does" if len(servos) == 1 else "do"
