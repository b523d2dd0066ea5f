"""Answers: what is at a serial port, found out by asking it as each device is asked.

Nothing that is asked moves anything. A Create 2 that was driven, by a program that is
gone, stands afterwards.
"""

import time
from collections.abc import Callable
from contextlib import closing
from importlib.util import find_spec

from rems_net.cable.console import Console
from rems_net.cable.port import Line, open_port
from rems_net.drivers.hardware.create2 import packets
from rems_net.drivers.hardware.create2.commands import FLUSH, Op
from rems_net.drivers.hardware.create2.waking import USUAL, all_sensors
from rems_net.drivers.hardware.dynamixel.bus import Bus
from rems_net.drivers.hardware.dynamixel.table import named
from rems_net.errors import FabricError

#: of DYNAMIXEL servos: as the drivers expect it, and as they leave the factory
DYNAMIXEL_BAUDS = (1_000_000, 57_600, 4_000_000)
#: seconds that a Woodbot is asked for
WOODBOT = 2.0


def who(device: str) -> str:
    """What answers at a port, in a few words; "" if nothing that is known here.

    Raises FabricError where the port can't be opened.
    """
    return next(filter(None, (ask(device) for ask in ASKED)), "")


def create2(device: str) -> str:
    """Whether a Create 2 does, and how its battery is."""
    for baud in 2 * USUAL:  # twice: an answer comes late through a busy laptop
        with closing(open_port(device, baud)) as line:
            said = _create2(line)
        if said:
            slow = "" if baud == USUAL[0] else f", options baud = {baud}"
            return f"Create 2 ({said}{slow})"
    return ""


def _create2(line: Line) -> str:
    _tell(line, FLUSH + bytes([Op.PAUSE, 0]))
    line.read(line.in_waiting)
    before = all_sensors(line)
    if not before:
        _tell(line, bytes([Op.START]))
    values = before or all_sensors(line)
    if not values:
        return ""
    if not before:
        _tell(line, bytes([Op.STOP]))  # as it was
    mode = packets.MODES[values["mode"]] if before else "off"
    share = values["charge"] / values["capacity"]
    return f"{mode}, battery {values['voltage'] / 1000:.1f} V, {share:.0%}"


def _tell(line: Line, command: bytes) -> None:
    line.write(command)
    time.sleep(0.03)  # it obeys, and what it was still saying has come


def woodbot(device: str) -> str:
    """Whether a Woodbot with this project's firmware does, and which."""
    with closing(open_port(device)) as line:
        console = Console(line)
        try:
            console.find(device, WOODBOT)
            firmware, version, chip, name = [*console.info(), "", "", "", ""][:4]
        except (FabricError, TimeoutError):
            return ""
    return f"Woodbot {name} ({firmware} {version} on {chip})"


def dynamixel(device: str) -> str:
    """Whether DYNAMIXEL servos do, and which; "" where their library is missing."""
    if find_spec("dynamixel_sdk") is None:
        return ""
    for baud in DYNAMIXEL_BAUDS:
        with closing(open_port(device, baud)) as line:
            found = Bus(line, device, {}).present()
        if found:
            alike: dict[int, list[str]] = {}
            for servo, model in found.items():
                alike.setdefault(model, []).append(str(servo))
            each = [f"{', '.join(ids)}: {named(m)}" for m, ids in alike.items()]
            return f"DYNAMIXEL servos {'; '.join(each)}, at options baud = {baud}"
    return ""


#: in this order: what is a question to one must not be an order to the next
ASKED: tuple[Callable[[str], str], ...] = (create2, woodbot, dynamixel)
