"""Memory: the control table of one servo, and the rules for writing it."""

from typing import NamedTuple

from rems_net.drivers.hardware.dynamixel import table
from rems_net.drivers.hardware.dynamixel.table import Register

#: Errors of status packets.
RESULT, INSTRUCTION, RANGE, LENGTH, LIMIT, ACCESS = 1, 2, 4, 5, 6, 7


class Cell(NamedTuple):
    """Initial value of a register, and the range of values that may be written."""

    initial: int
    low: int = 0
    high: int = -1  # less than `low`: read-only

    @property
    def writable(self) -> bool:
        return self.low <= self.high


#: The XL430-W250's factory values. A register without a range is read-only.
CELLS: dict[Register, Cell] = {
    table.MODEL: Cell(1060),
    table.FIRMWARE: Cell(45),
    table.ID: Cell(1, 0, 252),
    table.BAUD: Cell(1, 0, 7),
    table.RETURN_DELAY: Cell(250, 0, 254),
    table.DRIVE_MODE: Cell(0, 0, 13),
    table.OPERATING_MODE: Cell(3, 0, 16),
    table.HOMING_OFFSET: Cell(0, -1_044_479, 1_044_479),
    table.TEMPERATURE_LIMIT: Cell(72, 0, 100),
    table.MAX_VOLTAGE: Cell(140, 60, 140),
    table.MIN_VOLTAGE: Cell(60, 60, 140),
    table.PWM_LIMIT: Cell(885, 0, 885),
    table.VELOCITY_LIMIT: Cell(265, 0, 1023),
    table.MAX_POSITION: Cell(4095, 0, 4095),
    table.MIN_POSITION: Cell(0, 0, 4095),
    table.SHUTDOWN: Cell(52, 0, 63),
    table.TORQUE: Cell(0, 0, 1),
    table.LED: Cell(0, 0, 1),
    table.STATUS_RETURN: Cell(2, 0, 2),
    table.REGISTERED: Cell(0),
    table.HARDWARE_ERROR: Cell(0),
    table.WATCHDOG: Cell(0, 0, 127),
    table.GOAL_PWM: Cell(885, -885, 885),
    table.GOAL_VELOCITY: Cell(0, -1023, 1023),
    table.PROFILE_ACCELERATION: Cell(0, 0, 32767),
    table.PROFILE_VELOCITY: Cell(0, 0, 32767),
    table.GOAL_POSITION: Cell(0, -1_048_575, 1_048_575),
    table.REALTIME_TICK: Cell(0),
    table.MOVING: Cell(0),
    table.MOVING_STATUS: Cell(0),
    table.PRESENT_PWM: Cell(0),
    table.PRESENT_LOAD: Cell(0),
    table.PRESENT_VELOCITY: Cell(0),
    table.PRESENT_POSITION: Cell(0),
    table.VOLTAGE: Cell(120),
    table.TEMPERATURE: Cell(32),
}
AT = {register.address: register for register in CELLS}
MODES = {table.VELOCITY_MODE, table.POSITION_MODE, table.EXTENDED_MODE, 16}
GOALS = {table.GOAL_PWM, table.GOAL_VELOCITY, table.GOAL_POSITION} | {
    table.PROFILE_ACCELERATION,
    table.PROFILE_VELOCITY,
}


class Memory:
    """The values of all registers; `memory[table.TORQUE]` is one, without any rule."""

    def __init__(self, kept: dict[Register, int]):
        self._bytes = bytearray(table.END)
        for register, cell in CELLS.items():
            self[register] = kept.get(register, cell.initial)

    def __getitem__(self, register: Register) -> int:
        return register.unpack(bytes(self._bytes), 0)

    def __setitem__(self, register: Register, value: int) -> None:
        end = register.address + register.size
        self._bytes[register.address : end] = register.pack(value)

    def restart(self) -> None:
        """Reset the registers that are lost without power."""
        for register, cell in CELLS.items():
            if register.address >= table.RAM:
                self[register] = cell.initial

    def read(self, address: int, size: int) -> tuple[int, bytes]:
        """Return an error, or 0, and the bytes from an address on."""
        if address + size > table.END:
            return ACCESS, b""
        return 0, bytes(self._bytes[address : address + size])

    def write(self, address: int, data: bytes) -> tuple[int, dict[Register, int]]:
        """Return an error, or 0, and the values to set: all of the data, or none."""
        found: dict[Register, int] = {}
        at = 0
        while at < len(data):
            register = AT.get(address + at)
            if register is None or not CELLS[register].writable:
                return ACCESS, {}
            portion = data[at : at + register.size]
            if len(portion) < register.size:
                return LENGTH, {}
            value = register.unpack(portion)
            if error := self._refusal(register, value):
                return error, {}
            found[register] = value
            at += register.size
        return 0, found

    def _refusal(self, register: Register, value: int) -> int:
        """Return the error for a value that is refused, or 0."""
        cell = CELLS[register]
        if register.address < table.RAM and self[table.TORQUE]:
            return ACCESS
        if not cell.low <= value <= cell.high:
            return RANGE
        if register == table.OPERATING_MODE and value not in MODES:
            return RANGE
        # A watchdog that has triggered keeps the goals as they are, until it is reset.
        if register in GOALS and self[table.WATCHDOG] < 0:
            return RANGE
        return LIMIT if self._is_beyond(register, value) else 0

    def _is_beyond(self, register: Register, value: int) -> bool:
        """Return whether a value exceeds a limit that the table holds."""
        if register == table.GOAL_VELOCITY:
            return abs(value) > self[table.VELOCITY_LIMIT]
        if register == table.GOAL_PWM:
            return abs(value) > self[table.PWM_LIMIT]
        if register == table.PROFILE_VELOCITY:
            return value > self[table.VELOCITY_LIMIT]
        if register == table.GOAL_POSITION:
            low, high = self[table.MIN_POSITION], self[table.MAX_POSITION]
            in_turn = self[table.OPERATING_MODE] == table.POSITION_MODE
            return in_turn and not low <= value <= high
        return False
