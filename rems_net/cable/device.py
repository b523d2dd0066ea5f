"""Device: identify the device at a serial port by a query in its own protocol.

No query moves anything. But a Create 2 stands still afterwards, if a program that has
ended left it driving.
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

#: bit/s of DYNAMIXEL servos: the drivers' default, the factory's, and the fastest.
DYNAMIXEL_BAUDS = (1_000_000, 57_600, 4_000_000)
#: s. How long a Woodbot may take to answer.
WOODBOT = 2.0


def who(device: str) -> str:
    """Return a short description of the device at a port; "" if it is unknown.

    Raises FabricError if the port can't be opened.
    """
    return next(filter(None, (ask(device) for ask in ASKED)), "")


def create2(device: str) -> str:
    """Return the state of a Create 2 at this port; "" if there is none."""
    for baud in 2 * USUAL:  # twice: on a busy laptop an answer may come late
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
    time.sleep(0.03)  # time to obey, and for the rest of an earlier answer to arrive


def woodbot(device: str) -> str:
    """Return name and firmware of a Woodbot at this port; "" if there is none."""
    with closing(open_port(device)) as line:
        console = Console(line)
        try:
            console.find(device, WOODBOT)
            firmware, version, chip, name = [*console.info(), "", "", "", ""][:4]
        except (FabricError, TimeoutError):
            return ""
    return f"Woodbot {name} ({firmware} {version} on {chip})"


def dynamixel(device: str) -> str:
    """Return the DYNAMIXEL servos at this port; "" without servos, or their library."""
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


#: In this order, so that no query is a command for a device that comes later.
ASKED: tuple[Callable[[str], str], ...] = (create2, woodbot, dynamixel)
