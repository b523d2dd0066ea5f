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

#: attempts: to find a servo by pings; and for each packet to one that was found, if the
#: packet is not part of every exchange
CALLS, TRIES = 3, 6
#: bits on the line for one byte: start bit, eight data bits, stop bit
BITS = 10

Result = TypeVar("Result")
#: returns the value of a register of one servo, at one moment
Said = Callable[[Register], int]
#: a reply, by the SDK: bytes, result, error
Reply = tuple[Iterable[int], int, int]


class Bus:
    """Bus of servos: reads and writes their registers.

    port: the line's name.  names: what each servo moves, by ID. Both are for error
    messages.

    Raises TimeoutError if a servo does not answer, WireError if a packet is damaged,
    NoDeviceError if a servo refuses a value, and OSError if the line is broken.
    """

    def __init__(self, line: Line, port: str, names: Mapping[int, str]):
        self._names = names
        self.port = port
        #: servos that have reported a hardware error
        self.alerts: set[int] = set()
        #: packets that were lost or damaged
        self.damaged = 0
        self._sdk = sdk = load("dynamixel_sdk", "hardware")
        self._packets = sdk.PacketHandler(2.0)
        # The SDK's own openPort() would not lock the port, and its reads would poll
        # without a pause.
        self._line = line
        self._port = handler = sdk.PortHandler(port)
        handler.ser, handler.is_open = line, True
        # reset_input_buffer() raises termios.error if the device was unplugged.
        handler.clearPort = lambda: line.read(line.in_waiting)
        # The SDK's own clock is the time of day, which a user can set.
        handler.getCurrentTime = lambda: wall() * 1e3
        self.tune(line.baudrate)

    @property
    def baud(self) -> int:
        """Bits per second."""
        return int(self._port.baudrate)

    def tune(self, baud: int) -> None:
        """Set the bits per second. Raises OSError or ValueError if the port can't."""
        try:
            if self._line.baudrate != baud:
                self._line.baudrate = baud
        except (OSError, ValueError):
            raise
        except Exception as error:
            raise OSError(*error.args) from error  # termios.error is no OSError
        self._port.baudrate = baud
        self._port.tx_time_per_byte = BITS * 1e3 / baud  # ms

    def name(self, servo: int) -> str:
        """Return a servo's name for messages."""
        moves = self._names.get(servo)
        return f"servo {servo} ({moves})" if moves else f"servo {servo}"

    def ping(self, servo: int, tries: int = CALLS) -> int | None:
        """Return a servo's model number; None if it does not answer."""
        for _ in range(tries):
            model, result, _ = self._packets.ping(self._port, servo)
            if result == self._sdk.COMM_SUCCESS:
                return int(model)
        return None

    def present(self) -> dict[int, int]:
        """Return the model numbers of all servos that answer, by ID; takes 1 s."""
        found, _ = self._packets.broadcastPing(self._port)
        return {int(servo): int(model) for servo, (model, _) in sorted(found.items())}

    def again(self, once: Callable[[], Result], tries: int = TRIES) -> Result:
        """Return `once()`, tried `tries` times if a packet is lost or damaged."""
        for _ in range(tries - 1):
            try:
                return once()
            except (TimeoutError, WireError):
                self.damaged += 1
        return once()

    def ask(
        self, servo: int, first: Register = table.MODEL, tries: int = TRIES
    ) -> Said:
        """Return a function with the values of a servo's registers as of now.

        first: the first of them
        """
        size = _size(first, table.TEMPERATURE)

        def once() -> Said:
            reply = self._packets.readTxRx(self._port, servo, first.address, size)
            return self._answer(servo, first, size, reply)

        return self.again(once, tries)

    def write(self, servo: int, register: Register, value: int, what: str) -> None:
        """Set a register. Raises NoDeviceError with `what` if the servo refuses it."""

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
                    ill = self.ask(servo)(table.HARDWARE_ERROR)
                    besides = f"; {table.hardware_errors(ill)}"
                raise NoDeviceError(
                    f"{self.name(servo)} refuses {what}: {_said(error)}{besides}."
                )

        self.again(once)

    def reboot(self, servo: int) -> None:
        """Restart a servo; it does not answer for a few tenths of a second."""

        def once() -> None:
            result, _ = self._packets.reboot(self._port, servo)
            self._check(servo, result)

        self.again(once)

    def sync_write(self, register: Register, values: Mapping[int, int]) -> None:
        """Set a register of many servos by one packet; the servos do not answer."""
        group = self._sdk.GroupSyncWrite(
            self._port, self._packets, register.address, register.size
        )
        for servo, value in values.items():
            group.addParam(servo, register.pack(value))
        self._check(None, group.txPacket())

    def sync_read(
        self, first: Register, last: Register, servos: Iterable[int]
    ) -> dict[int, Said]:
        """Return the values from one register to another, of many servos.

        A servo whose answer is lost or damaged is asked once more. Servos that report
        a hardware error are added to `alerts`.
        """
        size = _size(first, last)
        found: dict[int, Said] = {}
        missing = list(servos)
        for _ in range(2):
            wrong: list[Exception] = []
            group = self._sdk.GroupSyncRead(
                self._port, self._packets, first.address, size
            )
            for servo in missing:
                group.addParam(servo)
            self._check(None, group.txPacket())
            # Not group.rxPacket(): that stops at the first damaged answer, and drops
            # the errors that the other servos report.
            for servo in missing:
                reply = self._packets.readRx(self._port, servo, size)
                if reply[2] & ALERT:
                    self.alerts.add(servo)
                try:
                    found[servo] = self._answer(servo, first, size, reply)
                except (TimeoutError, WireError) as why:
                    self.damaged += 1
                    wrong.append(why)
            if not wrong:
                return found
            missing = [servo for servo in missing if servo not in found]
        # The first error: while we wait for that servo, the SDK reads others' answers.
        raise wrong[0]

    def _answer(self, servo: int, first: Register, size: int, reply: Reply) -> Said:
        data, result, error = reply
        self._check(servo, result)
        if error & ~ALERT:
            self._damaged(servo, error)
            raise NoDeviceError(
                f"{self.name(servo)} refuses to be read: {_said(error)}."
            )
        found = bytes(data)
        if len(found) != size:
            # A late answer to another question.
            raise WireError(
                f"{self.name(servo)} answered {len(found)} bytes; expected {size}"
            )
        return lambda register: register.unpack(found, first.address)

    def _check(self, servo: int | None, result: int) -> None:
        """Raise the error for the SDK's result, if that is no success."""
        if result == self._sdk.COMM_SUCCESS:
            return
        who = "the bus" if servo is None else self.name(servo)
        if result == self._sdk.COMM_RX_TIMEOUT:
            raise TimeoutError(f"{who} does not answer")
        if result == self._sdk.COMM_RX_CORRUPT:
            raise WireError(f"what {who} answers is damaged")
        raise OSError(f"{who}: {self._packets.getTxRxResult(result)}")

    def _damaged(self, servo: int, error: int) -> None:
        """Raise WireError if the servo reports that our packet was damaged."""
        if error & ~ALERT == table.DAMAGED:
            raise WireError(f"{self.name(servo)} received a damaged packet")


def _size(first: Register, last: Register) -> int:
    return last.address + last.size - first.address


def _said(error: int) -> str:
    return table.ERRORS.get(error & ~ALERT, f"error {error & ~ALERT}")
