"""The control table of the X430 servos: registers' addresses, sizes and units.

Source: ROBOTIS e-Manual, XL430-W250 and XM430-W350; all servos of the series have
these registers.
"""

from math import pi
from typing import NamedTuple


class Register(NamedTuple):
    """A register: its address and size in bytes, little-endian."""

    address: int
    size: int
    signed: bool = False

    def pack(self, value: int) -> bytes:
        """Return the bytes of a value; a negative one as its two's complement."""
        return (value % (1 << 8 * self.size)).to_bytes(self.size, "little")

    def unpack(self, data: bytes, start: int | None = None) -> int:
        """Return the value in `data`, which begins at the address `start`."""
        at = 0 if start is None else self.address - start
        return int.from_bytes(data[at : at + self.size], "little", signed=self.signed)


# Below RAM: kept without power, and writable only while the torque is off.
MODEL = Register(0, 2)
FIRMWARE = Register(6, 1)
ID = Register(7, 1)
BAUD = Register(8, 1)
RETURN_DELAY = Register(9, 1)
DRIVE_MODE = Register(10, 1)
OPERATING_MODE = Register(11, 1)
HOMING_OFFSET = Register(20, 4, signed=True)
TEMPERATURE_LIMIT = Register(31, 1)
MAX_VOLTAGE = Register(32, 2)
MIN_VOLTAGE = Register(34, 2)
PWM_LIMIT = Register(36, 2)
CURRENT_LIMIT = Register(38, 2)
VELOCITY_LIMIT = Register(44, 4)
MAX_POSITION = Register(48, 4)
MIN_POSITION = Register(52, 4)
SHUTDOWN = Register(63, 1)
RAM = 64
TORQUE = Register(64, 1)
LED = Register(65, 1)
STATUS_RETURN = Register(68, 1)
REGISTERED = Register(69, 1)
HARDWARE_ERROR = Register(70, 1)
WATCHDOG = Register(98, 1, signed=True)
GOAL_PWM = Register(100, 2, signed=True)
GOAL_CURRENT = Register(102, 2, signed=True)
GOAL_VELOCITY = Register(104, 4, signed=True)
PROFILE_ACCELERATION = Register(108, 4)
PROFILE_VELOCITY = Register(112, 4)
GOAL_POSITION = Register(116, 4, signed=True)
#: profile velocity and goal position, which are neighbours, as one value
PROFILE_AND_GOAL = Register(112, 8)
REALTIME_TICK = Register(120, 2)
MOVING = Register(122, 1)
MOVING_STATUS = Register(123, 1)
PRESENT_PWM = Register(124, 2, signed=True)
PRESENT_LOAD = Register(126, 2, signed=True)
PRESENT_VELOCITY = Register(128, 4, signed=True)
PRESENT_POSITION = Register(132, 4, signed=True)
VOLTAGE = Register(144, 2)
TEMPERATURE = Register(146, 1)
#: first address after the table; the indirect addresses are left out
END = 147

#: One count of a velocity (rad/s: 0.229 revolutions per minute), of an acceleration
#: (rad/s2: 214.577 revolutions per square minute), of a position (rad), of the
#: watchdog (s).
VELOCITY = 0.229 * 2 * pi / 60
ACCELERATION = 214.577 * 2 * pi / 3600
POSITION = 2 * pi / 4096
WATCHDOG_STEP = 0.020
#: counts of a turn, and of a PWM of 100 %
TURN, FULL_PWM = 4096, 885

#: values of OPERATING_MODE
VELOCITY_MODE, POSITION_MODE, EXTENDED_MODE = 1, 3, 4
#: bit of DRIVE_MODE: the servo counts in the opposite direction
REVERSE = 0x01
#: values of BAUD, by bits per second
BAUDS = {
    9600: 0,
    57_600: 1,
    115_200: 2,
    1_000_000: 3,
    2_000_000: 4,
    3_000_000: 5,
    4_000_000: 6,
    4_500_000: 7,
}

#: model numbers of the servos that have this table and these units
MODELS = {
    1000: "XH430-W350",
    1010: "XH430-W210",
    1020: "XM430-W350",
    1030: "XM430-W210",
    1040: "XH430-V350",
    1050: "XH430-V210",
    1060: "XL430-W250",
    1070: "XC430-W150",
    1080: "XC430-W240",
    1090: "2XL430-W250",
    1160: "2XC430-W250",
}
#: other common servos
OTHERS = {
    350: "XL-320",
    1120: "XM540-W270",
    1130: "XM540-W150",
    1190: "XL330-M077",
    1200: "XL330-M288",
}

#: meaning of each bit of HARDWARE_ERROR
HARDWARE_ERRORS = {
    0x01: "its supply voltage is out of range",
    0x04: "it is too hot",
    0x08: "its encoder fails",
    0x10: "its electronics had a shock, or too little power",
    0x20: "it is overloaded",
}
#: bit of a status packet's error: HARDWARE_ERROR has the cause
ALERT = 0x80
#: value of the other seven bits: the servo received a damaged packet
DAMAGED = 3
#: meanings of the other seven bits' value
ERRORS = {
    1: "it failed to do so",
    2: "it does not know the instruction",
    3: "it received a damaged packet",
    4: "the value is out of its range",
    5: "the value has the wrong length",
    6: "the value is beyond a limit that is set in the servo",
    7: "the address cannot be written now, or at all",
}


def named(model: int) -> str:
    """Return the name of a model number."""
    name = MODELS.get(model) or OTHERS.get(model)
    return f"{name} (model {model})" if name else f"model {model}"


def hardware_errors(value: int) -> str:
    """Return the meaning of a value of HARDWARE_ERROR, in words; "" for none."""
    return " and ".join(text for bit, text in HARDWARE_ERRORS.items() if value & bit)
