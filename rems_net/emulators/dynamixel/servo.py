"""Servo: one emulated X430: its commands, its motion, and its failures."""

from collections.abc import Mapping
from math import pi

from rems_net.drivers.hardware.dynamixel import table
from rems_net.drivers.hardware.dynamixel.table import Register
from rems_net.emulators.dynamixel.memory import GOALS, Memory

#: rad/s. Top speed of a motor: no-load speeds of the e-Manual, at 12 V; at 24 V of the
#: XH430-V350 (1040) and -V210 (1050).
FASTEST = {
    number: rpm * pi / 30
    for number, rpm in {1060: 61, 1020: 46, 1040: 31, 1050: 52}.items()
}
#: s. It receives nothing for so long after a restart; a guess.
STARTS = 0.3
#: degC. Above every limit that can be set; and the usual temperature.
HOT, WARM = 101, 32


class Servo:
    """One servo. Its shaft is at `position` counts and turns at `speed` counts/s, seen
    from its horn; both continue past a full turn.

    kept: values of non-volatile registers that differ from the factory's
    """

    def __init__(self, kept: Mapping[Register, int], position: float = 2048.0):
        self.memory = Memory(dict(kept))
        self.position, self.speed = position, 0.0
        #: Whether it is on the bus; whether its torque can be switched on.
        self.there, self.strong = True, True
        self.hot = False
        #: Every value that was written to each register, for tests.
        self.told: dict[Register, set[int]] = {}
        #: Values of a write that waits for ACTION.
        self.waiting: dict[Register, int] = {}
        self._deaf = 0.0
        self._quiet = 0.0
        self._tick = 0.0
        self.show()

    @property
    def hears(self) -> bool:
        """Whether it receives packets now."""
        return self.there and self._deaf <= 0

    @property
    def number(self) -> int:
        """Its ID."""
        return self.memory[table.ID]

    @property
    def radians(self) -> float:
        """Speed of its shaft, rad/s, counter-clockwise."""
        return self.speed * table.POSITION

    def heard(self) -> None:
        """Reset the watchdog's time, since a packet to it has come."""
        self._quiet = 0.0

    def obey(self, values: Mapping[Register, int]) -> None:
        """Set registers; the values have been checked."""
        memory = self.memory
        for register, value in values.items():
            self.told.setdefault(register, set()).add(value)
            if register == table.OPERATING_MODE and value != memory[register]:
                self._change_mode(value)
            if register == table.TORQUE and value and not self._may_wake():
                continue
            memory[register] = value
        if table.TORQUE in values:
            self._quiet = 0.0

    def restart(self) -> None:
        """Start anew: with its settings, without torque, and within one turn.

        ROBOTIS does not publish its goals then; here they are 0, which would move it.
        """
        self.memory.restart()
        self.waiting = {}
        self.position %= table.TURN
        self.speed, self._deaf, self._quiet = 0.0, STARTS, 0.0
        self.show()

    def mend(self) -> None:
        """Be on the bus, and able to hold its torque."""
        self.there = self.strong = True

    def fail(self, bit: int) -> None:
        """Report a hardware error; switch the torque off if the shutdown bit is set."""
        memory = self.memory
        memory[table.HARDWARE_ERROR] |= bit
        if bit & memory[table.SHUTDOWN]:
            memory[table.TORQUE], self.speed = 0, 0.0

    def _change_mode(self, mode: int) -> None:
        for register in GOALS:
            self.memory[register] = 0
        self.memory[table.GOAL_PWM] = self.memory[table.PWM_LIMIT]
        if mode == table.POSITION_MODE:
            self.position %= table.TURN

    def _may_wake(self) -> bool:
        failed = self.memory[table.HARDWARE_ERROR] & self.memory[table.SHUTDOWN]
        return self.strong and not failed

    def live(self, dt: float) -> None:
        """Let `dt` seconds pass."""
        self._deaf -= dt
        self._tick = (self._tick + dt * 1e3) % 32768
        memory = self.memory
        memory[table.TEMPERATURE] = HOT if self.hot else WARM
        if self.hot:
            self.fail(0x04)
        if memory[table.TORQUE]:
            self._watch(dt)
        self.speed = self._wanted(dt) if memory[table.TORQUE] else 0.0
        self.position += self.speed * dt

    def _watch(self, dt: float) -> None:
        """Stop it if no packet has come for longer than the watchdog allows."""
        memory = self.memory
        self._quiet += dt
        patience = memory[table.WATCHDOG] * table.WATCHDOG_STEP
        if memory[table.WATCHDOG] > 0 and self._quiet > patience:
            memory[table.WATCHDOG] = -1

    def _wanted(self, dt: float) -> float:
        """Return the speed of its shaft over the next `dt` seconds, counts/s."""
        memory = self.memory
        if memory[table.WATCHDOG] < 0 or dt <= 0:
            return 0.0
        fastest = FASTEST.get(memory[table.MODEL], 6.0) / table.POSITION
        fastest *= abs(memory[table.GOAL_PWM]) / table.FULL_PWM
        per_count = table.VELOCITY / table.POSITION
        match memory[table.OPERATING_MODE]:
            case table.VELOCITY_MODE:
                goal = self._turned(memory[table.GOAL_VELOCITY] * per_count)
                slope = memory[table.PROFILE_ACCELERATION] * table.ACCELERATION
                change = slope / table.POSITION * dt or 2 * fastest
                goal = self.speed + max(-change, min(change, goal - self.speed))
            case table.POSITION_MODE | table.EXTENDED_MODE:
                # Of the profile only the top speed is modelled, not the acceleration.
                profile = memory[table.PROFILE_VELOCITY] * per_count
                fastest = min(profile or fastest, fastest)
                own = memory[table.GOAL_POSITION] - memory[table.HOMING_OFFSET]
                goal = (self._turned(own) - self.position) / dt
            case _:
                return 0.0
        return max(-fastest, min(fastest, goal))

    def _turned(self, value: float) -> float:
        """Return the value in its own direction of counting: negated if reversed."""
        reverse = self.memory[table.DRIVE_MODE] & table.REVERSE
        return -value if reverse else value

    def show(self) -> None:
        """Bring the read-only registers up to date."""
        memory = self.memory
        speed = self._turned(self.speed)
        own = round(self._turned(self.position)) + memory[table.HOMING_OFFSET]
        memory[table.PRESENT_POSITION] = own
        memory[table.PRESENT_VELOCITY] = round(speed * table.POSITION / table.VELOCITY)
        memory[table.MOVING] = int(abs(self.speed) > 1)
        memory[table.REALTIME_TICK] = int(self._tick)
