"""Bus: servos on one half-duplex line, by the packets of the DYNAMIXEL SDK."""

from collections.abc import Callable, Iterable, Mapping
from typing import TypeVar

from rems_net.agents.wall import wall
from rems_net.drivers.hardware.driven import NoDeviceError
from rems_net.drivers.hardware.dynamixel import table
from rems_net.drivers.hardware.dynamixel.table import ALERT, Register
from rems_net.drivers.hardware.ports import Line
from rems_net.errors import WireError
from rems_net.libraries import load

#: how often a servo is called, and how often one that is there is told or asked what
#: is not said in every exchange
CALLS, TRIES = 3, 6
#: bits on the line for a byte: start, eight, stop
BITS = 10

Result = TypeVar("Result")
#: the value of each register of a servo, at one moment
Said = Callable[[Register], int]


class Bus:
    """Reads and writes registers of servos.

    port: what the line is called.  names: what each servo moves, by ID. Both are for
    what is told.

    Raises TimeoutError where a servo does not answer, WireError where a packet is
    damaged, NoDeviceError where a servo refuses, and OSError where the line is broken.
    """

    def __init__(self, line: Line, port: str, names: Mapping[int, str]):
        self._names = names
        self.port = port
        #: servos that have said that something is wrong with them
        self.alerts: set[int] = set()
        #: packets that were lost or damaged
        self.damaged = 0
        self._sdk = sdk = load("dynamixel_sdk", "hardware")
        self._packets = sdk.PacketHandler(2.0)
        # Its own openPort() would open the port for others, too, and wait for a packet
        # by asking again and again, without a pause.
        self._line = line
        self._port = handler = sdk.PortHandler(port)
        handler.ser, handler.is_open = line, True
        # reset_input_buffer() raises termios.error where a device was unplugged.
        handler.clearPort = lambda: line.read(line.in_waiting)
        # Its own clock is the time of day, which can be set.
        handler.getCurrentTime = lambda: wall() * 1e3
        self.tune(line.baudrate)

    @property
    def baud(self) -> int:
        """Bits per second."""
        return int(self._port.baudrate)

    def tune(self, baud: int) -> None:
        """Speak at another speed. Raises OSError or ValueError if the port can't."""
        try:
            if self._line.baudrate != baud:
                self._line.baudrate = baud
        except (OSError, ValueError):
            raise
        except Exception as error:
            raise OSError(*error.args) from error  # termios.error, which is none
        self._port.baudrate = baud
        self._port.tx_time_per_byte = BITS * 1e3 / baud  # ms

    def name(self, servo: int) -> str:
        """Return what a servo is called in all that is told."""
        moves = self._names.get(servo)
        return f"servo {servo} ({moves})" if moves else f"servo {servo}"

    # -- one servo, at leisure ---------------------------------------------------

    def ping(self, servo: int, tries: int = CALLS) -> int | None:
        """Return a servo's model number; None if it does not answer."""
        for _ in range(tries):
            model, result, _ = self._packets.ping(self._port, servo)
            if result == self._sdk.COMM_SUCCESS:
                return int(model)
        return None

    def present(self) -> dict[int, int]:
        """Return the model numbers of all that answer, by ID; takes about 1 s."""
        found, _ = self._packets.broadcastPing(self._port)
        return {int(servo): int(model) for servo, (model, _) in sorted(found.items())}

    def again(self, once: Callable[[], Result], tries: int = TRIES) -> Result:
        """Do it until nothing is lost or damaged on the way; so often at most."""
        for _ in range(tries - 1):
            try:
                return once()
            except (TimeoutError, WireError):
                self.damaged += 1
        return once()

    def read(self, servo: int, register: Register) -> int:
        """Return the value of a register."""
        return self.again(lambda: register.unpack(self.look(servo, register)))

    def ask(self, servo: int) -> Said:
        """Return what tells the value of each of a servo's registers, as it is now."""
        data = self.again(lambda: self.look(servo, table.MODEL, table.TEMPERATURE))
        return lambda register: register.unpack(data, table.MODEL.address)

    def look(self, servo: int, first: Register, last: Register | None = None) -> bytes:
        """Return the bytes from one register to another; one try."""
        last = last or first
        size = last.address + last.size - first.address
        data, result, error = self._packets.readTxRx(
            self._port, servo, first.address, size
        )
        return self._answer(servo, data, result, error, size)

    def write(self, servo: int, register: Register, value: int, what: str) -> None:
        """Set a register; `what` says what for, in an error."""

        def once() -> None:
            data = register.pack(value)
            result, error = self._packets.writeTxRx(
                self._port, servo, register.address, len(data), list(data)
            )
            self._check(servo, result)
            if error & ~ALERT:
                self._damaged(servo, error)
                besides = ""
                if error & ALERT:
                    ill = self.read(servo, table.HARDWARE_ERROR)
                    besides = f"; {table.hardware_errors(ill)}"
                raise NoDeviceError(
                    f"{self.name(servo)} refuses {what}: {_said(error)}{besides}."
                )

        self.again(once)

    def reboot(self, servo: int) -> None:
        """Have a servo start anew; it is deaf for a few tenths of a second."""

        def once() -> None:
            result, _ = self._packets.reboot(self._port, servo)
            self._check(servo, result)

        self.again(once)

    # -- all of them, in every exchange ------------------------------------------

    def sync_write(self, register: Register, values: Mapping[int, int]) -> None:
        """Set a register of many servos by one packet, which none of them answers."""
        group = self._sdk.GroupSyncWrite(
            self._port, self._packets, register.address, register.size
        )
        for servo, value in values.items():
            group.addParam(servo, register.pack(value))
        self._check(None, group.txPacket())

    def sync_read(
        self, first: Register, last: Register, servos: Iterable[int]
    ) -> dict[int, bytes]:
        """Return the bytes from one register to another, of many servos.

        Who is not understood is asked once more. `alerts` says which of them report
        that something is wrong with them.
        """
        size = last.address + last.size - first.address
        found: dict[int, bytes] = {}
        missing = list(servos)
        for _ in range(2):
            wrong: list[Exception] = []
            group = self._sdk.GroupSyncRead(
                self._port, self._packets, first.address, size
            )
            for servo in missing:
                group.addParam(servo)
            self._check(None, group.txPacket())
            # Not group.rxPacket(): that stops at the first that is damaged, and throws
            # away what the others say is wrong with them.
            for servo in missing:
                data, result, error = self._packets.readRx(self._port, servo, size)
                if error & ALERT:
                    self.alerts.add(servo)
                try:
                    found[servo] = self._answer(servo, data, result, error, size)
                except (TimeoutError, WireError) as why:
                    self.damaged += 1
                    wrong.append(why)
            if not wrong:
                return found
            missing = [servo for servo in missing if servo not in found]
        # The first: while it is waited for, the SDK takes in what the others say.
        raise wrong[0]

    # -- what came ---------------------------------------------------------------

    def _answer(
        self, servo: int, data: Iterable[int], result: int, error: int, size: int
    ) -> bytes:
        self._check(servo, result)
        if error & ~ALERT:
            self._damaged(servo, error)
            raise NoDeviceError(
                f"{self.name(servo)} refuses to be read: {_said(error)}."
            )
        data = bytes(data)
        if len(data) != size:
            # A late answer to something else.
            raise WireError(
                f"{self.name(servo)} answered {len(data)} bytes; expected {size}"
            )
        return data

    def _check(self, servo: int | None, result: int) -> None:
        """Raise what the SDK's result says, if it is no success."""
        if result == self._sdk.COMM_SUCCESS:
            return
        who = "the bus" if servo is None else self.name(servo)
        if result == self._sdk.COMM_RX_TIMEOUT:
            raise TimeoutError(f"{who} does not answer")
        if result == self._sdk.COMM_RX_CORRUPT:
            raise WireError(f"what {who} answers is damaged")
        raise OSError(f"{who}: {self._packets.getTxRxResult(result)}")

    def _damaged(self, servo: int, error: int) -> None:
        """Raise WireError if that is what a servo says of what it heard."""
        if error & ~ALERT == table.DAMAGED:
            raise WireError(f"{self.name(servo)} heard a damaged packet")


def _said(error: int) -> str:
    return table.ERRORS.get(error & ~ALERT, f"error {error & ~ALERT}")
