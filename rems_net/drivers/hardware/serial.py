"""SerialDriven: base of the drivers of devices at a serial port."""

from contextlib import suppress
from threading import Event
from typing import ClassVar, Protocol

from rems_net.agents.ports import Settings
from rems_net.agents.wall import wall
from rems_net.defdict import integer, text
from rems_net.drivers.hardware.driven import Driven, NoDeviceError
from rems_net.drivers.hardware.frames import Kind
from rems_net.drivers.hardware.held import Held, PortError
from rems_net.drivers.hardware.holder import PAUSE, TRIES, SerialPort
from rems_net.drivers.hardware.ports import Line, moved, ports, refusal
from rems_net.errors import MissingPartError, SchemaError
from rems_net.libraries import load, look_for

#: s. The port may take this long to accept this process's own halt.
HALTING = 0.25


class DriverLine(Line, Protocol):
    """A serial port with the methods of pyserial that a driver may use."""

    write_timeout: float | None

    def read_until(self, expected: bytes, /) -> bytes: ...
    def reset_output_buffer(self) -> None: ...


class HeldSerial(Held):
    """A serial port, with methods of pyserial.

    timeout: s that `read` waits. write_timeout: s that the port may take to accept
    bytes.
    """

    def __init__(self, timeout: float, write_timeout: float | None):
        super().__init__()
        self.timeout, self.write_timeout = timeout, write_timeout
        self._name, self._baud = "", 0

    def reach(self, name: str, baud: int) -> None:
        """Open the port of this name. Raises OSError."""
        self.open("serial", name=name, baud=baud, write_timeout=self.write_timeout)
        self._name, self._baud = name, baud

    def halt_alone(self, halt: bytes) -> None:
        """Open the port in this process, and halt the robot."""
        with suppress(Exception):  # the port is gone, too
            port = SerialPort(self._name, self._baud, HALTING)
            port.leave()  # the bytes of a write that hangs come before the halt
            for _ in range(TRIES):
                port.write(halt)
                Event().wait(PAUSE)
            port.close()

    @property
    def baudrate(self) -> int:
        """Bits per second."""
        return self._baud

    @baudrate.setter
    def baudrate(self, baud: int) -> None:
        self._baud = baud
        self._send(Kind.BAUD, str(baud).encode())

    @property
    def in_waiting(self) -> int:
        """Number of bytes that `read` would return at once."""
        self._take_all()
        return len(self._buffer)

    def read(self, size: int = 1) -> bytes:
        """Return `size` bytes, or fewer after `timeout`. Raises OSError."""
        until = wall() + self.timeout
        while len(self._buffer) < size and self._take_in(until - wall()):
            pass
        return self._cut(size)

    def read_until(self, end: bytes) -> bytes:
        """Return all up to `end`, or what came within `timeout`. Raises OSError."""
        until = wall() + self.timeout
        while end not in self._buffer and self._take_in(until - wall()):
            pass
        found = self._buffer.find(end)
        return self._cut(found + len(end) if found >= 0 else len(self._buffer))

    def reset_output_buffer(self) -> None:
        """Do nothing: `close` discards the bytes."""


class SerialDriven(Driven):
    """Base of drivers at a serial port; a subclass writes only `exchange`.

    timeout: s for a reply; the port may take five times as long to write.
    halt: for a device without a watchdog, bytes that stop it even after a broken
        command. If given, another process holds the port, and writes them when this
        process has written nothing for `max_age`.
    farewell: bytes after them if this one is gone.
    """

    options = Settings(
        Driven.options.fields,
        port=text(doc="/dev/ttyUSB0, /dev/cu.usbserial-1, COM3"),
        baud=integer(default=115_200, range=(50, 10_000_000), doc="bits per second"),
    )
    timeout: ClassVar[float] = 0.05
    halt: ClassVar[bytes] = b""
    farewell: ClassVar[bytes] = b""
    checks = (
        "Check, in this order: 1. that its cable sits firmly, at both ends; 2. that it "
        "is switched on; 3. that its port is still there: rems board ports"
    )

    line: DriverLine | None = None
    _holder: HeldSerial | None = None
    #: serial number of the adapter at the first connection; "" if it has none
    _serial: str | None = None

    def prepare(self) -> None:
        look_for("serial", "hardware")
        super().prepare()
        if not self.options.port:
            raise SchemaError(
                f"{self.key} needs the name of its port, such as options = {{ port = "
                '"/dev/ttyUSB0" } or "COM3" in a file, or --set options.port=COM3 '
                "behind a verb. To list the ports and their devices, type: rems "
                "board ports (R0309)"
            )

    def connect(self) -> None:
        """Open the port, for this program only."""
        library = load("serial", "hardware")
        if not hasattr(library, "Serial"):
            raise MissingPartError(
                "There is another library of the name serial in the way. Type: pip "
                "uninstall serial, then: pip install --force-reinstall pyserial (R0302)"
            )
        port, baud, writing = self._find(), self.options.baud, 5 * self.timeout
        try:
            if self.halt:
                self._holder = self._holder or HeldSerial(self.timeout, writing)
                self._holder.reach(port, baud)
                self._holder.arm(self.max_age, self.halt, self.farewell)
                self.line = self._holder
            else:
                self.line = library.Serial(
                    port,
                    baud,
                    timeout=self.timeout,
                    write_timeout=writing,
                    exclusive=True,
                )
        except Exception as error:  # also termios.error, which is no OSError
            raise NoDeviceError(refusal(port, error)) from error

    def _find(self) -> str:
        """Return the adapter's port, which may have another name when it is back."""
        port = str(self.options.port)
        if self._serial is None:
            at = (known.serial for known in ports() if known.device == port)
            self._serial = next(at, "")
        elif self._serial and (now := moved(port, self._serial, ports())) != port:
            self.note(f"finds its adapter at {now}, by its serial number")
            return now
        return port

    def disconnect(self) -> None:
        """Close the port, and discard bytes that were not sent yet."""
        line, self.line = self.line, None
        if line is not None:
            # If the device was unplugged: termios.error, which is no OSError.
            with suppress(Exception):
                line.reset_output_buffer()
            line.close()

    def close(self) -> None:
        """Stop the robot, and end the process that holds its port."""
        try:
            super().close()
        finally:
            held, self._holder = self._holder, None
            if held is not None:
                held.end()

    def explain(self, error: OSError) -> str:
        """Explain an error of the system or of pyserial as the end of the line."""
        system = error.errno is not None or isinstance(error, PortError)
        if not system and not type(error).__module__.startswith("serial"):
            return ""  # a driver's own error has its own words
        why = error.strerror or str(error)
        return (
            f"the line at {self.options.port} broke off, as when a plug is pulled out: "
            f"{why}"
        )

    def ask(self, request: bytes, size: int = 0, end: bytes = b"\n") -> bytes:
        """Write `request`; return a reply of `size` bytes, or one that ends with `end`.

        Late bytes of the last reply are discarded first. Raises TimeoutError for a
        reply that is late or too short.
        """
        line = self.line
        if line is None:
            raise OSError("the port is not open")
        # reset_input_buffer() raises termios.error if the device was unplugged.
        line.read(line.in_waiting)
        line.write(request)
        reply = line.read(size) if size else line.read_until(end)
        if len(reply) < size if size else not reply.endswith(end):
            raise TimeoutError(
                f"{len(reply)} bytes came within {self.timeout * 1e3:g} ms: "
                f"{reply[:40]!r}"
            )
        return reply
