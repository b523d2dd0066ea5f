"""Port: a serial port, opened without waking or holding the board behind it."""

import sys
from typing import Protocol

from rems_net.drivers.hardware import ports
from rems_net.drivers.hardware.ports import refusal
from rems_net.errors import FabricError
from rems_net.libraries import load

#: bit/s of the console; of the console while the cable is also the network.
BAUDS = (115_200, 921_600)


class Line(ports.Line, Protocol):
    """A serial line with a timeout, s."""

    timeout: float | None


def open_port(device: str, baud: int = BAUDS[0]) -> Line:
    """Open a port for this program alone; a read waits for at most 50 ms.

    Raises FabricError with the reason: not there, not permitted, in use.
    """
    library = load("serial", "hardware")
    line = library.Serial()
    line.port, line.baudrate = device, baud
    line.timeout, line.write_timeout = 0.05, 2.0
    # On most boards, these two lines hold the chip in reset, or start its loader.
    line.dtr = line.rts = False
    line.exclusive = None if sys.platform == "win32" else True
    try:
        line.open()
    except Exception as error:  # also termios.error, which is no OSError
        raise FabricError(f"{refusal(device, error)} (R0701)") from None
    opened: Line = line
    return opened
